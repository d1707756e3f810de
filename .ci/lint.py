"""Checks the rules of the house that no other linter knows; `make lint` runs it.

Who may import whom, docstrings on public names, the length of functions and of pages,
and words. Prints one line for each breach, and exits with 1 if there is any.
"""

import ast
import re
import statistics
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

#: Packages and modules from the ground up; each imports from its own floor or lower.
FLOORS = {
    "drake_disasm": (
        {"common"},
        {"effects"},
        {"parts"},
        {"scenario"},
        {"mdp", "cell", "logs"},
        {"devices"},
        {"safety"},
        {"systems"},
        {"twin"},
        {"stations", "policies"},
        {"task", "free_motion"},
        {"visualization", "learning", "experiments"},
    ),
    "sysid": (
        {"parameters", "confidence", "deadline", "optimise", "thresholds"},
        {"scenario_parameters"},
        {"models"},
        {"workers", "motor_constants", "experiment_design"},
        {"objective"},
        {"identification", "data_checks"},
        {"fitting"},
        {"residuals"},
        {"effect_selection"},
        {"export", "acceptance", "diagnosis"},
        {"validation", "report", "studies", "monitoring"},
    ),
}
#: What each part of the repository may import of the others.
MAY_IMPORT = {
    "drake_disasm": {"drake_disasm"},
    "sysid": {"drake_disasm", "sysid"},
    "examples": {"drake_disasm", "sysid"},
    "tools": {"drake_disasm", "sysid", "drake_disasm_cli"},
    "benchmarks": {"drake_disasm", "sysid", "benchmarks"},
}
#: Words that only this project's authors would understand, as names ...
PRIVATE_NAMES = {
    *("alike", "beside", "tempered", "become", "Beginning", "Bench", "tracer"),
    *("Tracer", "tell", "beat", "News", "on_step", "on_episode", "on_news"),
}
#: ... and in messages and docstrings.
PRIVATE_PHRASES = re.compile(
    r"\bmend (that|this|it)\b|keeps? what it promised|these data can't tell"
    r"|where squares end|what speaks for|\balike\b|\btempered\b"
    r"|noise that the fitted ones tell|against where we think"
)
LONGEST_FUNCTION = 50  # lines without the docstring
MEDIAN_FUNCTION, USUAL_FUNCTION = 8, 25  # lines, of all and of nine in ten
LONGEST_EXAMPLE = 100  # lines
#: Words of the manual by hand, and of one page.
MOST_WORDS, LONGEST_PAGE = 20_000, 1500
GENERATED = (
    *("docs/reference/api/", "docs/results/", "docs/reference/effects.md"),
    "docs/reference/experiments.md",
    *("docs/reference/command-line.md", "docs/reference/scenario.md"),
    "docs/reference/settings.md",
)
_HASH = re.compile(r"\b(?=[0-9a-f]*\d)(?=[0-9a-f]*[a-f])[0-9a-f]{7,12}\b")
_SYSTEM = re.compile(r"@system\nname: (\w+)\n.*?@endsystem", re.S)
_DIARY = re.compile(r"\b(used to|no longer|was mended|at this commit)\b")

SOURCES = sorted(f for part in MAY_IMPORT for f in (ROOT / part).rglob("*.py"))
PACKAGES = sorted({f.parent for top in FLOORS for f in (ROOT / top).rglob("*.py")})


def _name(file: Path) -> str:
    """Returns a module's full name; of a program, with its folder in front."""
    parts = file.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts).removesuffix(".__init__")


def _path(file: Path) -> str:
    return file.relative_to(ROOT).as_posix()


MODULES = {_name(file): file for file in SOURCES}
#: Programs import each other by their stems, from the folder that they are in.
PROGRAMS = {
    name.partition(".")[2]: name
    for name in MODULES
    if name.startswith(("tools.", "benchmarks."))
}


@cache
def _tree(file: Path) -> ast.Module:
    return ast.parse(file.read_text("utf-8"))


def _imports(file: Path) -> Iterator[str]:
    """Yields the full name of all that a file imports, wherever it does so."""
    for node in ast.walk(_tree(file)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@cache
def _imported_modules(file: Path) -> frozenset[str]:
    """Returns those of our modules that a file imports."""
    found = set()
    for name in _imports(file):
        for candidate in (name, name.rpartition(".")[0]):
            full = PROGRAMS.get(candidate, candidate)
            if full in MODULES:
                found.add(full)
                break
    return frozenset(found)


def imports_of_parts() -> Iterator[str]:
    """Yields imports from a part of the repository that may not be."""
    ours = {*MAY_IMPORT, "tests", "drake_disasm_cli"}
    for file in SOURCES:
        allowed = MAY_IMPORT[file.relative_to(ROOT).parts[0]]
        for top in {name.split(".")[0] for name in _imports(file)} & ours - allowed:
            yield f"{_path(file)}: imports {top}"


def arrows() -> Iterator[str]:
    """Yields imports that point up, rooms without a floor, and circles."""
    for top, floors in FLOORS.items():
        floor = {room: i for i, rooms in enumerate(floors) for room in rooms}
        names = [name for name in MODULES if name.startswith(f"{top}.")]
        rooms = {name.split(".")[1] for name in names}
        yield from (f"{top}/{room}: has no floor" for room in rooms - floor.keys())
        yield from (f"{top}/{room}: is not there" for room in floor.keys() - rooms)
        for name in names:
            for other in _imported_modules(MODULES[name]):
                if other.startswith(f"{top}."):
                    room, below = name.split(".")[1], other.split(".")[1]
                    if floor.get(below, 0) > floor.get(room, 99):
                        yield f"{_path(MODULES[name])}: imports {other}, from above"
    graph = {name: _imported_modules(file) - {name} for name, file in MODULES.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        yield f"circle of imports: {' <- '.join(error.args[1])}"


def packages() -> Iterator[str]:
    """Yields packages that do not say what they are, or are not installed."""
    for folder in PACKAGES:
        file = folder / "__init__.py"
        if not file.is_file() or not ast.get_docstring(_tree(file)):
            yield f"{_path(folder)}: __init__.py with a docstring is missing"
    text = (ROOT / "pyproject.toml").read_text("utf-8")
    listed = set(tomllib.loads(text)["tool"]["setuptools"]["packages"])
    found = {".".join(folder.relative_to(ROOT).parts) for folder in PACKAGES}
    for name in found ^ (listed - {"disasm_models", "drake_disasm_cli"}):
        yield f"pyproject.toml: package {name} is listed or there, and not both"


def _public(file: Path) -> Iterator[ast.FunctionDef | ast.ClassDef]:
    for node in ast.walk(_tree(file)):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            overload = any(ast.unparse(d) == "overload" for d in node.decorator_list)
            if not node.name.startswith("_") and not overload:
                yield node


def docstrings() -> Iterator[str]:
    """Yields public names that do not explain themselves."""
    for file in SOURCES:
        if not ast.get_docstring(_tree(file)):
            yield f"{_path(file)}:1: module without a docstring"
        if file.relative_to(ROOT).parts[0] == "examples":
            continue
        for node in _public(file):
            if not ast.get_docstring(node):
                yield f"{_path(file)}:{node.lineno}: {node.name} has no docstring"


def system_blocks() -> Iterator[str]:
    """Yields systems whose docstring has no block of ports, as Drake's have."""
    bases = {"LeafSystem", "Diagram", "Station", "SimulatedStation"}
    for file in (ROOT / "drake_disasm").rglob("*.py"):
        for node in ast.walk(_tree(file)):
            if not isinstance(node, ast.ClassDef) or node.name in bases:
                continue
            if not {getattr(base, "id", "") for base in node.bases} & bases:
                continue
            found = _SYSTEM.findall(ast.get_docstring(node) or "")
            if found != [node.name.lstrip("_")]:
                yield f"{_path(file)}:{node.lineno}: {node.name}: no @system block"


def _length(node: ast.FunctionDef) -> int:
    """Returns a function's lines without its docstring."""
    lines = (node.end_lineno or 0) - node.lineno + 1
    if ast.get_docstring(node):
        lines -= (node.body[0].end_lineno or 0) - node.body[0].lineno + 1
    return lines


def lengths() -> Iterator[str]:
    """Yields functions that are too long, and whether most are."""
    every = []
    for file in SOURCES:
        for node in ast.walk(_tree(file)):
            if isinstance(node, ast.FunctionDef):
                every.append(_length(node))
                if every[-1] > LONGEST_FUNCTION:
                    yield f"{_path(file)}:{node.lineno}: {node.name}: {every[-1]} lines"
    if statistics.median(every) > MEDIAN_FUNCTION:
        yield f"functions have {statistics.median(every)} lines (median)"
    if statistics.quantiles(every, n=10)[-1] > USUAL_FUNCTION:
        yield f"a tenth of the functions is over {USUAL_FUNCTION} lines"


def examples() -> Iterator[str]:
    """Yields examples that are long, or do not say how they are run."""
    for file in (ROOT / "examples").glob("*.py"):
        text = file.read_text("utf-8")
        if len(text.splitlines()) > LONGEST_EXAMPLE:
            yield f"{_path(file)}: over {LONGEST_EXAMPLE} lines"
        if f"python {_path(file)}" not in text:
            yield f"{_path(file)}: does not say `python {_path(file)}`"


def words() -> Iterator[str]:
    """Yields private words in names, messages and docstrings; changes of sys.path."""
    for file in SOURCES:
        for node in ast.walk(_tree(file)):
            match node:
                case ast.Name(id=name) | ast.Attribute(attr=name) | ast.arg(arg=name):
                    if name in PRIVATE_NAMES:
                        yield f"{_path(file)}:{node.lineno}: name '{name}'"
                case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                    if name in PRIVATE_NAMES:
                        yield f"{_path(file)}:{node.lineno}: name '{name}'"
                case ast.Constant(value=str(text)):
                    if found := PRIVATE_PHRASES.search(" ".join(text.lower().split())):
                        yield f"{_path(file)}:{node.lineno}: '{found[0]}'"


def _pages() -> list[Path]:
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return [page for page in pages if not _path(page).startswith(GENERATED)]


def manual() -> Iterator[str]:
    """Yields pages that are too long, or read like a diary."""
    total = 0
    for page in _pages():
        text = page.read_text("utf-8")
        count = len(text.split())
        total += count
        if count > LONGEST_PAGE:
            yield f"{_path(page)}: {count} words; {LONGEST_PAGE} at most"
        for number, line in enumerate(text.splitlines(), 1):
            if found := _HASH.search(line) or _DIARY.search(line):
                yield f"{_path(page)}:{number}: '{found[0]}' belongs into git's history"
    if total > MOST_WORDS:
        yield f"the manual has {total} words; {MOST_WORDS} at most"


RULES = (
    imports_of_parts,
    arrows,
    packages,
    docstrings,
    system_blocks,
    lengths,
    examples,
    words,
    manual,
)


def main() -> int:
    """Prints every breach; returns whether there is one."""
    breaches = [breach for rule in RULES for breach in rule()]
    print("\n".join(breaches) or f"{len(SOURCES)} files keep {len(RULES)} rules")
    return bool(breaches)


if __name__ == "__main__":
    sys.exit(main())

"""The rules of the house: who may import whom, how long a function may be, words."""

import ast
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]

#: Packages and modules from the ground up; each imports from its own floor or lower.
FLOORS = {
    "drake_disasm": (
        {"common"},
        {"effects"},
        {"scenario", "ports"},
        {"mdp", "cell", "logs"},
        {"impact", "devices", "importing"},
        {"safety"},
        {"systems"},
        {"stations", "policies"},
        {"task", "batch", "free_motion"},
        {"visualization", "learning", "fakes"},
        {"studies"},
    ),
    "sysid": (
        {"parameters", "confidence", "deadline", "optimise", "thresholds"},
        {"scenario_parameters"},
        {"models"},
        {"workers"},
        {"objective"},
        {"identification", "data_checks"},
        {"effect_selection"},
        {"validation", "report", "experiment_design", "studies"},
    ),
}
#: What each part of the repository may import of the others.
MAY_IMPORT = {
    "drake_disasm": {"drake_disasm"},
    "sysid": {"drake_disasm", "sysid"},
    "examples": {"drake_disasm", "sysid"},
    "tools": {"drake_disasm", "sysid", "tools"},
    "benchmarks": {"drake_disasm", "sysid", "benchmarks"},
}
SOURCES = sorted(f for part in MAY_IMPORT for f in (ROOT / part).rglob("*.py"))
PACKAGES = sorted({f.parent for p in FLOORS for f in (ROOT / p).rglob("*.py")})


def _name(file: Path) -> str:
    """Returns a module's full name; of a program, with its folder in front."""
    return ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(
        ".__init__"
    )


MODULES = {_name(file): file for file in SOURCES}
#: Programs import each other by their stems, from the folder that they are in.
PROGRAMS = {
    f.stem: _name(f) for f in SOURCES if f.parent.name in ("tools", "benchmarks")
}


@cache
def _tree(file: Path) -> ast.Module:
    return ast.parse(file.read_text())


def _imports(file: Path) -> Iterator[str]:
    """Yields the full name of all that a file imports, wherever it does so."""
    for node in ast.walk(_tree(file)):
        if isinstance(node, ast.Import):
            yield from (PROGRAMS.get(alias.name, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            module = PROGRAMS.get(node.module or "", node.module or "")
            yield from (f"{module}.{alias.name}" for alias in node.names)


def _imported_modules(file: Path) -> set[str]:
    """Returns those of our modules that a file imports."""
    found = set()
    for name in _imports(file):
        parent = name.rpartition(".")[0]
        found |= {name if name in MODULES else parent} & MODULES.keys()
    return found


@pytest.mark.parametrize("file", SOURCES, ids=_name)
def test_parts_import_only_what_they_may(file: Path) -> None:
    parts = {*MAY_IMPORT, "tests"}
    allowed = MAY_IMPORT[file.relative_to(ROOT).parts[0]]
    used = {name.split(".")[0] for name in _imports(file)} & parts
    assert used <= allowed


@pytest.mark.parametrize("top", FLOORS)
def test_arrows_point_down(top: str) -> None:
    floor = {room: i for i, rooms in enumerate(FLOORS[top]) for room in rooms}
    for name, file in MODULES.items():
        if name.startswith(f"{top}."):
            room = name.split(".")[1]
            for other in _imported_modules(file):
                if other.startswith(f"{top}."):
                    assert floor[other.split(".")[1]] <= floor[room], (name, other)


@pytest.mark.parametrize("top", FLOORS)
def test_every_room_has_a_floor_and_is_there(top: str) -> None:
    rooms = {name.split(".")[1] for name in MODULES if name.startswith(f"{top}.")}
    assert rooms == set.union(*FLOORS[top])


def test_no_module_imports_itself_by_way_of_others() -> None:
    graph = {name: _imported_modules(file) - {name} for name, file in MODULES.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"circle of imports: {' <- '.join(error.args[1])}")


def test_a_circle_would_be_seen() -> None:
    """The check above leans on names being resolved to modules."""
    edges = sum(len(_imported_modules(file)) for file in SOURCES)
    assert edges > 3 * len(SOURCES)


@pytest.mark.parametrize("folder", PACKAGES, ids=lambda f: str(f.relative_to(ROOT)))
def test_every_folder_is_a_package_that_says_what_it_is(folder: Path) -> None:
    assert ast.get_docstring(_tree(folder / "__init__.py"))


def test_every_package_is_installed() -> None:
    with (ROOT / "pyproject.toml").open("rb") as stream:
        listed = tomllib.load(stream)["tool"]["setuptools"]["packages"]
    found = {".".join(folder.relative_to(ROOT).parts) for folder in PACKAGES}
    assert found | {"disasm_models"} == set(listed)


def test_programs_and_examples_leave_the_search_path_alone() -> None:
    for part in ("tools", "benchmarks", "examples"):
        for file in (ROOT / part).glob("*.py"):
            paths = {
                ast.unparse(node)
                for node in ast.walk(_tree(file))
                if isinstance(node, ast.Attribute)
            }
            assert "sys.path" not in paths, file


def _lengths() -> dict[str, int]:
    """Returns the lines of each function without its docstring."""
    found = {}
    for file in SOURCES:
        for node in ast.walk(_tree(file)):
            if isinstance(node, ast.FunctionDef):
                lines = (node.end_lineno or 0) - node.lineno + 1
                if ast.get_docstring(node):
                    text = node.body[0]
                    lines -= (text.end_lineno or 0) - text.lineno + 1
                found[f"{_name(file)}:{node.lineno} {node.name}"] = lines
    return found


def test_functions_are_short() -> None:
    lengths = _lengths()
    too_long = {name: lines for name, lines in lengths.items() if lines > 50}
    assert not too_long
    values = list(lengths.values())
    assert np.median(values) <= 8 and np.percentile(values, 90) <= 25


#: The house's former private words, as names.
PRIVATE_NAMES = {
    *("alike", "beside", "tempered", "become", "Beginning", "Bench", "tracer"),
    *("Tracer", "tell", "beat", "News", "on_step", "on_episode", "on_news"),
}
#: And what they were in messages and docstrings.
PRIVATE_PHRASES = re.compile(
    r"\bmend (that|this|it)\b|keeps? what it promised|these data can't tell"
    r"|where squares end|what speaks for|\balike\b|\btempered\b"
    r"|noise that the fitted ones tell|against where we think"
)


def _names(file: Path) -> Iterator[str]:
    for node in ast.walk(_tree(file)):
        match node:
            case ast.Name(id=name) | ast.Attribute(attr=name) | ast.arg(arg=name):
                yield name
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                yield name


def _texts(file: Path) -> Iterator[str]:
    for node in ast.walk(_tree(file)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield " ".join(node.value.split())


@pytest.mark.parametrize("file", SOURCES, ids=_name)
def test_names_and_messages_are_in_the_fields_words(file: Path) -> None:
    assert not set(_names(file)) & PRIVATE_NAMES
    found = [text for text in _texts(file) if PRIVATE_PHRASES.search(text.lower())]
    assert not found

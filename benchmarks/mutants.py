"""Measures how many small errors in the packages the tests catch.

A mutant is one change of one expression in one function: a comparison that is another,
a constant that is half as large again, a condition that is negated, a call that is left
out. A sample of them is drawn; each is put into a copy of the tree and meets the tests
that reach its line, the quickest first, until one fails or five seconds' worth of
them are over.

  sample   draws mutants and writes them to a file
  reach    runs the tests once under coverage, which tells who reaches which line
  run      tries each mutant on a tree; goes on with what --out already has
  compare  counts what is caught in two trees: before and after a change of the tests

Functions that Numba compiles are left out, since coverage does not see into them. A
mutant belongs to the text of its function: in a tree where that has changed it is
skipped, and `compare` counts those that were tried in both.
"""

import argparse
import ast
import compileall
import contextlib
import copy
import hashlib
import importlib
import json
import os
import py_compile
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import coverage
import pytest

from drake_disasm.common import options, program
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import write_json

_PACKAGES = ("drake_disasm", "sysid")
_PER_MUTANT = 5.0  # s of tests, of the processor's time without a mutant
_PATIENCE = 10.0  # a mutant's tests may take so many times longer, and
_START = 60.0  # s more
_MOST_TESTS = 40  # of a mutant
_SLOW_IMPORTS = (
    *("gymnasium", "matplotlib.pyplot", "plotly", "pyarrow.parquet", "pydrake.all"),
    *("scipy.optimize", "scipy.stats", "sklearn.linear_model", "torch"),
)
_EXAMPLES = """examples:
  python benchmarks/mutants.py sample --out build/mutants.json
  python benchmarks/mutants.py reach --out build/reach
  python benchmarks/mutants.py run --mutants build/mutants.json --reach build/reach \\
      --out build/after.jsonl
  python benchmarks/mutants.py compare build/before.jsonl build/after.jsonl
"""

_OTHER: dict[type, Any] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.And: ast.Or,
    ast.Or: ast.And,
}


# ---- what a mutant is --------------------------------------------------------------


def _changed(node: ast.AST) -> ast.AST | None:
    """Returns a node with one small error, or None where none is made of its kind."""
    new = copy.copy(node)
    match new:
        case ast.Compare(ops=[op]) if type(op) in _OTHER:
            new.ops = [_OTHER[type(op)]()]
        case ast.BinOp(op=op) | ast.BoolOp(op=op) if type(op) in _OTHER:
            new.op = _OTHER[type(op)]()
        case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=operand):
            return operand
        case ast.Constant(value=bool(value)):
            new.value = not value
        case ast.Constant(value=int(value)):
            new.value = value + 1
        case ast.Constant(value=float(value)):
            new.value = 1.5 * value if value else 1.0
        case ast.IfExp(test=test):
            new.test = ast.UnaryOp(ast.Not(), test)
        case _:
            return None
    return new


def _statement(node: ast.AST) -> tuple[ast.AST, ast.AST] | None:
    """Returns what of a statement is replaced, and by what; None for most."""
    match node:
        case ast.If(test=test) | ast.While(test=test):
            return test, ast.UnaryOp(ast.Not(), test)
        case ast.Return(value=ast.expr() as value):
            return value, ast.Constant(None)
        case ast.Expr(value=ast.Call()):
            return node, ast.Pass()
    return None


def _replacements(function: ast.AST) -> Iterator[tuple[ast.AST, ast.AST]]:
    """Yields all that can be replaced in a function, and by what, in a fixed order."""
    skipped: set[int] = set()
    for node in ast.walk(function):
        if isinstance(node, ast.Raise | ast.arg | ast.JoinedStr | ast.Slice):
            skipped |= {id(inner) for inner in ast.walk(node)}
        if isinstance(node, ast.FunctionDef) and node.returns:
            skipped |= {id(inner) for inner in ast.walk(node.returns)}
        if id(node) in skipped:
            continue
        if found := _statement(node):
            yield found
        elif (changed := _changed(node)) is not None:
            yield node, changed


def _functions(tree: ast.AST, prefix: str = "") -> Iterator[tuple[str, ast.AST]]:
    """Yields the outermost functions of a module with their qualified names."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.ClassDef):
            yield from _functions(node, f"{prefix}{node.name}.")
        elif isinstance(node, ast.FunctionDef):
            yield f"{prefix}{node.name}", node


def _fingerprint(function: ast.AST) -> str:
    return hashlib.sha256(ast.dump(function).encode()).hexdigest()[:16]


def all_mutants(tree: Path) -> list[dict[str, Any]]:
    """Returns every mutant of the packages in a tree, as plain data."""
    found = []
    for file in sorted(f for top in _PACKAGES for f in (tree / top).rglob("*.py")):
        text = file.read_text("utf-8")
        if "numba" in text:
            continue
        for name, function in _functions(ast.parse(text)):
            for i, (old, new) in enumerate(_replacements(function)):
                found.append(
                    {
                        "file": file.relative_to(tree).as_posix(),
                        "function": name,
                        "fingerprint": _fingerprint(function),
                        "index": i,
                        "old": ast.unparse(old)[:120],
                        "new": ast.unparse(new)[:120],
                    }
                )
    return found


def mutated(text: str, mutant: dict[str, Any]) -> tuple[str, int] | None:
    """Returns a module's text with a mutant in it, and the mutant's line.

    Returns:
        None if the text has no such function, or another one of that name.
    """
    for name, function in _functions(ast.parse(text)):
        if (
            name == mutant["function"]
            and _fingerprint(function) == (mutant["fingerprint"])
        ):
            old, new = list(_replacements(function))[mutant["index"]]
            return _replaced(text, old, new), old.lineno
    return None


def _replaced(text: str, old: Any, new: ast.AST) -> str:
    """Returns a text with a node's characters replaced; columns count bytes."""
    lines = [line.encode() for line in text.splitlines(keepends=True)]
    start, end = old.lineno - 1, old.end_lineno - 1
    words = ast.unparse(new)
    if not isinstance(new, ast.stmt):
        words = f"({words})"
    before = lines[start][: old.col_offset]
    after = lines[end][old.end_col_offset :]
    kept = [*lines[:start], before + words.encode() + after, *lines[end + 1 :]]
    return b"".join(kept).decode()


# ---- who reaches which line: a plugin of pytest ------------------------------------


class _Reach:
    """Records which test reaches which lines, and how long it takes."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._worker = os.environ.get("PYTEST_XDIST_WORKER", "main")
        self._coverage = coverage.Coverage(
            data_file=folder / f"coverage.{self._worker}",
            source=[str(Path.cwd() / name) for name in _PACKAGES],
            config_file=False,
        )
        self._seconds: defaultdict[str, float] = defaultdict(float)
        self._coverage.start()
        self._began = time.process_time()

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Gives what is run from now on to a test."""
        self._coverage.switch_context(_function_of(nodeid))
        self._began = time.process_time()

    def pytest_runtest_logfinish(self, nodeid: str) -> None:
        """Adds the processor's time that a test took."""
        self._seconds[_function_of(nodeid)] += time.process_time() - self._began

    def pytest_sessionfinish(self) -> None:
        """Writes both."""
        self._coverage.stop()
        self._coverage.save()
        if self._worker != "main":
            write_json(
                self._folder / f"seconds.{self._worker}.json", dict(self._seconds)
            )


def pytest_configure(config: pytest.Config) -> None:
    """Begins to record in each of pytest's workers, when this is given by -p."""
    if folder := os.environ.get("MUTANTS_REACH"):
        config.pluginmanager.register(_Reach(Path(folder)))


def _function_of(nodeid: str) -> str:
    """Returns a test's name without its parameters."""
    return nodeid.partition("[")[0]


def _record(tree: Path, folder: Path) -> None:
    """Runs the tests of a tree under coverage, on two workers."""
    folder.mkdir(parents=True, exist_ok=True)
    search = [str(tree), str(Path(__file__).parent)]
    environment = os.environ | {
        "MUTANTS_REACH": str(folder.resolve()),
        "PYTHONPATH": os.pathsep.join(search),
    }
    command = [sys.executable, "-m", "pytest", "-q", "-n", "2", "-p", "mutants"]
    command += ["-p", "no:cacheprovider", "--dist", "worksteal", "-m", "not slow"]
    subprocess.run(command, cwd=tree, env=environment, check=False)


class _Known:
    """Who reaches which line of a tree, as `reach` has recorded it."""

    def __init__(self, folder: Path, tree: Path) -> None:
        files = sorted(folder.glob("coverage.gw*"))
        if not files:
            raise DisasmError(f"{folder}: has no coverage.*; run `mutants.py reach`")
        self._data = [coverage.CoverageData(str(file)) for file in files]
        for data in self._data:
            data.read()
        self._seconds: defaultdict[str, float] = defaultdict(float)
        for file in folder.glob("seconds.*.json"):
            for name, seconds in json.loads(file.read_text()).items():
                self._seconds[name] = max(self._seconds[name], seconds)
        recorded = next(iter(self._data[0].measured_files()))
        parts = Path(recorded).parts
        top = next(i for i, part in enumerate(parts) if part in _PACKAGES)
        self._root = Path(*parts[:top])

    def tests(self, file: str, line: int) -> list[str]:
        """Returns the tests that reach a line, the quickest first, five seconds."""
        reached: set[str] = set()
        for data in self._data:
            lines = data.contexts_by_lineno(str(self._root / file))
            reached |= set(lines.get(line, ())) - {""}
        chosen: list[str] = []
        total = 0.0
        for name in sorted(reached, key=lambda n: self._seconds[n]):
            total += self._seconds[name]
            if chosen and (total > _PER_MUTANT or len(chosen) == _MOST_TESTS):
                break
            chosen.append(name)
        return chosen


# ---- trying mutants ----------------------------------------------------------------


def _try(tree: Path, mutant: dict[str, Any], known: _Known) -> dict[str, Any]:
    """Returns a mutant with its fate: caught, survived, unreached or changed."""
    file = tree / mutant["file"]
    text = file.read_text("utf-8") if file.is_file() else ""
    found = mutated(text, mutant)
    if found is None:
        return mutant | {"fate": "changed", "tests": 0, "seconds": 0.0}
    tests = known.tests(mutant["file"], found[1])
    if not tests:
        return mutant | {"fate": "unreached", "tests": 0, "seconds": 0.0}
    start = time.monotonic()
    try:
        file.write_text(found[0], "utf-8")
        code = _run_tests(tree, tests)
    finally:
        file.write_text(text, "utf-8")
    fate = "survived" if code == 0 else "caught"  # or broken at import, or endless
    return mutant | {
        "fate": fate,
        "tests": len(tests),
        "seconds": round(time.monotonic() - start, 2),
    }


def _run_tests(tree: Path, tests: Sequence[str]) -> int | None:
    """Returns pytest's exit status in a fork of this process; None if it hangs.

    The fork has imported what others wrote, and none of the packages: a second of
    tests is not preceded by five of imports.
    """
    child = os.fork()
    if child == 0:
        os.setpgid(0, 0)
        log = os.open(str(tree / "mutant.log"), os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(log, 1)
        os.dup2(log, 2)
        os.chdir(tree)
        sys.path[:0] = [str(tree), str(tree / "tools"), str(tree / "benchmarks")]
        for name in [n for n in sys.modules if n.partition(".")[0] in _PACKAGES]:
            del sys.modules[name]
        code = pytest.main(["-x", "-q", "-p", "no:cacheprovider", *tests])
        os._exit(int(code))
    deadline = time.monotonic() + _START + _PATIENCE * _PER_MUTANT
    while time.monotonic() < deadline:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            _end_group(child)
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.02)
    _end_group(child)
    os.waitpid(child, 0)
    return None


def _end_group(child: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)


def _preload() -> None:
    """Imports what takes long and is not ours, for the forks to share."""
    for name in _SLOW_IMPORTS:
        importlib.import_module(name)


def _copy_of(tree: Path, scratch: Path) -> Path:
    """Returns a copy of a tree, whose compiled files are checked by their text."""
    if scratch.exists():
        shutil.rmtree(scratch)
    left_out = shutil.ignore_patterns(".git", ".venv", "build", "__pycache__", "out")
    shutil.copytree(tree, scratch, ignore=left_out)
    mode = py_compile.PycInvalidationMode.CHECKED_HASH
    for top in (*_PACKAGES, "tests", "tools"):
        compileall.compile_dir(scratch / top, quiet=2, invalidation_mode=mode)
    return scratch


def _run(args: argparse.Namespace) -> None:
    """Tries all mutants that --out has not yet."""
    mutants = json.loads(args.mutants.read_text())
    done = args.out.read_text().splitlines() if args.out.is_file() else []
    sys.dont_write_bytecode = True
    os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
    known = _Known(args.reach, args.tree)
    tree = _copy_of(args.tree, args.scratch)
    os.environ["PYTHONPATH"] = str(tree)
    _preload()
    with args.out.open("a") as stream, program.ProgressBar("mutant") as bar:
        for i, mutant in enumerate(mutants):
            if i >= len(done):
                fate = _try(tree, mutant, known)
                stream.write(json.dumps(fate) + "\n")
                stream.flush()
            bar(program.ProgressUpdate("mutants", i + 1, len(mutants)))


def _rows(path: Path) -> dict[tuple[str, str, int], str]:
    rows = map(json.loads, path.read_text().splitlines())
    return {(r["file"], r["function"], r["index"]): r["fate"] for r in rows}


def comparison(before: Path, after: Path) -> str:
    """Returns what is caught of the mutants that were tried in both trees."""
    old, new = _rows(before), _rows(after)
    both = [k for k in old if k in new and "changed" not in (old[k], new[k])]
    lines = [f"{len(both)} mutants tried in both ({len(old)} and {len(new)})"]
    for name, fates in (("before", old), ("after", new)):
        count = Counter(fates[k] for k in both)
        lines.append(f"{name}: " + ", ".join(f"{v} {k}" for k, v in count.items()))
    lost = [k for k in both if old[k] == "caught" != new[k]]
    won = [k for k in both if new[k] == "caught" != old[k]]
    lines += [f"caught before alone: {file} {name} {i}" for file, name, i in lost]
    lines += [f"caught after alone: {file} {name} {i}" for file, name, i in won]
    return "\n".join(lines)


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("python benchmarks/mutants.py", __doc__, _EXAMPLES)
    commands = parser.add_subparsers(dest="command", required=True)
    here = Path(__file__).resolve().parents[1]
    sample = commands.add_parser("sample", help="draw mutants")
    sample.add_argument("--count", type=options.positive, default=300, metavar="N")
    sample.add_argument("--seed", type=options.seed, default=0)
    reach = commands.add_parser("reach", help="run the tests under coverage")
    run = commands.add_parser("run", help="try each mutant")
    run.add_argument("--mutants", type=Path, required=True, metavar="FILE")
    run.add_argument("--reach", type=Path, required=True, metavar="DIR")
    run.add_argument("--scratch", type=Path, default=here / "build/mutants")
    for each in (sample, reach, run):
        each.add_argument("--tree", type=Path, default=here, metavar="DIR")
        each.add_argument("--out", type=Path, required=True)
    compare = commands.add_parser("compare", help="count what is caught in two trees")
    compare.add_argument("before", type=Path)
    compare.add_argument("after", type=Path)
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    if args.command == "sample":
        found = all_mutants(args.tree)
        chosen = random.Random(args.seed).sample(found, args.count)
        write_json(args.out, chosen)
        print(f"{len(chosen)} of {len(found)} mutants: {args.out}")
    elif args.command == "reach":
        _record(args.tree, args.out)
    elif args.command == "run":
        _run(args)
    else:
        print(comparison(args.before, args.after))
    return 0


if __name__ == "__main__":
    program.run(main)

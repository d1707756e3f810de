"""What the pages tell a reader to type works: Python compiles and its names exist,
and every command's program takes its arguments.
"""

import ast
import functools
import importlib
import importlib.util
import re
import subprocess
import sys
import types

import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.scenario import load_scenario, shipped_scenarios
from tests.docs.pages import ROOT, Block, blocks, commands, name_of, pages

_PYTHON = {"python", "python3", ".venv/bin/python"}
#: Programs that are not ours.
_FOREIGN = {"cat", "cd", "dask", "git", "pip", "sha256sum"}
_SHELL = blocks("sh", "bash", "console")


@pytest.mark.parametrize("block", blocks("python"), ids=str)
def test_python_compiles_and_its_imports_resolve(block: Block) -> None:
    tree = ast.parse(block.text, filename=str(block))
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                importlib.import_module(alias.name)
        elif isinstance(node, ast.ImportFrom):
            module = importlib.import_module(node.module or "")
            missing = [a.name for a in node.names if not hasattr(module, a.name)]
            assert not missing, f"{block}: {node.module} has no {missing}"


@pytest.mark.parametrize("block", blocks("python"), ids=str)
def test_python_defines_what_it_uses(block: Block) -> None:
    command = [sys.executable, "-m", "ruff", "check", "--isolated", "--select=F", "-"]
    checked = subprocess.run(command, input=block.text, capture_output=True, text=True)
    assert checked.returncode == 0, f"{block}: {checked.stdout}"


@pytest.mark.parametrize("block", _SHELL, ids=str)
def test_commands_are_understood(block: Block, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    for words in commands(block.text):
        _check(words, f"{block}: {' '.join(words)}")


def _check(words: list[str], where: str) -> None:
    program, *arguments = words
    if program == "make":
        assert set(arguments) <= _make_targets(), where
    elif program in _PYTHON and arguments[0] == "-m":
        assert importlib.util.find_spec(arguments[1]), where
    elif program in _PYTHON:
        _check_program(arguments[0], arguments[1:], where)
    else:
        assert program in _FOREIGN, f"{where}: neither make nor python"


def _check_program(path: str, arguments: list[str], where: str) -> None:
    assert (ROOT / path).is_file(), where
    if not path.startswith(("tools/", "benchmarks/")):
        return
    parse = _program(path).parse
    try:
        parsed = parse(arguments)
    except SystemExit as exit_:
        assert not exit_.code, f"{where}: refused by its own parser"
        return
    except DisasmError as error:
        raise AssertionError(f"{where}: refused by its own parser: {error}") from error
    scenario = getattr(parsed, "scenario", None)
    if scenario in shipped_scenarios():
        load_scenario(scenario, getattr(parsed, "overrides", ()))


@functools.cache
def _program(path: str) -> types.ModuleType:
    folder, _, name = path.rpartition("/")
    sys.path.insert(0, str(ROOT / folder))
    try:
        return importlib.import_module(name.removesuffix(".py"))
    finally:
        sys.path.remove(str(ROOT / folder))


@functools.cache
def _make_targets() -> set[str]:
    makefile = (ROOT / "Makefile").read_text()
    return set(re.findall(r"^([a-z-]+):", makefile, flags=re.M))


def test_pages_have_blocks_to_check() -> None:
    assert len(_SHELL) > 10 and len(blocks("python")) > 3
    assert {"README.md", "docs/hardware.md"} <= {name_of(p) for p in pages()}


@pytest.mark.parametrize(
    "command, message",
    [
        ("python tools/simulate.py --no-such-flag", "refused"),
        ("python tools/no_such.py", "no_such"),
        ("make no-such-target", "no-such-target"),
        ("no-such-program x", "neither"),
        ("python -m tests.no_such", "no_such"),
    ],
)
def test_a_wrong_command_is_noticed(command: str, message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        _check(command.split(), command)


def test_shell_is_split_into_simple_commands() -> None:
    text = (
        "cat > a.yaml <<END\nname: x\nEND\n"
        "for psi in 0 0.1; do\n    run --psi $psi --out out/x_$psi | tail -1\ndone\n"
        "long \\\n  'two words'  # comment\n"
    )
    assert commands(text) == [
        ["cat"],
        ["run", "--psi", "0", "--out", "out/x_0"],
        ["tail", "-1"],
        ["long", "two words"],
    ]

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
from pathlib import Path

import pytest
from drake_disasm_cli.main import SUBCOMMANDS

from drake_disasm.common.errors import DisasmError
from drake_disasm.scenario import load_scenario, shipped_scenarios
from tests.docs.pages import ROOT, Block, blocks, commands, pages

_PYTHON = {"python", "python3", ".venv/bin/python"}
#: Programs that are not ours.
_FOREIGN = {"apt-get", "cat", "cd", "dask", "git", "pip", "sha256sum", "source"}
_SHELL = ("sh", "bash", "console")


def test_python_blocks_compile_and_their_names_resolve() -> None:
    found = [block for page in pages() for block in blocks(page, "python")]
    assert len(found) > 3
    for block in found:
        _check_imports(block)
        command = [sys.executable, "-m", "ruff", "check", "--isolated", "--select=F"]
        ran = subprocess.run(
            [*command, "-"], input=block.text, capture_output=True, text=True
        )
        assert ran.returncode == 0, f"{block}: {ran.stdout}"


def _check_imports(block: Block) -> None:
    for node in ast.walk(ast.parse(block.text, filename=str(block))):
        if isinstance(node, ast.Import):
            for alias in node.names:
                importlib.import_module(alias.name)
        elif isinstance(node, ast.ImportFrom):
            module = importlib.import_module(node.module or "")
            missing = [a.name for a in node.names if not hasattr(module, a.name)]
            assert not missing, f"{block}: {node.module} has no {missing}"


@pytest.mark.usefixtures("own_effects")
def test_commands_are_understood(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    found = [block for page in pages() for block in blocks(page, *_SHELL)]
    assert len(found) > 10
    for block in found:
        for words in commands(block.text):
            _check(words, f"{block}: {' '.join(words)}")


def _check(words: list[str], where: str) -> None:
    program, *arguments = words[1:] if words[0] == "sudo" else words
    if program == "make":
        assert set(arguments) <= _make_targets(), where
    elif program == "drake-disasm":
        _check_subcommand(arguments, where)
    elif program in _PYTHON and arguments[0] == "-m":
        assert importlib.util.find_spec(arguments[1]), where
    elif program in _PYTHON:
        _check_program(arguments[0], arguments[1:], where)
    else:
        assert program in _FOREIGN, f"{where}: neither make nor a program of ours"


def _check_subcommand(arguments: list[str], where: str) -> None:
    name, *rest = arguments
    if name != "--help":
        assert name in SUBCOMMANDS, f"{where}: no such subcommand"
        module = f"drake_disasm_cli.{name.replace('-', '_')}"
        _check_arguments(importlib.import_module(module), rest, where)


def _check_program(path: str, arguments: list[str], where: str) -> None:
    assert (ROOT / path).is_file(), where
    if path.startswith("tools/"):
        _check_subcommand([Path(path).stem.replace("_", "-"), *arguments], where)
    elif path.startswith("benchmarks/"):
        module = importlib.import_module(Path(path).stem)
        if hasattr(module, "parse"):
            _check_arguments(module, arguments, where)


def _check_arguments(module: types.ModuleType, rest: list[str], where: str) -> None:
    try:
        parsed = module.parse(rest)
    except SystemExit as exit_:
        assert not exit_.code, f"{where}: refused by its own parser"
        return
    except DisasmError as error:
        raise AssertionError(f"{where}: refused by its own parser: {error}") from error
    scenario = getattr(parsed, "scenario", None)
    if scenario in shipped_scenarios():
        load_scenario(scenario, getattr(parsed, "overrides", ()))


@functools.cache
def _make_targets() -> set[str]:
    makefile = (ROOT / "Makefile").read_text()
    return set(re.findall(r"^([a-z-]+):", makefile, flags=re.M))


@pytest.mark.parametrize(
    "command, message",
    [
        ("drake-disasm simulate --no-such-flag", "refused"),
        ("make no-such-target", "no-such-target"),
        ("no-such-program x", "neither"),
    ],
)
def test_a_wrong_command_is_noticed(command: str, message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        _check(command.split(), command)

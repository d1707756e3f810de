"""The guide from one's own files to a verdict, command by command."""

from pathlib import Path

import pytest
from drake_disasm_cli.main import main

from tests.docs.pages import ROOT, blocks, commands

_GUIDE = ROOT / "docs/guides/own-cell.md"
_SHOWN = "--no-meshcat"


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Returns a folder with what the guide's commands name, as the current one."""
    for name in ("examples", "models"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _commands() -> list[list[str]]:
    found = [words for block in blocks(_GUIDE, "sh") for words in commands(block.text)]
    assert len(found) == 6 and all(words[0] == "drake-disasm" for words in found)
    return [words[1:] for words in found]


@pytest.mark.slow
def test_each_command_leads_to_the_next(
    checkout: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    printed = []
    for words in _commands():
        shown = words[0] == "simulate" and _SHOWN not in words
        assert main([*words, _SHOWN] if shown else words) == 0
        printed.append(capsys.readouterr().out)
    for text in (printed[0], printed[1], printed[3], printed[5]):
        assert "success (the bolt is out)" in text
    assert "SensorBias" in printed[4]


def test_files_are_found_from_the_scenario_s_folder(
    checkout: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = _commands()[1]
    assert main([*words, _SHOWN]) == 0
    assert "success (the bolt is out)" in capsys.readouterr().out

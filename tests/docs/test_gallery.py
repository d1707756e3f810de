"""The gallery's commands, where its recordings are at hand, and what they print."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.pages import ROOT, Block, blocks

_PAGE = ROOT / "docs" / "guides" / "gallery.md"
_DATA = ROOT.parent / "shared" / "data"
#: Numbers that a machine may change in the last digit.
_NUMBER = re.compile(r"\d+\.?\d*")


def _entries() -> list[object]:
    """Returns commands and what they print, of each recording."""
    pairs = zip(blocks(_PAGE, "sh"), blocks(_PAGE, "text"), strict=True)
    return [
        pytest.param(commands, printed, id=name)
        for commands, printed in pairs
        if (name := re.findall(r"--out out/(\w+)", commands.text)[0])
    ]


@pytest.mark.slow
@pytest.mark.skipif(not _DATA.is_dir(), reason="no recordings are at hand")
@pytest.mark.parametrize(("commands", "printed"), _entries())
def test_commands_print_what_the_page_says(
    commands: Block, printed: Block, tmp_path: Path
) -> None:
    program = (
        f'drake-disasm() {{ local name="{ROOT}/tools/${{1//-/_}}.py"; shift; '
        f'"{sys.executable}" "$name" "$@"; }}'
    )
    ran = subprocess.run(
        ["bash", "-ec", f"{program}\n{commands.text}"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=os.environ | {"DATA": str(_DATA)},
    )
    assert ran.returncode == 0, ran.stderr
    for line in printed.text.splitlines():
        assert _without_numbers(line) in _without_numbers(ran.stdout), line


def _without_numbers(text: str) -> str:
    return _NUMBER.sub("#", text)

"""Running the command-line programs as a user does."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.tools.programs import Runner, run_program


@pytest.fixture
def simulate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Runner:
    """Runs tools/simulate.py without a page, from another folder, in this process."""
    monkeypatch.syspath_prepend(tmp_path)  # PYTHONPATH=.
    monkeypatch.delitem(sys.modules, "mine", raising=False)  # another test's policy

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        return run_program("simulate", "--no-meshcat", *arguments, cwd=tmp_path)

    return run

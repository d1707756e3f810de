"""Running the command-line programs as a user does."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.tools.programs import ROOT, Runner


@pytest.fixture
def simulate(tmp_path: Path) -> Runner:
    """Runs tools/simulate.py without a page, from another folder."""

    def run(*arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, str(ROOT / "tools/simulate.py"), "--no-meshcat"]
        return subprocess.run(
            [*command, *arguments],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=120,
            env={"PATH": "/usr/bin:/bin", "PYTHONPATH": str(tmp_path)},
            check=False,
        )

    return run

"""What the programs share: an interrupt is not lost, a policy is found by its name."""

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.policies import (
    ActionMap,
    LearnedPolicy,
    Network,
    PolicyDescription,
    Straight,
    files,
    save_policy,
)
from drake_disasm.scenario import load_scenario
from tools import cli

TOOLS = Path(__file__).parents[2] / "tools"

SWALLOWS = """
import signal
from drake_disasm.common import program

def main(arguments):
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt:
        pass  # as a library's callback does
    stopping.stop_if_interrupted()
    return 0

program.run(main)
"""


def test_a_swallowed_interrupt_stops_the_run_all_the_same() -> None:
    done = subprocess.run(
        [sys.executable, "-c", SWALLOWS], cwd=TOOLS, capture_output=True, text=True
    )
    assert done.returncode == 130
    assert "interrupted" in done.stderr


def test_a_program_in_the_background_ignores_interrupts_still() -> None:
    """A shell starts `simulate.py &` with SIGINT ignored; so it must stay."""
    done = subprocess.run(
        [sys.executable, "-c", SWALLOWS],
        cwd=TOOLS,
        capture_output=True,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
    )
    assert done.returncode == 0


def _save(path: Path, period: float = 0.1) -> None:
    network = Network((np.ones((6, 12), np.float32),), (np.ones(6, np.float32),))
    description = PolicyDescription(period=period)
    save_policy(
        path, LearnedPolicy(network, np.ones(12), ActionMap(np.ones(6)), description)
    )


def test_policies_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Scripted ones come first, then shipped ones, then what can be imported."""
    scenario = load_scenario("chapter4")
    (tmp_path / "policies").mkdir()
    for name in ("straight", "residual"):
        _save(tmp_path / f"policies/{name}.npz")
    monkeypatch.setattr(files, "models_dir", lambda: tmp_path)
    assert isinstance(cli.named_policy("straight", scenario), Straight)
    assert isinstance(cli.named_policy("residual", scenario), LearnedPolicy)
    assert cli.named_policy("numpy:zeros", scenario) is np.zeros
    with pytest.raises(DisasmError, match=r"'resdual'.*mean 'residual'.*npz file or"):
        cli.named_policy("resdual", scenario)
    with pytest.raises(DisasmError, match="known: straight, admittance, residual"):
        cli.named_policy("xyz", scenario)


def test_policies_by_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = load_scenario("chapter4")
    (tmp_path / "folder").mkdir()
    _save(tmp_path / "folder/straight.npz")
    monkeypatch.chdir(tmp_path)
    for name in (str(tmp_path / "folder/straight.npz"), "folder/straight.npz"):
        assert isinstance(cli.named_policy(name, scenario), LearnedPolicy)
    monkeypatch.chdir("folder")
    for name in ("straight.npz", "../folder/straight.npz"):
        assert isinstance(cli.named_policy(name, scenario), LearnedPolicy)
    with pytest.raises(DisasmError, match=r"folder/straight.npz: can't be read"):
        cli.named_policy("folder/straight.npz", scenario)


def test_policy_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    _save(tmp_path / "slow.npz", period=0.5)
    with pytest.raises(DisasmError, match=r"task\.period 0\.5.*'removal' has 0\.1"):
        cli.named_policy(str(tmp_path / "slow.npz"), load_scenario("removal"))

"""What the benchmark of disturbances makes of its episodes."""

from pathlib import Path

import numpy as np
from disturbed import Stalling, Tally, rows_lost

from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.recording import record_transitions
from drake_disasm.task.simulation import TaskSimulation


def test_rows_that_are_missing_are_counted(tmp_path: Path) -> None:
    simulation = TaskSimulation(
        load_scenario("removal", ["task.steps=4"]), "twin", make_policy("straight")
    )
    record_transitions(tmp_path / "log", simulation, 8)
    tally = Tally()
    tally.steps = [4, 4]
    assert rows_lost(tmp_path, tally) == 0
    tally.steps = [4, 6]
    assert rows_lost(tmp_path, tally) == 2
    tally.steps = [4, 4, 3]
    assert rows_lost(tmp_path, tally) == 3


def test_a_stalling_policy_stands_still_now_and_then() -> None:
    policy = Stalling(0)
    policy(np.zeros(12))
    policy._next = 0.0
    policy(np.zeros(12))
    assert policy.stalls >= 1

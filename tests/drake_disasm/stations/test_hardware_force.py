"""At the limit of force: a hold, and backing away from what presses."""

import pytest
from force_runs import PUSHES, run_push


def test_the_arm_backs_away_from_what_presses() -> None:
    run = run_push("across the groove (+z)", "yield")
    assert "on the gripper, 20 are allowed; backed away 0." in run.reason
    assert run.at_hold > 19.0 > 10.0 > run.soon
    assert run.greatest < 1.2 * run.at_hold


@pytest.mark.slow
@pytest.mark.parametrize("push", PUSHES)
def test_a_hold_leaves_less_than_the_limit(push: str) -> None:
    run = run_push(push, "hold")
    assert "on the gripper, 20 are allowed" in run.reason
    assert "backed away" not in run.reason
    assert run.late < 20.0

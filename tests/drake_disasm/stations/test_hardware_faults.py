"""Every fault of every device: a hold in time with its reason, or nothing at all."""

import math

import pytest
from fault_runs import ALL, run_fault

from drake_disasm.safety import Mode

#: What each does: the words of the hold, and within what time [s] of virtual time.
HARMLESS = {("iiwa", "reorder"), ("ft_sensor", "reorder")}
QUICK = [("iiwa", "jump"), ("iiwa", "reorder"), ("ft_sensor", "loss")]
QUICK += [("gripper", "silent")]
SLOW = [which for which in ALL if which not in QUICK]
WORDS = {
    "nan": "not finite",
    "jump": ("jumped by 0.300 rad", "N on the gripper"),
    "status": ("HEX status", "overcurrent"),
    "short": ("not an lcmt_iiwa_status", "stopped sending"),
    "header": ("not an lcmt_iiwa_status", "stopped sending"),
}


def check(device: str, fault: str) -> None:
    """Runs into a fault, and asserts what is right for it."""
    run = run_fault(device, fault)
    if (device, fault) in HARMLESS:
        assert run.mode is Mode.ACTIVE and math.isnan(run.until_hold)
        assert "reordered" in run.counters
        return
    assert run.mode is Mode.HOLD
    words = WORDS.get(fault, "stopped sending")
    assert any(
        word in run.reason for word in ([words] if isinstance(words, str) else words)
    )
    assert run.until_hold <= (0.6 if device == "gripper" else 0.08)
    assert run.moved < 2e-3  # on the way to where it is held


@pytest.mark.parametrize(("device", "fault"), QUICK)
def test_a_fault(device: str, fault: str) -> None:
    check(device, fault)


@pytest.mark.slow
@pytest.mark.parametrize(("device", "fault"), SLOW)
def test_any_other_fault(device: str, fault: str) -> None:
    check(device, fault)

"""Each guard lets the usual pass and objects to what it is there for."""

import dataclasses

import numpy as np
import pytest
from pydrake.math import RigidTransform

from drake_disasm.devices.reading import Reading
from drake_disasm.safety import Lag, SafetyConfig, Situation, guards

Q = np.array([0.1, 0.5, 0.0, -1.3, 0.0, 1.3, 0.0])
NAMES = ("iiwa", "gripper", "ft_sensor")
FRESH = Reading(np.zeros(6), time=1.0)
USUAL = Situation(
    now=1.01,
    overdue=0.0,
    since_sent=0.005,
    q_wanted=Q + 0.001,
    q_measured=Q,
    q_before=Q - 0.001,
    X_GB=RigidTransform([0.02, 0.0, 0.0]),
    load=np.array([3.0, 2.0, 1.0, 0.1, 0.1, 0.1]),
    readings=dict.fromkeys(NAMES, FRESH),
)
LIMITS = SafetyConfig()
LEAD = np.array([0.02, 0.02, 0.02, 0.02, 0.02, 0.1, 0.02])


def objection(**changes: object) -> str:
    """Returns what the guards say of the usual situation with changes."""
    situation = dataclasses.replace(USUAL, **changes)
    all_guards = guards(LIMITS, np.full(7, -2.0), np.full(7, 2.0), LEAD)
    return next((r for guard in all_guards if (r := guard(situation))), "")


def of(device: str, **changes: object) -> dict[str, Reading]:
    return dict(USUAL.readings) | {device: dataclasses.replace(FRESH, **changes)}


def joint(q: np.ndarray, number: int, by: float) -> np.ndarray:
    return q + by * (np.arange(1, 8) == number)


def test_the_usual_passes():
    assert objection() == ""
    assert objection(load=None) == ""
    assert objection(q_wanted=joint(Q, 6, -0.09)) == ""  # it yields more there
    assert objection(q_before=np.full(7, np.nan)) == ""


def push(**components: float) -> np.ndarray:
    """A wrench (6,) at the gripper [N, N m]."""
    return np.array([components.get(n, 0.0) for n in ("x", "y", "z", "a", "b", "c")])


@pytest.mark.parametrize(("changes", "words"), [
    ({"readings": of("iiwa", time=np.nan)}, "iiwa has sent nothing yet"),
    ({"readings": of("iiwa", time=0.95)}, "iiwa has stopped sending for 0.060 s"),
    ({"readings": of("ft_sensor", time=0.9)}, "ft_sensor has stopped sending"),
    ({"readings": of("gripper", time=0.4)}, "gripper has stopped sending"),
    ({"readings": of("gripper", error="fault 0x0E")}, "gripper: fault 0x0E"),
    ({"q_wanted": joint(Q, 2, np.nan)}, "iiwa.position is not finite"),
    ({"load": np.full(6, np.nan)}, "ft_sensor.wrench is not finite"),
    ({"q_before": joint(Q, 3, -0.06)}, "joint 3 jumped by 0.060 rad"),
    ({"overdue": 0.3}, "0.300 s late: the program stood still"),
    ({"overdue": 0.3, "lag": Lag(took={"policy": 0.2})}, "late: policy took 0.200 s"),
    ({"lag": Lag(2.0, 0.9, {"view": 0.3, "policy": 1.4})}, "lost 0.90 s within 2.00 s"),
    ({"lag": Lag(2.0, 0.9, {"view": 0.3, "policy": 1.4})}, "policy 140 %, view 30 %"),
    ({"q_wanted": joint(Q, 4, -0.68)}, "joint 4 is sent 0.015 rad into"),
    ({"q_wanted": joint(Q, 5, 0.03)}, "joint 5 is sent 0.030 rad from where"),
    ({"q_wanted": joint(Q, 6, -0.11)}, "0.110 rad from where it is, 0.100 are"),
    ({"X_GB": RigidTransform([0.0, 0.029, 0.0])}, "workspace at y = 29.0 mm"),
    ({"load": push(y=20.1)}, "force 20.1 N"),
    ({"load": push(a=3.0, b=3.0)}, "torque 4.2 N m"),
    ({"load": push(c=-2.5)}, "torque about z 2.5 N m"),
])  # fmt: skip
def test_what_must_stop_the_robot(changes, words):
    assert words in objection(**changes)


def test_an_arm_that_yields_may_lag_by_what_the_greatest_load_bends_it() -> None:
    """Two joints as springs: force turns the first, torque the second."""
    yielding = np.zeros((7, 6))
    yielding[0, :3] = [3e-3, 0.0, 4e-3]  # rad/N
    yielding[1, 4] = 0.01  # rad/(N m)
    limits = SafetyConfig(max_force=10.0, max_torque_xy=4.0, max_torque_z=3.0)
    lead = limits.allowed_lead(yielding) - limits.max_lead
    np.testing.assert_allclose(lead, [0.05, 0.05, 0, 0, 0, 0, 0])


def test_limits_stay_below_what_the_gripper_takes():
    assert LIMITS.max_force < 25.0
    assert LIMITS.max_torque_xy < 5.0 and LIMITS.max_torque_z < 3.0

"""Backing away from a wall that is a spring, by an arm that goes where it is told."""

import dataclasses

import numpy as np
import pytest
from pydrake.math import RigidTransform

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.safety import Mode, Retreat, SafetyConfig, Situation, Supervisor
from tests.drake_disasm.safety.test_guards import USUAL

PERIOD = 0.005  # s
LIMITS = SafetyConfig(on_force="yield")
NORMAL = np.array([0.6, 0.0, -0.8])  # of the wall, out of it
IN = 0.001  # m into the wall, where the hold comes


def situation(x: np.ndarray, force: float) -> Situation:
    """Returns what is known at coordinates (6,), with a force [N] out of the wall."""
    return dataclasses.replace(
        USUAL,
        q_measured=x,
        q_before=x,
        q_wanted=x,
        X_GB=RigidTransform(x[:3]),
        load=np.concatenate([force * NORMAL, np.zeros(3)]),
    )


def held(stiffness: float, steps: int = 100) -> tuple[float, float, Supervisor]:
    """Returns way [m] and force [N] after a hold at a depth IN of a wall [N/m]."""
    retreat = Retreat(BoltCoordinates(), np.eye(3), LIMITS, PERIOD)
    supervisor = Supervisor(
        [lambda s: "too much" if _force(s) > LIMITS.max_force else ""],
        np.full(6, 10.0),
        np.inf,
        1.0,
        retreat,
    )
    start = np.concatenate([-IN * NORMAL, np.zeros(3)])
    x = start
    supervisor.command(situation(x, 0.0))
    for _ in range(steps):
        force = stiffness * max(0.0, -float(x[:3] @ NORMAL))
        x = supervisor.command(situation(x, force))
    assert supervisor.mode is Mode.HOLD
    way = x[:3] - start[:3]
    assert np.linalg.norm(np.cross(way, NORMAL)) < 1e-9
    return float(way @ NORMAL), force, supervisor


def _force(s: Situation) -> float:
    assert s.load is not None
    return float(np.linalg.norm(s.load[:3]))


def test_it_backs_away_until_half_of_the_limit_is_left() -> None:
    for stiffness in (22e3, 30e3):
        way, force, supervisor = held(stiffness)
        step = LIMITS.retreat_speed * PERIOD
        wanted = IN - 0.5 * LIMITS.max_force / stiffness
        assert wanted - 1e-9 <= way <= wanted + 2 * step
        assert force <= 0.5 * LIMITS.max_force
        assert "too much; backed away 0." in supervisor.reason


def test_it_stays_where_no_force_explains_the_hold_and_goes_no_further() -> None:
    for force in (15.0, 41.0, np.nan):
        retreat = Retreat(BoltCoordinates(), np.eye(3), LIMITS, PERIOD)
        x = np.zeros(6)
        retreat.begin(situation(x, force))
        assert np.array_equal(retreat.advance(x, situation(x, force)), x), force
    retreat.begin(situation(x, 25.0))
    for _ in range(100):
        x = retreat.advance(x, situation(x, 25.0))  # which does not fall
    assert np.linalg.norm(x[:3]) == pytest.approx(LIMITS.retreat)


@pytest.mark.parametrize("worse", [
    {"load": np.array([0.0, 0.0, 31.0, 0.0, 0.0, 0.0])},
    {"load": None},
    {"now": 100.0},  # all samples are stale
])  # fmt: skip
def test_it_ends_where_the_force_grows_or_a_device_is_lost(worse):
    retreat = Retreat(BoltCoordinates(), np.eye(3), LIMITS, PERIOD)
    x = np.zeros(6)
    retreat.begin(situation(x, 25.0))
    x = retreat.advance(x, situation(x, 25.0))
    after = retreat.advance(x, dataclasses.replace(situation(x, 25.0), **worse))
    assert np.array_equal(after, x)
    assert np.array_equal(retreat.advance(x, situation(x, 25.0)), x)  # for good

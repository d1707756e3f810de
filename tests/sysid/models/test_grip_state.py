"""A grip that gives with a lag, a bolt that creeps in it, and whose weight turns."""

import dataclasses

import numpy as np
import pytest
from compliance import Push

from drake_disasm.cell.grip import AXIS_ORDER
from drake_disasm.cell.tool import Tool
from drake_disasm.common.spatial import velocity_shift
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.stations import make_station
from sysid.models.commands import bolt_path
from sysid.models.grip_state import GripState, of_encoders
from tests.drake_disasm.conftest import QUIET

_SCENARIO = load_scenario("removal", [QUIET])
_PATCH = np.array([0.0, 0.0205, 0.0])  # about which the bolt turns in the pads
_RATE = 20.5e-3  # rad/(N m s), about z


def _grip(station: str = "cell", scenario: Scenario = _SCENARIO) -> GripState:
    return GripState.of(scenario, station)


def _at_Bo(wrench_Po: np.ndarray) -> np.ndarray:
    """Returns the same wrench (6,) at Bo."""
    return np.linalg.solve(velocity_shift(_PATCH).T, wrench_Po)


def test_it_follows_springs_and_dampers_in_parallel():
    """A deflection that is integrated finely under wrenches that change evenly."""
    grip = GripState.of(load_scenario("removal"))
    random = np.random.default_rng(0)
    wrench = random.uniform(-1, 1, (6, 6)) * ([2.0] * 3 + [0.2] * 3)
    k, c = grip.springs.stiffness, grip.springs.damping
    at_grip = wrench @ grip.to_grip.T
    give, elastic, fine = at_grip[0] / k, wrench[:1], 2000
    for begin in range(5):
        for i in range(fine):
            share = (i + 0.5) / fine
            force = (1.0 - share) * at_grip[begin] + share * at_grip[begin + 1]
            give = give + grip.period / fine * (force - k * give) / c
        elastic = grip.after(elastic, wrench[None, begin : begin + 2])
        np.testing.assert_allclose(elastic[0] @ grip.to_grip.T / k, give, rtol=0.02)
        rates = grip.rates(elastic, wrench[None, begin + 1])[0]
        of_grip = ((at_grip[begin + 1] - k * give) / c)[list(AXIS_ORDER)]
        np.testing.assert_allclose(rates, of_grip, rtol=0.02, atol=2e-4)


def test_springs_of_a_stiff_grip_carry_all():
    grip = GripState.of(load_scenario("removal", ["gripper.compliance=rigid"]))
    wrench = np.array([[[0.0] * 6, [1.0, 2.0, -1.0, 0.1, 0.2, -0.1]]])
    elastic = grip.after(np.zeros((1, 6)), wrench)
    np.testing.assert_array_equal(elastic, wrench[:, 1])
    np.testing.assert_array_equal(grip.rates(elastic, wrench[:, 1]), 0.0)


def test_a_torque_about_z_turns_the_bolt_about_the_middle_of_its_patch():
    torque, steps = 0.1, 20
    wrench = np.tile(_at_Bo([0.0, 0.0, 0.0, 0.0, 0.0, torque]), (steps + 1, 1))
    crept = _grip().elsewhere(np.zeros_like(wrench), wrench)
    turn = _RATE * torque * 0.1 * np.arange(steps + 1)
    np.testing.assert_allclose(crept[:, 3], turn, rtol=1e-9)  # about z, x, y
    lever = _grip().p_BoTo_B[1] - _PATCH[1]
    np.testing.assert_allclose(crept[:, 0], -lever * turn, rtol=1e-9)
    assert np.abs(crept[:, [2, 4, 5]]).max() < 1e-12


def test_the_axes_along_which_it_creeps_turn_with_the_arm():
    """Rolled by a right angle: what was about z is about y."""
    torque, grip = 0.1, dataclasses.replace(_grip(), rest=np.zeros(6))
    roll = np.tile([0.0, 0.0, 0.0, 0.0, np.pi / 2.0, 0.0], (11, 1))
    wrench = np.tile([0.0, 0.0, 0.0, 0.0, -torque, 0.0], (11, 1))
    crept = grip.elsewhere(roll, wrench)
    assert crept[-1, 5] == pytest.approx(-_RATE * torque, rel=1e-9)  # about y
    assert np.abs(crept[:, [3, 4]]).max() < 1e-12


@pytest.mark.parametrize(
    ("station", "changes"),
    [("twin", []), ("hardware", []), ("cell", ["gripper.hold=weld"])],
)
def test_where_nothing_creeps_or_nobody_knows_there_is_none(station, changes):
    grip = _grip(station, load_scenario("removal", changes))
    assert not grip.mobility.any()
    assert grip.turns == (station != "twin")


def test_the_springs_give_by_the_weight_that_turned_away():
    """Rolled by a right angle, they carry it across instead of along y."""
    grip = _grip(scenario=load_scenario("removal", ["gripper.hold=weld"]))
    roll = np.zeros((2, 6))
    roll[1, 4] = np.pi / 2.0
    found = grip.elsewhere(roll, np.zeros((2, 6)))
    np.testing.assert_allclose(found[0], 0.0, atol=1e-15)
    f = grip.rest[:3]
    turned_away = f - np.array([f[0], -f[2], f[1]])
    given = turned_away / grip.springs.stiffness[:3]
    np.testing.assert_allclose(found[1, :3], given, atol=1e-12)
    carried = Tool.from_models(_SCENARIO).M_gripped_B.get_mass()
    assert np.linalg.norm(f) == pytest.approx(carried * 9.81, rel=1e-3)


def test_states_of_a_twin_that_stands_elsewhere_are_brought_back():
    """The pose, and the torque by the lever; the force is in Gn as it was."""
    rng = np.random.default_rng(0)
    p = _grip().p_BoTo_B
    q, offset = 0.01 * rng.standard_normal((2, 7, 6))
    wrench = rng.standard_normal((7, 6))
    found = of_encoders(np.hstack([bolt_path(q + offset, p), wrench]), q, offset, p)
    np.testing.assert_allclose(found[:, :6], bolt_path(q, p), atol=1e-15)
    np.testing.assert_array_equal(found[:, 6:9], wrench[:, :3])
    moved = bolt_path(q + offset, p)[:, :3] - bolt_path(q, p)[:, :3]
    lever = np.cross(moved, wrench[:, :3])
    np.testing.assert_allclose(found[:, 9:], wrench[:, 3:] + lever)


@pytest.mark.slow
def test_the_cells_bolt_creeps_as_stated():
    """Free in the air; a force along x turns it, since it does not act in the patch."""
    p = Tool.from_models(_SCENARIO).p_BoTo_B
    push = Push(make_station("cell", _SCENARIO), p)
    wrench = np.array([-5.0, 0, 0, 0, 0, 0])
    early, late = (push.advance(wrench, t).grip for t in (1.0, 2.0))
    stated = _grip().mobility @ wrench
    assert (late - early)[5] == pytest.approx(stated[5], rel=0.1)
    assert (late - early)[0] == pytest.approx(stated[0], rel=0.2)

"""A bolt that creeps in the pads, and whose weight turns: not so in the twin."""

import dataclasses

import numpy as np
import pytest
from compliance import Push

from drake_disasm.cell.tool import Tool
from drake_disasm.common.spatial import velocity_shift
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.stations import make_station
from sysid.models.commands import bolt_path
from sysid.models.grip_offset import GripOffset, of_encoders
from tests.drake_disasm.conftest import QUIET

_SCENARIO = load_scenario("removal", [QUIET])
_PATCH = np.array([0.0, 0.0205, 0.0])  # about which the bolt turns in the pads
_RATE = 20.5e-3  # rad/(N m s), about z


def _offset(station: str = "cell", scenario: Scenario = _SCENARIO) -> GripOffset:
    return GripOffset.of(scenario, station)


def _at_Bo(wrench_Po: np.ndarray) -> np.ndarray:
    """Returns the same wrench (6,) at Bo."""
    return np.linalg.solve(velocity_shift(_PATCH).T, wrench_Po)


def test_a_torque_about_z_turns_the_bolt_about_the_middle_of_its_patch():
    torque, steps = 0.1, 20
    wrench = np.tile(_at_Bo([0.0, 0.0, 0.0, 0.0, 0.0, torque]), (steps + 1, 1))
    crept = _offset().along(np.zeros_like(wrench), wrench)
    turn = _RATE * torque * 0.1 * np.arange(steps + 1)
    np.testing.assert_allclose(crept[:, 3], turn, rtol=1e-9)  # yaw comes first
    lever = _offset().p_BoTo_B[1] - _PATCH[1]
    np.testing.assert_allclose(crept[:, 0], -lever * turn, rtol=1e-9)
    assert np.abs(crept[:, [2, 4, 5]]).max() < 1e-12


def test_a_force_through_the_patch_where_the_springs_have_moved_it_turns_nothing():
    """The sensor reads its lever, and that of the weight that moves along."""
    offset, force = _offset(), np.array([5.0, 0.0, 0.0])
    moved = force * offset.compliance[:3]
    assert moved[0] > 8e-3
    lever = np.cross(moved, force + offset.rest[:3])
    wrench = np.tile(_at_Bo(np.concatenate([force, lever])), (11, 1))
    np.testing.assert_allclose(
        offset.moved_moment(np.zeros((11, 6)), wrench), np.tile(lever, (11, 1))
    )
    crept = offset.along(np.zeros_like(wrench), wrench)
    assert np.abs(crept[:, 3:]).max() < 1e-15
    assert crept[-1, 0] == pytest.approx(2.1e-6 * 5.0 * 1.0)


def test_the_axes_along_which_it_creeps_turn_with_the_arm():
    """Rolled by a right angle: what was about z is about y."""
    torque, offset = 0.1, dataclasses.replace(_offset(), rest=np.zeros(6))
    roll = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, np.pi / 2.0], (11, 1))
    wrench = np.tile([0.0, 0.0, 0.0, 0.0, -torque, 0.0], (11, 1))
    crept = offset.along(roll, wrench)
    assert crept[-1, 4] == pytest.approx(-_RATE * torque, rel=1e-9)  # pitch
    assert np.abs(crept[:, [3, 5]]).max() < 1e-12


@pytest.mark.parametrize(
    ("station", "changes"),
    [("twin", []), ("hardware", []), ("cell", ["gripper.hold=weld"])],
)
def test_where_nothing_creeps_or_nobody_knows_there_is_none(station, changes):
    offset = _offset(station, load_scenario("removal", changes))
    assert not offset.mobility.any()
    assert offset.turns == (station != "twin")


def test_the_springs_give_by_the_weight_that_turned_away():
    """Rolled by a right angle, they carry it across instead of along y."""
    offset = _offset(scenario=load_scenario("removal", ["gripper.hold=weld"]))
    roll = np.zeros((2, 6))
    roll[1, 5] = np.pi / 2.0
    found = offset.along(roll, np.zeros((2, 6)))
    np.testing.assert_allclose(found[0], 0.0, atol=1e-15)
    f = offset.rest[:3]
    turned_away = f - np.array([f[0], -f[2], f[1]])
    given = turned_away * offset.compliance[:3]
    np.testing.assert_allclose(found[1, :3], given, atol=1e-12)
    carried = Tool.from_models(_SCENARIO).M_gripped_B.get_mass()
    assert np.linalg.norm(f) == pytest.approx(carried * 9.81, rel=1e-3)


def test_the_lever_from_the_pads_turns_with_the_arm():
    """Rolled by a right angle, it points along z: a force along x is a torque in y."""
    roll = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, np.pi / 2.0]])
    found = _offset().at_grip(roll, np.array([[5.0, 0.0, 0.0, 0.0, 0.0, 0.0]]))
    lever = _offset().p_BoTo_B[1]
    expected = [[5.0, 0.0, 0.0, 0.0, -5.0 * lever, 0.0]]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_states_of_a_twin_that_stands_elsewhere_are_brought_back():
    """The pose, and the torque by the lever; the force is in Gn as it was."""
    rng = np.random.default_rng(0)
    p = _offset().p_BoTo_B
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
    stated = _offset().mobility @ wrench
    assert (late - early)[5] == pytest.approx(stated[5], rel=0.1)
    assert (late - early)[0] == pytest.approx(stated[0], rel=0.2)

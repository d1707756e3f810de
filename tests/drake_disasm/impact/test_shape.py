"""The lock as circles and planes."""

import numpy as np
import pytest

from drake_disasm.impact import LockShape
from drake_disasm.scenario import LockConfig

MM = 1e-3


def deepest(position):
    p_GBo = np.array([position]) * MM
    found = LockShape.of(LockConfig()).contacts(np.eye(3)[None], p_GBo)
    i = int(np.argmax(found.penetration[0]))
    return found.penetration[0, i] / MM, found.normal[i]


def test_in_the_middle_nothing_touches():
    assert deepest([20.0, 0.0, 0.0])[0] == pytest.approx(-0.2)  # half the clearance


@pytest.mark.parametrize(
    ("position", "depth", "normal"),
    [
        ([20.0, 0.0, 0.25], 0.05, [0, 0, -1]),  # neck on the lip at +z
        ([20.0, 0.0, -0.3], 0.1, [0, 0, 1]),
        ([20.0, 0.25, 0.0], 0.05, [0, -1, 0]),  # head under the lips
        ([20.0, -0.3, 0.0], 0.1, [0, 1, 0]),  # head on the floor
        ([60.6, 0.0, 0.0], 0.1, [-1, 0, 0]),  # head at stop B
        ([-0.7, 0.0, 0.0], 0.2, [1, 0, 0]),  # head at stop A
    ],
)
def test_touches_where_the_lock_is(position, depth, normal):
    found, direction = deepest(position)
    assert found == pytest.approx(depth, abs=1e-9)
    np.testing.assert_array_equal(direction, normal)


def test_at_the_keyhole_the_lips_hold_nothing():
    assert deepest([60.0, 10.0, 0.4])[0] < 0.0


def test_a_quarter_turn_changes_nothing_for_a_round_bolt():
    """Its rim has eight points, so they take each other's places."""
    quarter = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    found = LockShape.of(LockConfig()).contacts(
        np.array([np.eye(3), quarter]), np.array([[0.02, 0.0, 1e-4]] * 2)
    )
    straight, turned = np.sort(found.penetration, axis=1)
    np.testing.assert_allclose(turned, straight, atol=1e-12)
    straight, turned = np.linalg.norm(found.arm, axis=2)
    np.testing.assert_allclose(turned, straight)

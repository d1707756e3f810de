"""The lock as circles and planes."""

import numpy as np
import pytest

from drake_disasm.parts import DoorChain
from drake_disasm.twin.equations import (
    ARM,
    DEPTH,
    LOCK,
    NORMALS,
    P_GBO,
    PLACES,
    R_GB,
    SIZE,
    find_places,
)

MM = 1e-3


def places(R, p):
    w = np.full(SIZE, np.nan)
    for place, numbers in (
        (LOCK, DoorChain().gaps.row),
        (R_GB, R),
        (P_GBO, p),
    ):
        w[place : place + np.size(numbers)] = np.ravel(numbers)
    find_places(w)
    return w[DEPTH : DEPTH + PLACES], w[ARM : ARM + 3 * PLACES].reshape(-1, 3)


def deepest(position):
    depth, _ = places(np.eye(3), np.array(position) * MM)
    i = int(np.argmax(depth))
    return depth[i] / MM, NORMALS[i]


def test_in_the_middle_and_at_the_keyhole_nothing_touches():
    assert deepest([20.0, 0.0, 0.0])[0] == pytest.approx(-0.2)  # half the clearance
    assert deepest([60.0, 10.0, 0.4])[0] < 0.0


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


def test_a_quarter_turn_changes_nothing_for_a_round_bolt():
    """Its rim has eight points, so they take each other's places."""
    quarter = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    straight, turned = (places(R, [0.02, 0.0, 1e-4]) for R in (np.eye(3), quarter))
    np.testing.assert_allclose(np.sort(turned[0]), np.sort(straight[0]), atol=1e-12)
    lengths = (np.sort(np.linalg.norm(each[1], axis=1)) for each in (straight, turned))
    np.testing.assert_allclose(*lengths)


def test_another_clearance_is_the_lock_s_with_that_clearance():
    wide = DoorChain(clearance=6e-4).gaps
    narrow = DoorChain(clearance=2e-4).gaps.with_clearance(6e-4)
    assert narrow.slot == pytest.approx(wide.slot, abs=1e-12)
    assert wide.slot - wide.neck == pytest.approx(3e-4, abs=1e-12)

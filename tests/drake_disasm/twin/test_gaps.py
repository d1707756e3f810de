"""The gaps of parts: where the bodies touch."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from drake_disasm.parts import Bayonet, ContactConfig, DoorChain, PegInHole, gaps
from drake_disasm.twin.equations import (
    ARM,
    BAYONET,
    DEPTH,
    EXPONENT,
    GAPS,
    GAPS_SIZE,
    HOLE,
    LAW,
    NORMAL,
    P_GBO,
    PLACES,
    R_GB,
    SIZE,
    SLOT,
    SPRING,
    STIFFNESS,
    find_places,
    normal_force,
)
from drake_disasm.twin.law import ImpactLaw

MM = 1e-3
IMPACT = ImpactLaw(stiffness=160.0, exponent=1.3, damping=0.0, depth=0.1)


def found_places(part, R, p):
    """Returns the workspace of a part whose moved body is at X_GB = (R, p)."""
    w = np.full(SIZE, np.nan)
    known = ((LAW, IMPACT.row), (GAPS, part.gaps.row), (R_GB, R), (P_GBO, p))
    for place, numbers in known:
        w[place : place + np.size(numbers)] = np.ravel(numbers)
    find_places(w)
    return w


def places(R, p):
    w = found_places(DoorChain(), R, p)
    arms, normals = (w[at : at + 3 * PLACES].reshape(-1, 3) for at in (ARM, NORMAL))
    return w[DEPTH : DEPTH + PLACES], arms, normals


def test_the_equations_know_the_gaps_of_parts():
    kinds = (gaps.SlotGaps.kind, gaps.HoleGaps.kind, gaps.BayonetGaps.kind)
    assert kinds == (SLOT, HOLE, BAYONET) and gaps.GAPS_SIZE == GAPS_SIZE
    assert len(DoorChain().gaps.row) == len(Bayonet().gaps.row) == GAPS_SIZE


def deepest(position):
    depth, _, normals = places(np.eye(3), np.array(position) * MM)
    i = int(np.argmax(depth))
    return depth[i] / MM, normals[i]


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


def test_nothing_touches_a_bolt_above_the_plate():
    """The stop ends at the plate's upper face, which the head's underside passes."""
    part = DoorChain()
    level = (part.gaps.lip - part.gaps.bottom) / MM
    assert deepest([60.6, level - 0.1, 0.0])[0] == pytest.approx(0.1, abs=1e-9)
    assert deepest([60.6, level + 0.1, 0.0])[0] < 0.0


def test_a_quarter_turn_changes_nothing_for_a_round_bolt():
    """Its rim has eight points, so they take each other's places."""
    quarter = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    straight, turned = (places(R, [0.02, 0.0, 1e-4]) for R in (np.eye(3), quarter))
    np.testing.assert_allclose(np.sort(turned[0]), np.sort(straight[0]), atol=1e-12)
    lengths = (np.sort(np.linalg.norm(each[1], axis=1)) for each in (straight, turned))
    np.testing.assert_allclose(*lengths)


TILT = 0.06


def pressed_at(R, p, normal):
    """Returns force and its centre from Bo [mm] of a head that leans on a face."""
    w = found_places(DoorChain(), R, p)
    depth, stiffness, exponent = (
        w[at : at + PLACES] for at in (DEPTH, STIFFNESS, EXPONENT)
    )
    arms, normals = (w[at : at + 3 * PLACES].reshape(-1, 3) for at in (ARM, NORMAL))
    touches = (depth > 0) & (normals @ normal > 0.5)
    laws = zip(depth[touches], stiffness[touches], exponent[touches], strict=True)
    force = np.array([normal_force(d, 0.0, (k, e, 0.0, 0.1))[0] for d, k, e in laws])
    return force.sum(), force @ arms[touches] / force.sum() / MM


def foundation(depth, area):
    """Returns force and its centre [mm] of an elastic foundation.

    Args:
        depth: of x and z in B [mm], on whatever of the head there is.
        area: whether a point of x and z is on it.
    """
    part = DoorChain()
    side = np.linspace(-5.0, 5.0, 2001)
    x, z = np.meshgrid(side, side, indexing="ij")
    k = IMPACT.stiffness / (part.head_thickness / MM) ** 2
    is_on = (np.hypot(x, z) < 5.0) & area(x, z)
    p = k * np.where(is_on, np.maximum(depth(x, z), 0.0), 0.0) ** IMPACT.exponent
    p *= (side[1] - side[0]) ** 2
    return p.sum(), np.array([(p * x).sum(), (p * z).sum()]) / p.sum()


@pytest.mark.parametrize("turn", [0.0, 0.3])
@pytest.mark.parametrize("axis", ["x", "z"])
def test_a_tilted_head_leans_on_its_edge_as_on_an_elastic_foundation(axis, turn):
    """However it is turned about its own axis."""
    gaps, deep = DoorChain().gaps, 0.04
    make = getattr(RotationMatrix, f"Make{axis.upper()}Rotation")
    R = (make(TILT) @ RotationMatrix.MakeYRotation(turn)).matrix()
    y = gaps.floor - gaps.bottom * np.cos(TILT) + gaps.head * np.sin(TILT)
    force, centre = pressed_at(R, [0.03, y - deep * MM, 0.0], [0.0, 1.0, 0.0])

    def depth(x, z):
        return deep - TILT * (5.0 + (x if axis == "z" else -z))

    expected, (x, z) = foundation(depth, lambda x, z: x < np.inf)
    assert force == pytest.approx(expected, rel=0.05)
    bottom = R @ [0.0, gaps.bottom / MM, 0.0]
    np.testing.assert_allclose(centre[[0, 2]] - bottom[[0, 2]], [x, z], atol=0.02)


def test_a_tilted_head_leans_on_the_corners_that_the_slot_leaves():
    gaps, deep = DoorChain().gaps, 0.06
    R = RotationMatrix.MakeZRotation(TILT).matrix()
    corner = np.sqrt(5.0**2 - (gaps.slot / MM) ** 2)
    y = gaps.under_lip - gaps.top * np.cos(TILT) - corner * MM * np.sin(TILT)
    force, centre = pressed_at(R, [0.03, y + deep * MM, 0.0], [0.0, -1.0, 0.0])
    expected, (x, _) = foundation(
        lambda x, z: deep - TILT * (corner - x), lambda x, z: abs(z) > gaps.slot / MM
    )
    assert force == pytest.approx(expected, rel=0.05)
    top = R @ [0.0, gaps.top / MM, 0.0]
    np.testing.assert_allclose(centre[[0, 2]] - top[[0, 2]], [x, 0.0], atol=0.05)


def test_another_clearance_is_the_lock_s_with_that_clearance():
    wide = DoorChain(clearance=6e-4).gaps
    narrow = DoorChain(clearance=2e-4).gaps.with_clearance(6e-4)
    assert narrow.slot == pytest.approx(wide.slot, abs=1e-12)
    assert wide.slot - wide.neck == pytest.approx(3e-4, abs=1e-12)


def touching(part, p, R=None):
    """Returns depths [mm] and normals of the places that touch, and the spring's."""
    w = found_places(part, np.eye(3) if R is None else R, p)
    depth = w[DEPTH : DEPTH + PLACES]
    normals = w[NORMAL : NORMAL + 3 * PLACES].reshape(-1, 3)
    return depth[depth > 0] / MM, normals[depth > 0], w[SPRING : SPRING + 3]


@pytest.mark.parametrize("section", ["round", "square"])
def test_a_peg_touches_at_its_tip_and_at_the_mouth(section):
    """0.1 mm of play to either side; 20 mm deep."""
    peg, corners = PegInHole(cross_section=section), 2 if section == "square" else 1
    assert not touching(peg, [0.0, 0.0, 0.09 * MM])[0].size
    depth, normals, _ = touching(peg, [0.0, 5.0 * MM, 0.12 * MM])
    np.testing.assert_allclose(depth, [0.02] * 2 * corners, atol=1e-9)
    np.testing.assert_allclose(normals, [[0, 0, -1]] * 2 * corners, atol=1e-9)
    assert not touching(peg, [0.0, 21.0 * MM, 1.0 * MM])[0].size  # it is out
    # Tilted by more than the play to either side it touches on both: they are 10 mm
    # from the middle of the depth, by which the hole's mouth is seen shorter.
    tilt = RollPitchYaw(0.012, 0.0, 0.0).ToRotationMatrix()
    middle = np.array([0.0, -10.0 * MM, 0.0])
    depth, normals, _ = touching(peg, middle - tilt @ middle, tilt.matrix())
    np.testing.assert_allclose(depth, [0.02] * 2 * corners, atol=2e-3)
    np.testing.assert_allclose(np.abs(normals[:, 2]), 1.0)
    assert set(np.sign(normals[:, 2])) == {-1.0, 1.0}


def test_a_peg_rests_on_the_floor():
    """Which is 1 mm under its tip."""
    for section, count in (("round", 8), ("square", 4)):
        depth, normals, _ = touching(
            PegInHole(cross_section=section), [0, -1.1 * MM, 0]
        )
        np.testing.assert_allclose(depth, [0.1] * count)
        np.testing.assert_allclose(normals, [[0, 1, 0]] * count)


@pytest.mark.parametrize(
    ("turn", "p", "depth", "normal", "count"),
    [
        (-0.3, [0.0, 0.35, 0.0], 0.05, [0, -1, 0], 8),  # lugs under the plate
        (0.5, [0.0, -0.4, 0.0], 0.1, [0, 1, 0], 4),  # and on the floor
        (0.0, [0.17, 0.0, 0.0], 0.02, [-1, 0, 0], 2),  # shaft in the hole
    ],
)
def test_a_bayonet_touches_where_its_lugs_are(turn, p, depth, normal, count):
    R = RotationMatrix.MakeYRotation(turn).matrix()
    found, normals, _ = touching(Bayonet(), np.array(p) * MM, R)
    np.testing.assert_allclose(found, [depth] * count, atol=1e-9)
    np.testing.assert_allclose(normals, [normal] * count, atol=1e-9)


def test_the_lugs_meet_the_stops_and_pass_the_notches():
    """Stops 0.2 mm, the notches' sides 0.4 mm beside the lugs when turned by 1 rad."""
    part = Bayonet()
    R = RotationMatrix.MakeYRotation(part.turn)
    for lift in (0.35, 3.0, 7.0):
        assert not touching(part, [0.0, lift * MM, 0.0], R.matrix())[0].size
    beyond = RotationMatrix.MakeYRotation(part.turn + 0.26 / 8.0).matrix()
    depth, normals, _ = touching(part, [0.0, 0.0, 0.0], beyond)
    at_end, further_in = 0.06, 0.26 * 4.15 / 8.0 - 0.2
    np.testing.assert_allclose(depth.max(), at_end, atol=2e-3)
    assert further_in < 0.0 and len(depth) == 2
    expected = R.matrix() @ [0.0, 0.0, 1.0]
    np.testing.assert_allclose(normals, [expected, -expected])
    turned = RotationMatrix.MakeYRotation(part.turn + 0.46 / 8.0).matrix()
    depth, normals, _ = touching(part, [0.0, 3.0 * MM, 0.0], turned)
    np.testing.assert_allclose(depth, [0.06, 0.06], atol=5e-3)
    np.testing.assert_allclose(normals, [expected, -expected])


@pytest.mark.parametrize("angle", [-0.1, 0.05, 0.25])
def test_the_detent_is_the_spring_of_the_part(angle):
    part, R = Bayonet(), RotationMatrix.MakeYRotation(angle)
    environment = part.environment(ContactConfig())
    expected = part.spring_wrench(RigidTransform(R, np.zeros(3)), environment)
    np.testing.assert_allclose(touching(part, np.zeros(3), R.matrix())[2], expected[3:])

"""A bayonet's solids and its detent."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from drake_disasm.parts import Bayonet, ContactConfig
from drake_disasm.scenario import load_scenario
from tests.refusals import refused

BAYONET = Bayonet()
ENVIRONMENT = BAYONET.environment(ContactConfig())


def _is_open(x: float, z: float, turned: float) -> bool:
    """Returns whether a point of the turned lugs is over the plate's opening."""
    c, s = np.cos(turned), np.sin(turned)
    x, z = c * x + s * z, c * z - s * x
    angle = np.arctan2(z, x)
    outline = BAYONET._outline(BAYONET.clearance)
    angles = np.arctan2(outline[:, 1], outline[:, 0])
    order = np.argsort(angles)
    radii = np.linalg.norm(outline, axis=1)[order]
    return bool(
        np.hypot(x, z) < np.interp(angle, angles[order], radii, period=2 * np.pi)
    )


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_lugs_pass_the_plate_where_the_turn_ends_and_nowhere_before(
    side: float,
) -> None:
    end, half = BAYONET.touch_radius, BAYONET.lug_width / 2
    for z in (-half, 0.0, half):
        assert _is_open(side * (end - 1e-6), z, BAYONET.turn)
        for turned in (0.0, 0.3):
            assert not _is_open(side * (end - 1e-6), z, turned)


def test_stops_meet_the_lugs_within_the_notches() -> None:
    """A quarter of the notch's clearance beyond the turn, and clear of them before."""
    solids = BAYONET.fixed_solids(ENVIRONMENT)
    for name, angle in (("stop_0", BAYONET.turn), ("stop_1", BAYONET.turn + np.pi)):
        X_GS, box = solids[name]
        p = RotationMatrix.MakeYRotation(angle).inverse() @ X_GS.translation()
        gap = -BAYONET.lug_width / 2 - (p[2] + box.height() / 2)
        assert gap == pytest.approx(BAYONET.notch_clearance / 4)


def test_the_detent_holds_where_it_is_and_lets_go_beyond_its_width() -> None:
    """-T sin(pi theta / w) about y, and the same factor as the environment's."""

    def torque(angle: float) -> np.ndarray:
        X_GB = RigidTransform(RotationMatrix.MakeYRotation(angle), np.zeros(3))
        return BAYONET.spring_wrench(X_GB, ENVIRONMENT)

    w, T = BAYONET.detent_width, BAYONET.detent_torque
    np.testing.assert_allclose(torque(w / 2), [0, 0, 0, 0, -T, 0], atol=1e-12)
    np.testing.assert_allclose(torque(-w / 6), [0, 0, 0, 0, T / 2, 0], atol=1e-12)
    assert not torque(1.01 * w).any()


def test_impossible_dimensions_are_refused() -> None:
    with refused("part.turn: ", "give 0.6"):
        load_scenario("iiwa_bayonet", ["part.turn=0.5"])
    with refused("part.lug_width: ", "wider than the shaft"):
        load_scenario("iiwa_bayonet", ["part.lug_width=0.009"])
    with refused("task.travel_success: ", "never reached"):
        load_scenario("iiwa_bayonet", ["task.travel_success=0.055"])

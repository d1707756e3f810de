"""What the arm's posture along the way changes of a step that the twin takes at A."""

import numpy as np
import pytest

from drake_disasm.cell.grip import AXIS_ORDER
from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.scenario import load_scenario
from drake_disasm.twin.steps import Steps
from sysid.models.arm_posture import ArmPosture, _pose

_SCENARIO = load_scenario("removal")
_LOAD = np.array([[1.0, -10.0, 2.0, 0.3, 0.0, -0.2]])  # [f; tau] at Bo in Gn
_NOTHING = np.zeros((1, 6))


def _at(q: np.ndarray, v: np.ndarray) -> Steps:
    """Returns a step with the command at A."""
    return Steps(np.zeros(1, int), q, v, _NOTHING, _NOTHING, _NOTHING, _NOTHING)


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_under_a_load_an_arm_comes_to_rest_as_its_stiffness_there_has_it(share):
    posture = ArmPosture.of(_SCENARIO)
    way, order = share * posture.end, list(AXIS_ORDER)
    place = way * np.eye(6)[[posture.axis]]
    force = (_LOAD @ posture.to_grip.T)[:, order]
    x = np.zeros((1, 12))
    for _ in range(40):
        moved = posture.moves(_at(*np.hsplit(x, 2)), place, _LOAD)
        own = posture.at_A if share == 0.0 else posture.at_end
        after = own.ahead(x, np.zeros((1, 12))) + force @ own.G.T
        at_A = posture.at_A.ahead(x, np.zeros((1, 12))) + force @ posture.at_A.G.T
        np.testing.assert_allclose(at_A[:, :6] + moved, after[:, :6], atol=1e-12)
        x = after
    K = twin_of(_SCENARIO, _pose(posture.axis, way)).arm.K[np.ix_(order, order)]
    np.testing.assert_allclose(x[0, :6], np.linalg.solve(K, force[0]), rtol=1e-6)


def test_farther_along_the_door_chains_groove_the_arm_yields_by_a_sixth_more():
    """As measured in the cell: 62 um/N across the groove at A, 73 um/N at its end."""
    posture = ArmPosture.of(_SCENARIO)
    yields = []
    for way in (0.0, posture.end):
        twin = twin_of(_SCENARIO, _pose(posture.axis, way))
        S = posture.to_grip.T
        yields.append((S @ np.linalg.inv(twin.arm.K) @ S.T)[1, 1])
    assert yields[1] / yields[0] == pytest.approx(7 / 6, abs=0.05)

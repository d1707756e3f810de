"""The controller's model of arm and tool: its Jacobian, and its inertia at the bolt."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from drake_disasm.cell.arm_dynamics import ArmDynamics
from drake_disasm.common.spatial import rotation_vector
from drake_disasm.stations import CellStation


@pytest.fixture(scope="module")
def dynamics(cell: CellStation) -> ArmDynamics:
    """Of the default cell."""
    return ArmDynamics(cell.scenario.arm, cell.tool, cell.X_WG)


def _pose(dynamics: ArmDynamics, q: np.ndarray) -> RigidTransform:
    dynamics.set_positions(q)
    return dynamics.pose()


def test_pose_and_jacobian_are_the_stations_coordinates(dynamics, cell) -> None:
    q = cell.start + 0.1
    expected = cell.coordinates.pose(q)
    assert _pose(dynamics, q).IsNearlyEqualTo(expected, 1e-12)
    step = 1e-6
    columns = []
    for direction in np.eye(7):
        ahead = _pose(dynamics, cell.start + step * direction)
        behind = _pose(dynamics, cell.start - step * direction)
        turn = rotation_vector(ahead.rotation() @ behind.rotation().inverse())
        move = ahead.translation() - behind.translation()
        columns.append(np.concatenate([move, turn]) / (2 * step))
    dynamics.set_positions(cell.start)
    np.testing.assert_allclose(dynamics.jacobian(), np.array(columns).T, atol=1e-8)


def test_inertia_at_the_bolt_is_what_the_arms_is_felt_as_there(dynamics, cell) -> None:
    """A force there accelerates it by Lambda^-1, whatever the null space does."""
    dynamics.set_positions(cell.start)
    J, M = dynamics.jacobian(), dynamics.mass_matrix()
    force = np.array([3.0, -2.0, 1.0, 0.3, 0.2, -0.1])
    acceleration = J @ np.linalg.solve(M, J.T @ force)
    np.testing.assert_allclose(dynamics.bolt_inertia() @ acceleration, force)

"""Coordinates map to poses and back, for the arm and for the twin."""

import numpy as np
import pytest
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from drake_disasm.cell.coordinates import ArmCoordinates
from drake_disasm.common.errors import DisasmError
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import CellStation, SimulatedStation, TwinStation
from tests.refusals import refusal


def _error(X: RigidTransform, Y: RigidTransform) -> tuple[float, float]:
    """Distance [m] and angle [rad] between two poses."""
    difference = X.inverse() @ Y
    angle = difference.rotation().ToAngleAxis().angle()
    return float(np.linalg.norm(difference.translation())), float(angle)


@pytest.mark.parametrize("name", ["cell", "twin"])
@pytest.mark.parametrize("seed", range(2))
def test_solve_inverts_pose_from_the_start_on(name: str, seed: int, request) -> None:
    """Over the greatest step, 3 mm and 1 degree on each axis, along a path."""
    station: SimulatedStation = request.getfixturevalue(name)
    generator, q, X_GB = np.random.default_rng(seed), station.start, RigidTransform()
    assert station.coordinates.pose(q).IsNearlyEqualTo(X_GB, 1e-7)
    for _ in range(5):
        p = X_GB.translation() + generator.uniform(-0.003, 0.003, 3)
        rpy = generator.uniform(-0.0175, 0.0175, 3)
        X_GB = RigidTransform(RollPitchYaw(rpy).ToRotationMatrix() @ X_GB.rotation(), p)
        q = station.coordinates.solve(X_GB, q)
        distance, angle = _error(X_GB, station.coordinates.pose(q))
        assert distance < 1e-6 and angle < 1e-5


def test_twin_coordinates_are_xyz_and_turns_about_z_x_y(twin: TwinStation) -> None:
    """Of the middle of the pads, from where it is at A."""
    p_BoTo_B = twin.parameters.p_BoTo_B
    assert np.linalg.norm(p_BoTo_B) > 0.01
    X_GB = twin.coordinates.pose(np.array([1, 2, 3, 0.3, 0.2, 0.1]))
    turns = zip((0.3, 0.2, 0.1), np.eye(3)[[2, 0, 1]], strict=True)
    z, x, y = (RotationMatrix(AngleAxis(angle, axis)) for angle, axis in turns)
    turn = z @ x @ y
    np.testing.assert_allclose(X_GB.rotation().matrix(), turn.matrix(), atol=1e-15)
    np.testing.assert_allclose(X_GB @ p_BoTo_B, np.add(p_BoTo_B, [1, 2, 3]), rtol=1e-14)


def test_what_is_out_of_reach_is_refused(cell: CellStation) -> None:
    scenario = load_scenario("removal", ["placement.p_WG=[1.4, 0, 0.2]"])
    assert "placement.p_WG" in refusal(CellStation, scenario)
    far = RigidTransform([0.9, 0.5, 0.0])
    message = refusal(cell.coordinates.solve, far, cell.start)
    assert "can't follow" in message and "placement.p_WG" in message


def test_a_turn_beyond_the_joints_limits_is_refused(cell: CellStation) -> None:
    """The bolt's place alone could be kept: the orientation must not be lost."""
    X_GB = RigidTransform([0.0, 0.05, 0.0])
    assert isinstance(cell.coordinates, ArmCoordinates)
    q = cell.coordinates.start(X_GB)
    with pytest.raises(DisasmError, match=r"can't follow"):
        for _ in range(100):  # a degree at a time, until joint 6 is at its end
            turned = RollPitchYaw(0, 0, np.deg2rad(1)).ToRotationMatrix()
            X_GB = RigidTransform(turned @ X_GB.rotation(), X_GB.translation())
            q = cell.coordinates.solve(X_GB, q)
            assert _error(X_GB, cell.coordinates.pose(q))[1] < 1e-3

"""The cell at rest: what the sensor reads, how the arm yields, how the grip holds."""

import numpy as np
import pytest
from pydrake.math import RotationMatrix

from drake_disasm.scenario import load_scenario
from drake_disasm.stations import CellStation
from tests.physics.measurements import AWAY, QUIET, pushed, stated_stiffness, stiffness

RESOLUTION = np.array([0.2, 0.2, 0.8, 0.010, 0.010, 0.002])  # HEX-E, noise-free
G = 9.81
#: Joint angles with the tool upright, level, upside down, and askew in the air.
POSTURES = [
    [0.0, 0.5, 0.0, -1.2, 0.0, 1.44, 0.0],
    [0.0, 0.2, 0.0, -1.2, 0.0, 0.2, 0.5],
    [0.0, -0.2, 0.0, -0.6, 0.0, -0.4, 0.0],
    [0.7, 0.3, -0.5, -1.4, 0.8, 1.0, -1.2],
    [-0.6, -0.4, 0.4, -1.7, 1.2, -0.8, 2.0],
]


@pytest.fixture(scope="module")
def welded() -> CellStation:
    """A cell whose bolt is part of the tool."""
    return CellStation(load_scenario("removal", [QUIET, "gripper.hold=weld"]))


def _expected(station: CellStation, R_WS: RotationMatrix) -> np.ndarray:
    """Weights of sensor, gripper and bolt, from their sheets' masses and places."""
    grip = station.X_SB.translation()[2] - 0.00425 - 0.015  # above Bo, towards S
    parts = [(0.347, 0.025), (1.025, 0.050 + 0.070), (0.2, grip)]
    g_S = R_WS.matrix().T @ [0, 0, -G]
    force = sum(mass for mass, _ in parts) * g_S
    moment = sum(mass * z for mass, z in parts)
    return np.concatenate([force, np.cross([0, 0, moment], g_S)])


@pytest.mark.parametrize("posture", POSTURES)
def test_sensor_reads_the_tools_weight(
    welded: CellStation, posture: list[float]
) -> None:
    simulator = welded.at_start([AWAY])
    context = simulator.get_mutable_context()
    plant = welded.plant
    frame_S = welded.tool_models.frame_S
    plant_context = welded.part_context(plant, context)
    plant.SetPositions(plant_context, welded.iiwa, posture)
    welded.GetInputPort("iiwa.position").FixValue(context, posture)
    simulator.AdvanceTo(welded.settling_time)
    R_WS = frame_S.CalcPoseInWorld(plant_context).rotation()
    reading = welded.reading_at_zeroing(context)
    difference = np.abs(reading - _expected(welded, R_WS))
    assert np.all(difference < RESOLUTION), difference
    assert plant.get_contact_results_output_port().Eval(
        plant_context
    ).num_hydroelastic_contacts() in (0, 2)  # open air: at most the pads


def test_postures_cover_orientations(welded: CellStation) -> None:
    """The weight's direction in S differs by over 30 degrees between any two."""
    directions = []
    for posture in POSTURES:
        X_GB = welded.coordinates.pose(np.array(posture))
        R_WS = (
            welded.X_WG.rotation() @ X_GB.rotation() @ welded.X_SB.rotation().inverse()
        )
        directions.append(R_WS.matrix().T @ [0, 0, -1])
    cosines = np.array(directions) @ np.array(directions).T - 2 * np.eye(len(POSTURES))
    assert cosines.max() < np.cos(np.deg2rad(30))


def test_cartesian_stiffness_is_the_stated_one(cell: CellStation) -> None:
    """At the arm within 1 %; at the bolt as `twin.stiffness` has it, within 5 %."""
    table = stiffness(cell, [5.0, 5.0, 5.0, 0.1, 0.1, 0.02])
    np.testing.assert_allclose(table[:, 1], stated_stiffness(cell), rtol=0.01)
    twin = cell.scenario.twin.stiffness
    np.testing.assert_allclose(table[:5, 0], twin[:5], rtol=0.05)


def test_grip_creeps_less_than_stated(cell: CellStation) -> None:
    """Regularised friction creeps: 1 N along x moves the neck 0.12 mm in 10 s."""
    early, late = (pushed(cell, [1, 0, 0, 0, 0, 0], t)[0][0] for t in (1.0, 4.0))
    assert 0.0 < (late - early) / 3.0 < 1e-5  # m/s


def test_resting_arm_does_not_sag(cell: CellStation) -> None:
    context = cell.settled([])
    measured = cell.GetOutputPort("iiwa.position_measured").Eval(context)
    assert np.abs(measured - cell.start).max() < 1e-6

"""The cell at rest: what the sensor reads, how the arm yields, how the grip holds."""

import numpy as np
import pytest
from compliance import AWAY
from physics import QUIET, STIFF, pushed, stated_stiffness, stiffness
from pydrake.math import RotationMatrix

from drake_disasm.cell.twin_parameters import bolt_stiffness
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import CellStation

RESOLUTION = np.array([0.2, 0.2, 0.8, 0.010, 0.010, 0.002])  # HEX-E, noise-free
G = 9.81
#: Within which a push has come to rest [s], by the arm's control.
SETTLES = {"position": 0.6, "joint_impedance": 1.2, "cartesian_impedance": 2.4}
#: Joint angles with the tool level, upside down, and askew in the air.
POSTURES = [
    [0.0, 0.2, 0.0, -1.2, 0.0, 0.2, 0.5],
    [0.0, -0.2, 0.0, -0.6, 0.0, -0.4, 0.0],
    [0.7, 0.3, -0.5, -1.4, 0.8, 1.0, -1.2],
]


@pytest.fixture(scope="module")
def welded() -> CellStation:
    """A cell whose bolt is part of the tool, where the sheets have it: it can't sag."""
    return CellStation(load_scenario("removal", [QUIET, STIFF, "gripper.hold=weld"]))


def _expected(station: CellStation, R_WS: RotationMatrix) -> np.ndarray:
    """Weights of sensor, gripper and bolt, from their sheets' masses and places."""
    grip = station.X_SB.translation()[2] - 0.00425 - 0.015  # above Bo, towards S
    parts = [(0.347, 0.025), (1.025, 0.050 + 0.070), (0.2, grip)]
    g_S = R_WS.matrix().T @ [0, 0, -G]
    force = sum(mass for mass, _ in parts) * g_S
    moment = sum(mass * z for mass, z in parts)
    return np.concatenate([force, np.cross([0, 0, moment], g_S)])


@pytest.mark.parametrize("posture", POSTURES)
def test_sensor_reads_the_tools_weight(welded: CellStation, posture) -> None:
    simulator = welded.at_start([AWAY])
    context = simulator.get_mutable_context()
    plant = welded.plant
    frame_S = welded.tool_models.frame_S
    plant_context = welded.part_context(plant, context)
    plant.SetPositions(plant_context, welded.arm_instance, posture)
    welded.GetInputPort("iiwa.position").FixValue(context, posture)
    simulator.AdvanceTo(welded.settling_time)
    R_WS = frame_S.CalcPoseInWorld(plant_context).rotation()
    reading = welded.reading_at_zeroing(context)
    difference = np.abs(reading - _expected(welded, R_WS))
    assert np.all(difference < RESOLUTION), difference
    assert plant.get_contact_results_output_port().Eval(
        plant_context
    ).num_hydroelastic_contacts() in (0, 2)  # open air: at most the pads


def test_a_stiff_grip_has_the_stiffness_that_the_twin_takes() -> None:
    """At the arm within 1 %; at the bolt as `bolt_stiffness` has it, within 5 %."""
    station = CellStation(load_scenario("removal", [QUIET, STIFF]))
    table = stiffness(station, [5.0, 5.0, 5.0, 0.1, 0.1, 0.02])
    np.testing.assert_allclose(table[:, 1], stated_stiffness(station), rtol=0.01)
    expected = bolt_stiffness(station.scenario)
    np.testing.assert_allclose(table[:5, 0], expected[:5], rtol=0.05)


@pytest.mark.parametrize("control", SETTLES)
def test_arm_is_as_stiff_as_its_control_states(control: str) -> None:
    """At the measured pose, each axis by itself, within 2 %."""
    overrides = [QUIET, STIFF, f"arm.control={control}", "gripper.hold=weld"]
    station = CellStation(load_scenario("removal", overrides))
    table = stiffness(station, [5.0, 5.0, 5.0, 0.1, 0.1, 0.1], SETTLES[control])
    np.testing.assert_allclose(table[:, 1], stated_stiffness(station), rtol=0.02)


def test_grip_creeps_less_than_stated(cell: CellStation) -> None:
    """Regularised friction creeps: 1 N along x moves the neck 0.12 mm in 10 s."""
    early, late = (pushed(cell, [1, 0, 0, 0, 0, 0], t)[0][0] for t in (1.0, 4.0))
    assert 0.0 < (late - early) / 3.0 < 1e-5  # m/s


@pytest.mark.parametrize("control", ["position", "cartesian_impedance"])
def test_resting_arm_does_not_sag(control: str) -> None:
    cell = CellStation(load_scenario("removal", [QUIET, f"arm.control={control}"]))
    context = cell.settled([])
    measured = cell.GetOutputPort("iiwa.position_measured").Eval(context)
    assert np.abs(measured - cell.start).max() < 1e-6


def test_stiffest_cartesian_impedance_comes_to_rest() -> None:
    """The torques are explicit in time: at KUKA's bounds nothing rings up."""
    overrides = [
        "gripper.hold=weld",
        "arm.control=cartesian_impedance",
        "arm.cartesian_impedance.stiffness=[5000, 5000, 5000, 300, 300, 300]",
        "arm.cartesian_impedance.damping_ratio=0.1",
        "arm.cartesian_impedance.nullspace_stiffness=1000",
    ]
    station = CellStation(load_scenario("removal", overrides))
    simulator = station.at_start([AWAY])
    context = simulator.get_mutable_context()
    plant_context = station.part_context(station.plant, context)
    pushed_off = np.array([1, -1, 1, -1, 1, -1, 1]) * 0.05  # rad/s
    station.plant.SetVelocities(plant_context, station.arm_instance, pushed_off)
    simulator.Initialize()
    speeds = []
    for time in (0.5, 1.5, 3.0):
        simulator.AdvanceTo(time)
        v = station.GetOutputPort("iiwa.velocity_estimated").Eval(context)
        speeds.append(np.abs(v).max())
    assert speeds[0] < 0.05 and speeds[2] < 0.2 * speeds[0], speeds

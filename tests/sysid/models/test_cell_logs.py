"""Logs of the cell, which the twin predicts to the noise and error that it states."""

import dataclasses

import numpy as np
import pytest
import sensor_in_motion
from pydrake.math import RigidTransform

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.common.spatial import velocity_shift
from drake_disasm.effects import SensorBias, SensorGainDrift
from drake_disasm.logs import Log
from drake_disasm.policies import Exploring, make_policy
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.task.recording import record_transitions
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm.twin.arm_step import ArmStep
from sysid.models.cell_arm import CellArm, Sway
from sysid.models.transitions import FORCE_ERROR, POSE_ERROR
from sysid.models.twin import TwinModel
from sysid.objective import rms
from tests.refusals import refused

_SCENARIO = load_scenario("removal")
_IMPEDANCE = load_scenario("removal", ["arm.control=joint_impedance"])
_STEPS = 40


@pytest.fixture(scope="module")
def cell_log(tmp_path_factory) -> Log:
    """The first steps of an episode, half of which touch the groove."""
    scenario = load_scenario("removal", [f"task.steps={_STEPS}"])
    policy = Exploring(make_policy("admittance", scenario), 1.5e-4, 0)
    simulation = TaskSimulation(scenario, "cell", policy)
    folder = tmp_path_factory.mktemp("cell") / "log"
    return record_transitions(folder, simulation, _STEPS)


def _as_of(log: Log, station: str) -> Log:
    """Returns the same log, said to be of another station."""
    provenance = {**log.header.provenance, "station": station}
    header = dataclasses.replace(log.header, provenance=provenance)
    return dataclasses.replace(log, header=header)


def _residual(log: Log, scenario: Scenario = _SCENARIO) -> np.ndarray:
    model = TwinModel([log], scenario, ())
    measured = model.measurements
    return (model.predictions(np.zeros(0)) - measured.values) / measured.sigma


def test_the_twin_predicts_the_cell_to_what_it_states(cell_log):
    assert max(map(rms, _residual(cell_log).T)) < 1.5


def test_the_cells_command_leads_by_half_of_what_it_is_held(cell_log):
    """Else the arm is 11 micrometres behind all the way."""
    led, even = (
        abs(_residual(_as_of(cell_log, s))[5:, 0].mean()) for s in ("cell", "hardware")
    )
    assert led < 0.15 and even > 0.3


def test_the_error_grows_with_the_forces_change(cell_log):
    measured = TwinModel([cell_log], _SCENARIO, ()).measurements
    (episode,) = cell_log.episodes
    change = np.linalg.norm(np.diff(episode["wrench"][:, :3], axis=0), axis=1)
    least, share = FORCE_ERROR
    force = np.hypot(least, share * change)
    for axis in (6, 7, 8):
        np.testing.assert_allclose(measured.model_error[:, axis], force)
    lever = measured.model_error[:, 9:] / force[:, None]
    np.testing.assert_allclose(
        lever, np.tile([0.297, 0.297, 0.005], (_STEPS, 1)), atol=1e-3
    )
    place = np.repeat(POSE_ERROR, 3)
    np.testing.assert_array_equal(measured.model_error[:, :6], [place] * _STEPS)
    half = measured.select(np.arange(_STEPS) % 2 == 0)
    np.testing.assert_array_equal(half.model_error, measured.model_error[::2])


def test_a_log_of_the_twin_has_none(cell_log):
    measured = TwinModel([_as_of(cell_log, "twin")], _SCENARIO, ()).measurements
    assert measured.model_error is None
    np.testing.assert_array_equal(measured.sigma, measured.noise)


def test_the_compliance_is_that_of_the_arms_posture():
    """At stop B, along x, the arm is 4 micrometres stiffer per newton than at A."""
    arm, twin = CellArm.of(_SCENARIO, "cell"), twin_of(_SCENARIO)
    q, push, none = (
        np.array([[0.06, 0, 0, 0, 0, 0]]),
        np.array([[-3.0, 0, 0, 0, 0, 0]]),
        np.zeros((1, 3)),
    )
    X_GB = BoltCoordinates(twin.p_BoTo_B).pose(q[0])
    here, there = (
        np.linalg.inv(twin_of(_SCENARIO, X).arm.K) for X in (RigidTransform(), X_GB)
    )
    expected = (there - here) @ velocity_shift(twin.p_BoTo_B).T @ push[0]
    found = arm.shifts(q, push, none)[0]
    np.testing.assert_allclose(found[:3], expected[:3], rtol=1e-6, atol=1e-12)
    assert 3e-6 < abs(found[0]) < 2e-5
    assert not arm.shifts(0.0 * q, push, none).any()
    assert not CellArm.of(_SCENARIO, "twin").shifts(q, push, none).any()


def test_the_arm_carries_a_moment_of_what_the_springs_have_moved():
    arm, twin = CellArm.of(_SCENARIO, "cell"), twin_of(_SCENARIO)
    moment, at_A = np.array([[0.0, 0.0, 0.05]]), np.zeros((1, 6))
    turned = np.linalg.solve(twin.arm.K, [0.0, 0.0, 0.0, 0.0, 0.0, 0.05])
    found = arm.shifts(at_A, at_A, moment)[0]
    np.testing.assert_allclose(found[:3], turned[:3], atol=1e-15)
    np.testing.assert_allclose(found[3:], turned[[5, 4, 3]], atol=1e-15)


def test_a_rate_that_comes_late_is_a_command_elsewhere():
    """The arm ends a step where a late rate of the same command has it."""
    arm, twin, h = CellArm.of(_SCENARIO, "cell"), twin_of(_SCENARIO), 0.1
    late = _SCENARIO.arm.control_period
    short, rest = (ArmStep.of(twin.arm, twin.grip, t) for t in (late, h - late))
    whole, rate = ArmStep.of(twin.arm, twin.grip, h), 0.01 * np.eye(6)[1]

    def command(time: float, rate_told: np.ndarray) -> np.ndarray:
        return np.hstack([rate * time, rate_told])[None]

    at_begin = short.ahead(np.zeros((1, 12)), command(late, rate))
    # What the damper would have done with the rate that is not there yet.
    missing = late * np.linalg.solve(twin.arm.M, twin.arm.D)[1, 1] * rate[1]
    at_begin[0, 7] -= missing
    expected = rest.ahead(at_begin, command(h, rate))[0, 1]
    told = command(h, rate)
    told[0, :6] += arm.ahead(np.array([np.zeros(6), rate]))[1] - arm.lead * rate
    found = whole.ahead(np.zeros((1, 12)), told)[0, 1]
    even = whole.ahead(np.zeros((1, 12)), command(h, rate))[0, 1]
    assert found == pytest.approx(expected, abs=0.3 * abs(even - expected))


def test_the_sway_is_what_cell_and_twin_read_of_free_motion():
    scenario = load_scenario("removal", sensor_in_motion.QUIET)
    first, steady = (
        sensor_in_motion.responses(TaskSimulation(scenario, "cell"), 2, 3e-5)
        - sensor_in_motion.responses(TaskSimulation(scenario, "twin"), 2, 3e-5)
    )[:, 2]
    sway = Sway.of(_SCENARIO, "cell")
    assert sway.steady[2] == pytest.approx(steady, abs=0.2)
    assert sway.change[2] == pytest.approx(first - steady, abs=0.3)
    rates = np.array([[0.0, 0.0, 2e-3]] * 3)
    R_SB = np.array([[-1.0, 0, 0], [0, 0, -1], [0, -1, 0]])
    expected = -2e-3 * np.array([first, steady, steady])  # z of G is -y of S
    np.testing.assert_allclose(sway.wrenches(rates, R_SB)[:, 1], expected, atol=1e-3)
    for other in (Sway.of(_SCENARIO, "twin"), Sway.of(_IMPEDANCE, "cell")):
        assert not other.wrenches(rates, R_SB).any()


@pytest.fixture(scope="module")
def leaning(tmp_path_factory) -> tuple[Log, Scenario]:
    """A sensor's offset turns the bolt until it leans on the lips for seconds."""
    hidden = SensorBias(tx=0.095)
    scenario = dataclasses.replace(_SCENARIO, effects=[hidden])
    policy = Exploring(make_policy("admittance", scenario), 1.5e-4, 7080)
    simulation = TaskSimulation(scenario, "cell", policy)
    folder = tmp_path_factory.mktemp("leaning") / "log"
    return record_transitions(folder, simulation, 56, 7080), scenario


def test_a_bolt_that_leans_creeps_in_the_pads_and_its_weight_turns(leaning):
    """Else the force along x drifts away, and the one across is off by 0.2 N."""
    log, scenario = leaning
    of_cell, stiff, of_twin = (
        _residual(_as_of(log, s), scenario) for s in ("cell", "hardware", "twin")
    )
    assert rms(of_cell[40:, 6]) < 0.6 * rms(stiff[40:, 6])
    for channel in (7, 9):
        turned, even = (rms(r[20:, channel]) for r in (of_cell, of_twin))
        assert turned < 1.0 and turned < 0.5 * even


def test_a_gain_acts_on_the_weight_of_all_that_hangs_on_the_cells_sensor(tmp_path):
    """Of the gripper, 15 N, and not of the twin's bolt and fingers, 3 N."""
    scenario = dataclasses.replace(_SCENARIO, effects=[SensorGainDrift(fz=0.3)])
    policy = Exploring(make_policy("admittance", scenario), 1.5e-4, 3)
    simulation = TaskSimulation(scenario, "cell", policy)
    log = record_transitions(tmp_path / "log", simulation, 20, 3)
    whole, of_twin = (
        rms(_residual(_as_of(log, s), scenario)[:, 8]) for s in ("cell", "twin")
    )
    assert whole < 1.5 and of_twin > 10.0


def test_logs_of_twin_and_cell_have_other_loads_on_their_sensors(cell_log):
    with refused("logs of the twin", "logs of a cell"):
        TwinModel([cell_log, _as_of(cell_log, "twin")], _SCENARIO, ())
    TwinModel([cell_log, _as_of(cell_log, "hardware")], _SCENARIO, ())

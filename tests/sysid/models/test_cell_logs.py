"""Logs of the cell, which the twin predicts to the noise and error that it states."""

import copy
import dataclasses
from pathlib import Path

import numpy as np
import pytest
import sensor_in_motion

from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.common.spatial import velocity_shift
from drake_disasm.effects import SensorBias, SensorGainDrift, SensorWarmUp
from drake_disasm.logs import Log
from drake_disasm.policies import Exploring, make_policy
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.task.recording import record_transitions
from drake_disasm.task.simulation import TaskSimulation
from sysid.models.cell_motion import sway
from sysid.models.sensor_reading import SensorReading
from sysid.models.transitions import FORCE_ERROR, POSE_ERROR, measured_states
from sysid.models.twin import TwinModel, with_impact_as_stiff
from sysid.objective import rms
from tests.refusals import refused

_SCENARIO = load_scenario("removal")
_IMPEDANCE = load_scenario("removal", ["arm.control=joint_impedance"])
_STEPS = 40


@pytest.fixture(scope="module")
def cell_log(tmp_path_factory) -> Log:
    """The first steps of an episode, half of which touch the groove."""
    scenario = load_scenario("removal", [f"task.steps={_STEPS}"])
    return _recorded(tmp_path_factory.mktemp("cell") / "log", scenario)


def _recorded(folder: Path, scenario: Scenario) -> Log:
    policy = Exploring(make_policy("admittance", scenario), 1.5e-4, 0)
    simulation = TaskSimulation(scenario, "cell", policy)
    return record_transitions(folder, simulation, _STEPS)


def test_the_twin_predicts_what_a_sensor_under_the_part_reads(tmp_path):
    """Which moving loads with nothing, and the weight of what is moved neither."""
    scenario = load_scenario("removal", ["ft_sensor.place=part"])
    log = _recorded(tmp_path / "log", scenario)
    residual = _residual(log, scenario)
    assert max(map(rms, residual.T)) < 1.2
    in_the_wrist = _residual(log, _SCENARIO)
    assert max(map(rms, in_the_wrist[:, 9:].T)) > 1.4


def _as_of(log: Log, station: str) -> Log:
    """Returns the same log, said to be of another station."""
    provenance = {**log.header.provenance, "station": station}
    header = dataclasses.replace(log.header, provenance=provenance)
    return dataclasses.replace(log, header=header)


def _residual(log: Log, scenario: Scenario = _SCENARIO, first: int = 0) -> np.ndarray:
    """Returns residuals in units of the noise, from a row on."""
    whole = TwinModel([log], scenario, ())
    model = whole.of_rows(np.arange(whole.measurements.rows) >= first)
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
    sensing = SensorReading.of([cell_log], _SCENARIO)
    measured = measured_states([cell_log], _SCENARIO, sensing)
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
    twin = twin_of(_SCENARIO)
    S = velocity_shift(twin.p_BoTo_B)
    yields = np.linalg.norm((S @ np.linalg.inv(twin.arm.K) @ S.T)[:, :3], axis=1)
    place = np.hypot(np.repeat(POSE_ERROR, 3), np.outer(force, yields))
    np.testing.assert_allclose(measured.model_error[:, :6], place)
    half = measured.select(np.arange(_STEPS) % 2 == 0)
    np.testing.assert_array_equal(half.model_error, measured.model_error[::2])


def test_a_log_of_the_twin_has_none(cell_log):
    measured = TwinModel([_as_of(cell_log, "twin")], _SCENARIO, ()).measurements
    assert measured.model_error is None
    np.testing.assert_array_equal(measured.sigma, measured.noise)


def test_the_sway_is_what_cell_and_twin_read_of_free_motion():
    scenario = load_scenario("removal", sensor_in_motion.QUIET)
    first, steady = (
        sensor_in_motion.responses(TaskSimulation(scenario, "cell"), 2, 3e-5)
        - sensor_in_motion.responses(TaskSimulation(scenario, "twin"), 2, 3e-5)
    )[:, 2]
    rates = np.array([[0.0, 0.0, 2e-3]] * 3)
    R_SB = np.array([[-1.0, 0, 0], [0, 0, -1], [0, -1, 0]])
    expected = -2e-3 * np.array([first, steady, steady])  # z of G is -y of S
    found = sway(_SCENARIO, "cell", rates, R_SB)[:, 1]
    np.testing.assert_allclose(found, expected, atol=1e-3)
    for other, station in ((_SCENARIO, "twin"), (_IMPEDANCE, "cell")):
        assert not sway(other, station, rates, R_SB).any()


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
        _residual(_as_of(log, s), scenario, first)
        for s, first in (("cell", 20), ("hardware", 40), ("twin", 20))
    )
    assert rms(of_cell[20:, 6]) < 0.6 * rms(stiff[:, 6])
    for channel in (7, 9):
        turned, even = (rms(r[:, channel]) for r in (of_cell, of_twin))
        assert turned < 1.0 and turned < 0.5 * even


def test_a_bolt_that_wedges_leans_on_the_heads_edges(tmp_path):
    """How stiff these are follows from the scenario, to the error that is stated."""
    hidden = SensorWarmUp(fx=1.3, time_constant=21.0)
    scenario = dataclasses.replace(_SCENARIO, effects=[hidden])
    policy = Exploring(make_policy("admittance", scenario), 1.5e-4, 0)
    simulation = TaskSimulation(scenario, "cell", policy)
    log = record_transitions(tmp_path / "log", simulation, 60)
    known = with_impact_as_stiff(scenario)
    assert max(map(rms, _residual(log, known).T)) < 1.6
    wall = copy.deepcopy(known)
    wall.contact.impact.stiffness *= 6.0
    assert rms(_residual(log, wall)[:, 10]) > 3.0
    of_forces = measured_states([log], known, SensorReading.of([log], known))
    with_stiffness = TwinModel([log], known, ()).measurements.model_error
    share = with_stiffness[:, 6] / of_forces.model_error[:, 6]
    np.testing.assert_allclose(share[:30], 1.0, rtol=0.01)
    assert share[40:60].mean() > 1.5


def test_a_gain_acts_on_the_weight_of_all_that_hangs_on_the_cells_sensor(tmp_path):
    """Of the gripper, 15 N, and not of the twin's bolt and fingers, 3 N."""
    scenario = dataclasses.replace(_SCENARIO, effects=[SensorGainDrift(fz=0.3)])
    policy = Exploring(make_policy("admittance", scenario), 1.5e-4, 3)
    simulation = TaskSimulation(scenario, "cell", policy)
    log = record_transitions(tmp_path / "log", simulation, 20, 3)
    whole, of_twin = (
        rms(_residual(_as_of(log, s), scenario, 10)[:, 8]) for s in ("cell", "twin")
    )
    assert whole < 1.5 and of_twin > 10.0


def test_logs_of_twin_and_cell_have_other_loads_on_their_sensors(cell_log):
    with refused("logs of the twin", "logs of a cell"):
        TwinModel([cell_log, _as_of(cell_log, "twin")], _SCENARIO, ())
    TwinModel([cell_log, _as_of(cell_log, "hardware")], _SCENARIO, ())


def test_where_a_part_comes_free_the_whole_load_may_be_lost(cell_log):
    """In the last two steps of an episode that ends so, whenever contact is lost.

    With 0.3 m from the part to the sensor.
    """
    (episode,) = cell_log.episodes
    columns = {name: values.copy() for name, values in episode.columns.items()}
    columns["terminated"][-1] = True
    columns["wrench.fx"][-3:] = 8.0, 6.4, 0.0
    freed = dataclasses.replace(episode, columns=columns)
    errors = [
        TwinModel(
            [dataclasses.replace(cell_log, episodes=(e,))], _SCENARIO, ()
        ).measurements.model_error
        for e in (episode, freed)
    ]
    assert np.all(errors[1][-2:, 6:9] > 8.0) and np.all(errors[1][-2:, 9:] > 2.2)
    np.testing.assert_allclose(errors[1][:-3], errors[0][:-3], rtol=1e-3)

"""A sensor in the wrist, one under the fixed part, and none: the same wrench."""

import functools

import numpy as np
import pytest
from fault_runs import in_lockstep

from drake_disasm.cell.arm_wrench import ArmWrench
from drake_disasm.cell.sensor import fixed_inertia
from drake_disasm.common.ports import cell_ports, port_differences
from drake_disasm.effects import SensorBias
from drake_disasm.mdp import Outcome
from drake_disasm.policies import make_policy
from drake_disasm.scenario import Scenario, load_scenario, validate
from drake_disasm.stations import CellStation, SimulatedStation, make_station
from drake_disasm.task.episode import run_episode
from drake_disasm.task.recording import transitions_header
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm.twin.batch import BatchedTwin
from tests.drake_disasm.conftest import QUIET, STIFF
from tests.refusals import refused

PLACES = ("wrist", "part", "none")
G = 9.81


def _scenario(place: str, *overrides: str, name: str = "removal") -> Scenario:
    return load_scenario(name, [QUIET, f"ft_sensor.place={place}", *overrides])


@functools.cache
def _station(kind: str, place: str) -> SimulatedStation:
    return make_station(kind, _scenario(place))


def _carried(kind: str, place: str) -> float:
    """What is weighed [kg], by the datasheets: sensor, gripper, bolt."""
    part = fixed_inertia(_scenario("part")).get_mass()
    of_cell = {"wrist": 0.347 + 1.025 + 0.2, "part": 0.347 + part, "none": 1.025 + 0.2}
    if kind == "cell" or place == "part":
        return of_cell[place]
    return float(_station("twin", "wrist").payload_mass)  # bolt and fingers


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("kind", ["cell", "twin"])
def test_a_known_weight_is_read(kind: str, place: str) -> None:
    """S points down in the wrist and up under the part."""
    station = _station(kind, place)
    reading = station.initial_state.reading
    sign = -1.0 if place == "part" else 1.0
    weight = sign * G * _carried(kind, place)
    np.testing.assert_allclose(reading[:3], [0.0, 0.0, weight], atol=0.01)
    np.testing.assert_allclose(station.payload_mass, _carried(kind, place), rtol=1e-6)
    assert station.initial_state.force < 0.01


def _pressed(kind: str, place: str, *overrides: str) -> TaskSimulation:
    """A simulation whose bolt is pressed across the slot, at rest."""
    simulation = TaskSimulation(_scenario(place, STIFF, *overrides), kind)
    simulation.reset(0)
    for step in range(12):
        simulation.step(np.eye(6)[2] * 0.0004 * (step < 4))
    return simulation


@pytest.mark.parametrize("kind", ["cell", "twin", "impact"])
def test_a_press_reads_the_same_at_every_place(kind: str) -> None:
    """Without a sensor in the wrist the tool is shorter, and the arm stiffer."""
    station, *model = ["twin", "contact.model=impact"] if kind == "impact" else [kind]
    wrist, part, none = (
        _pressed(station, place, *model).observation()[6:] for place in PLACES
    )
    assert -22.0 < part[2] < -15.0
    np.testing.assert_allclose(part[:3], none[:3], atol=0.01)
    np.testing.assert_allclose(part[3:], none[3:], atol=0.002)
    np.testing.assert_allclose(part[:3], wrist[:3], rtol=0.2)


def test_torques_tell_what_the_sensor_in_the_wrist_reads() -> None:
    """In one episode, under 18 N: S is on the flange."""
    simulation = _pressed("cell", "wrist")
    station, arm = simulation.station, simulation.scenario.arm
    q, v, torque, reading = (
        simulation.evaluate(station, port)
        for port in (
            "iiwa.position_measured",
            "iiwa.velocity_estimated",
            "iiwa.torque_measured",
            "ft_sensor.wrench",
        )
    )
    estimate = ArmWrench(arm).load(q, v, np.zeros(7), torque)
    assert np.abs(reading).max() > 15.0
    np.testing.assert_allclose(estimate, reading, atol=0.02)


@pytest.mark.parametrize("kind", ["cell", "twin"])
@pytest.mark.parametrize("place", PLACES)
def test_effects_act_on_the_reading_whatever_the_place(kind: str, place: str) -> None:
    station = _station(kind, place)
    context = station.CreateDefaultContext()
    before = station.GetOutputPort("ft_sensor.wrench").Eval(context)
    station.set_effects(context, [SensorBias(fx=1.0)])
    change = station.GetOutputPort("ft_sensor.wrench").Eval(context) - before
    np.testing.assert_allclose(change, [1.0, 0, 0, 0, 0, 0], atol=2e-4)


@pytest.mark.parametrize("place", ["part", "none"])
@pytest.mark.parametrize("kind", ["cell", "twin"])
def test_admittance_takes_the_bolt_out(kind: str, place: str) -> None:
    scenario = load_scenario("removal", [f"ft_sensor.place={place}"])
    simulation = TaskSimulation(scenario, kind, make_policy("admittance", scenario))
    assert run_episode(simulation, 0).outcome is Outcome.SUCCESS


def test_an_arm_tells_a_wrench_from_its_torques() -> None:
    """With a mass moved about at the flange; torques by the same laws."""
    arm = _scenario("none").arm
    estimate, q = ArmWrench(arm), np.array(arm.posture)
    external = np.array([1.0, -2.0, 3.0, 0.1, 0.2, -0.3])
    torque = estimate.torque(q, external)
    np.testing.assert_allclose(estimate.external(q, torque), external, atol=1e-9)
    still = np.zeros(7)
    held = estimate.load(q, still, still, still)  # torques of no drive at all
    np.testing.assert_allclose(
        estimate.load(q, still, still, -torque) - held, external, atol=1e-9
    )


@pytest.mark.parametrize("place", ["part", "none"])
def test_hardware_reads_it_too(place: str) -> None:
    scenario = load_scenario("removal", [f"ft_sensor.place={place}"])
    with in_lockstep(scenario, make_policy("straight")) as (simulation, station, cell):
        simulation.reset(0)
        assert port_differences(station, cell_ports("iiwa", 7)) == []
        simulation.step()
        there = cell.simulator.get_context()
        truth = cell.station.GetOutputPort("ft_sensor.wrench").Eval(there)
        found = simulation.evaluate(station, "ft_sensor.wrench")
        np.testing.assert_allclose(found, truth, atol=1.0)
        assert np.abs(simulation.observation()[6:]).max() < 1.0


def test_ports_and_logs_are_the_same_but_say_what_the_wrench_is_from() -> None:
    words = {"wrist": "in the wrist", "part": "fixed part", "none": "without a sensor"}
    for place, text in words.items():
        station = _station("cell", place)
        assert isinstance(station, CellStation)
        assert port_differences(station, cell_ports("iiwa", 7)) == []
        header = transitions_header(station.scenario, "cell", {})
        assert text in header.provenance["wrench_from"]


def test_what_does_not_go_together_is_refused() -> None:
    with refused("ft_sensor.place", "wrist"):
        load_scenario("removal", ["ft_sensor.place=elbow"])
    with refused("observation.variant", "ft_sensor.place"):
        validate(_scenario("part", "observation.variant=small_angle"))
    with refused("ft_sensor.place", "part", "wrist"):
        BatchedTwin([_scenario(place, "contact.model=impact") for place in PLACES])

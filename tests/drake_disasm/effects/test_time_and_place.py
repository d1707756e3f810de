"""Effects that depend on time, and effects in a place of a user's own."""

import abc
import dataclasses

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_disasm.common.arrays import to_numpy
from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import (
    BoltMotion,
    Effect,
    Environment,
    EnvironmentEffect,
    amplitude,
    find_effect,
    register_effect,
    registry,
)
from drake_disasm.logs import read_log
from drake_disasm.policies import make_policy
from drake_disasm.scenario import Scenario, load_scenario, scenario_from_mapping
from drake_disasm.stations import make_station
from drake_disasm.task.diagram import add_task
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm.twin.batch import BatchedTwin
from sysid.models.twin import TwinModel
from sysid.objective import Objective
from sysid.validation.synthetic_logs import transitions_log
from sysid.workers import Workers

SEEN: list[np.ndarray] = []
PERIOD = 0.1  # s, of the task


@dataclasses.dataclass
class Clock(EnvironmentEffect):
    """Notes the time that it is given, and adds its own share of it to the friction."""

    rate: float = amplitude("1/s", 0.0, 1.0, "of the friction")
    is_local = True

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        SEEN.append(np.array(to_numpy(bolt.time), dtype=np.float64))
        friction = environment.friction + self.rate * bolt.time
        return dataclasses.replace(environment, friction=friction)


@pytest.fixture(autouse=True)
def clock(own_effects: None) -> None:
    """The clock is registered, and has seen nothing."""
    register_effect(Clock)
    SEEN.clear()


def _scenario() -> Scenario:
    scenario = load_scenario("removal", ["contact.model=impact", "task.steps=4"])
    scenario.effects = [Clock(0.1)]
    return scenario


def _times() -> np.ndarray:
    """The times that were seen, each once, in their order."""
    seen = dict.fromkeys(float(t) for each in SEEN for t in np.ravel(each))
    return np.array(list(seen))


def test_an_episode_gives_the_time_at_which_each_step_begins() -> None:
    simulation = TaskSimulation(_scenario(), "twin", make_policy("straight"))
    simulation.reset(0)
    for _ in range(3):
        simulation.step()
    assert _times() == pytest.approx(PERIOD * np.arange(3))


def test_a_diagram_of_ones_own_gives_the_same_times() -> None:
    builder = DiagramBuilder()
    station = builder.AddSystem(make_station("twin", _scenario()))
    add_task(builder, station, make_policy("straight"))
    simulator = Simulator(builder.Build())
    station.attach(simulator)
    SEEN.clear()
    simulator.AdvanceTo(2.5 * PERIOD)
    assert _times() == pytest.approx(PERIOD * np.arange(3))


def test_a_batch_gives_each_environment_its_own_time() -> None:
    twins = BatchedTwin([_scenario()] * 2)
    twins.reset([0, 1])
    SEEN.clear()
    action = np.zeros((2, 6))
    for _ in range(3):
        twins.step(action)
    arrays = [time for time in SEEN if time.shape == (2,)]
    assert arrays[-1] == pytest.approx(2.0 * PERIOD)


def test_a_log_s_model_with_the_effect_leaves_the_noise_alone(tmp_path) -> None:
    from examples.drying_grease import DryingGrease  # registers it, for this test

    register_effect(DryingGrease)
    stated = load_scenario("removal_turned", ["contact.model=impact"])
    grease = DryingGrease(0.4, 0.5)
    transitions_log(tmp_path / "log", stated, [grease], seed=0, episodes=2, steps=12)
    errors = []
    for effects in ([], [grease]):
        model = TwinModel([read_log(tmp_path / "log")], stated, ())
        objective = Objective(
            model.with_effects([*stated.effects, *effects]), Workers()
        )
        errors.append(objective(np.zeros(0)))
    assert errors[1] < 0.8 * errors[0]


class TendonEffect(Effect, abc.ABC):
    """A place that no station has."""


def _tendon(**fields: object) -> type[Effect]:
    name = "TendonSlack"
    made = type(name, (TendonEffect,), {"__doc__": "Slack.", "__module__": __name__})
    size = amplitude("N", 0.0, 5.0, "force")
    made.__annotations__ = {"size": float}
    made.size = size  # type: ignore[attr-defined]
    return dataclasses.dataclass(made)


def test_an_effect_may_act_in_a_place_of_ones_own() -> None:
    effect = register_effect(place=TendonEffect)(_tendon())
    assert find_effect("TendonSlack") is effect
    scenario = scenario_from_mapping(
        {"effects": [{"effect": "TendonSlack", "size": 1.0}]}
    )
    with pytest.raises(DisasmError, match=r"TendonSlack.*place"):
        make_station("twin", scenario)


@pytest.mark.parametrize(
    ("place", "words"),
    [
        (None, "place"),
        (3, "place"),
        (Effect, "place"),
        (EnvironmentEffect, "EnvironmentEffect"),
    ],
)
def test_a_place_that_is_none_is_refused(place: object, words: str) -> None:
    with pytest.raises(DisasmError, match=f"TendonSlack: .*{words}"):
        registry._register(_tendon(), place)  # type: ignore[arg-type]

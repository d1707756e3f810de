"""Episodes of a scenario with ranges."""

import numpy as np
import pytest

from drake_disasm.policies import make_policy
from drake_disasm.scenario import Scenario, load_scenario, with_values
from drake_disasm.task.episode import run_episode
from drake_disasm.task.recording import EpisodeRecorder
from drake_disasm.task.simulation import TaskSimulation


def _ranged(*ranges: tuple[str, float, float]) -> Scenario:
    text = ", ".join(
        f"{{parameter: {name}, low: {low}, high: {high}}}" for name, low, high in ranges
    )
    overrides = ["task.steps=20", f"randomisation=[{text}]"]
    return load_scenario("removal_turned", overrides)


def _columns(scenario: Scenario, seed: int = 3) -> dict[str, np.ndarray]:
    simulation = TaskSimulation(scenario, "twin", make_policy("straight"))
    recorder = EpisodeRecorder(simulation)
    run_episode(simulation, seed, recorder)
    return recorder.columns()


def test_a_range_of_one_value_is_that_value() -> None:
    """Noise too is what it is without ranges: the draws have a stream of their own."""
    values = {"effects.0.ry": 0.04, "part.clearance": 0.0003, "contact.friction": 0.3}
    short = with_values(load_scenario("removal_turned", ["task.steps=20"]), values)
    expected = _columns(short)
    ranged = _columns(_ranged(*((name, v, v) for name, v in values.items())))
    for name, value in values.items():
        np.testing.assert_array_equal(ranged.pop(f"extra.{name}"), value)
    assert expected.keys() == ranged.keys()
    for name in expected:
        np.testing.assert_array_equal(expected[name], ranged[name], err_msg=name)


def test_effects_change_in_place_and_anything_else_rebuilds() -> None:
    simulation = TaskSimulation(_ranged(("effects.0.ry", -0.05, 0.05)), "twin")
    simulation.reset(0)
    diagram, first = simulation.diagram, simulation.drawn
    simulation.reset(1)
    assert simulation.diagram is diagram and simulation.drawn != first
    simulation = TaskSimulation(_ranged(("part.clearance", 3e-4, 5e-4)), "twin")
    simulation.reset(0)
    diagram = simulation.diagram
    simulation.reset(0)
    assert simulation.diagram is diagram
    simulation.reset(1)
    assert simulation.diagram is not diagram


def test_an_episode_does_not_depend_on_those_before_it() -> None:
    scenario = load_scenario("removal_randomised", ["task.steps=5"])
    simulation = TaskSimulation(scenario, "twin", make_policy("straight"))
    run_episode(simulation, 1)
    again = run_episode(simulation, 2)
    alone = run_episode(TaskSimulation(scenario, "twin", make_policy("straight")), 2)
    assert again == alone


@pytest.mark.parametrize("model", ["twin", "cell"])
def test_every_end_of_the_shipped_ranges_can_be_built(model: str) -> None:
    scenario = load_scenario("removal_randomised")
    for end in ("low", "high"):
        values = {r.parameter: getattr(r, end) for r in scenario.randomisation}
        simulation = TaskSimulation(with_values(scenario, values), model)
        force = np.linalg.norm(simulation.reset(0)[6:9])
        assert force < scenario.task.reward.f_max / 2

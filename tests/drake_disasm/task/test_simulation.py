"""The task's diagram: in-place resets, seeds, and stepping with and without policy."""

import warnings

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import LeafSystem

from drake_disasm.common.timing import POLICY_DELAY, boundary
from drake_disasm.effects import ChainPull, GroovePose, SensorBias
from drake_disasm.mdp import BoltState, Outcome, TaskGeometry
from drake_disasm.policies import make_policy
from drake_disasm.scenario import Range, load_scenario
from drake_disasm.task.diagram import LoadAtStartWarning
from drake_disasm.task.episode import run_episode
from drake_disasm.task.recording import EpisodeRecorder
from drake_disasm.task.simulation import TaskSimulation
from tests.drake_disasm.conftest import QUIET

TURNED = [GroovePose(ry=0.03)]
IMPACT = ["contact.model=impact", QUIET]


@pytest.fixture(scope="module", params=["cell", "twin"])
def simulation(request: pytest.FixtureRequest) -> TaskSimulation:
    scenario = load_scenario("removal", ["imprecision=1e-4"])
    return TaskSimulation(scenario, request.param, make_policy("straight"))


def _observations(simulation: TaskSimulation, seed: int, steps: int = 6) -> np.ndarray:
    first = simulation.reset(seed, TURNED)
    return np.array([first, *(simulation.step().observation for _ in range(steps))])


def test_same_seed_same_bits_after_other_episodes(simulation: TaskSimulation) -> None:
    """In this diagram, and in another one of the same scenario."""
    before = _observations(simulation, 3)
    simulation.reset(4, [SensorBias(fx=1.0)])
    simulation.step()
    np.testing.assert_array_equal(_observations(simulation, 3), before)
    scenario, name = simulation.scenario, simulation.station_name
    again = TaskSimulation(scenario, name, make_policy("straight"))
    np.testing.assert_array_equal(_observations(again, 3), before)
    assert np.all(np.any(_observations(simulation, 4) != before, axis=1))
    # Actions from outside equal a policy's.
    open_loop = TaskSimulation(scenario, name)
    open_loop.reset(3, TURNED)
    action = make_policy("straight")(np.zeros(12))
    stepped = [open_loop.step(action).observation for _ in range(6)]
    np.testing.assert_array_equal(stepped, before[1:])


def test_every_period_holds_the_same_number_of_plant_steps() -> None:
    """In free motion each step after the first moves the bolt by the same way."""
    simulation = TaskSimulation(load_scenario("removal", [QUIET]), "twin")
    x = [simulation.reset(0)[0]]
    for _ in range(40):
        x.append(simulation.step(np.array([1e-3, 0, 0, 0, 0, 0])).observation[0])
    np.testing.assert_allclose(np.diff(x)[5:], 1e-3, rtol=1e-6)


def test_rewards_telescope(simulation: TaskSimulation) -> None:
    """The sum of the progress terms is the bolt's whole way: no step counts twice."""
    geometry = TaskGeometry.of(simulation.scenario)

    def x(observation: np.ndarray) -> float:
        return float(geometry.place(BoltState.from_vector(observation))[0])

    first = simulation.reset(5, TURNED)
    results = [simulation.step() for _ in range(12)]
    progress = sum(result.reward_terms["progress"] for result in results)
    way_mm = 1e3 * (x(results[-1].observation) - x(first))
    assert progress == pytest.approx(1.6 * way_mm, rel=1e-12)


@pytest.mark.parametrize("period", [0.1, 0.07])
def test_drake_agrees_on_when_the_policy_acts(period: float) -> None:
    """Nothing is left over between a period's end and the next one's start."""
    times: list[float] = []

    class Watch(LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclarePeriodicPublishEvent(
                period, POLICY_DELAY, lambda context: times.append(context.get_time())
            )

    simulator = Simulator(Watch())
    simulator.Initialize()
    simulator.AdvanceTo(2000 * period)
    assert times == [boundary(k, period) for k in range(len(times))]
    assert len(times) == 2000


def test_recorder_has_minaris_layout() -> None:
    scenario = load_scenario("removal", ["task.steps=5", "imprecision=1e-4"])
    simulation = TaskSimulation(scenario, "cell", make_policy("straight"))
    recorder = EpisodeRecorder(simulation)
    summary = run_episode(simulation, 0, recorder)
    assert (summary.steps, summary.outcome) == (5, Outcome.STEP_LIMIT)
    assert summary.outcome.truncated and not summary.outcome.terminated
    columns = recorder.columns()
    assert recorder.steps == 5
    assert {len(values) for values in columns.values()} == {6}
    np.testing.assert_allclose(columns["time"], 0.1 * np.arange(6))
    np.testing.assert_array_equal(columns["action"][:5, 0], 1e-3)
    np.testing.assert_array_equal(columns["action"][5], 0.0)
    moved = np.diff(columns["X_GB_commanded"][:, :3], axis=0)
    np.testing.assert_allclose(moved, columns["action_executed"][:5, :3], atol=1e-15)
    assert columns["truncated"].tolist() == [False] * 5 + [True]
    assert columns["q"].shape == (6, 7)


def test_a_start_in_contact_is_said() -> None:
    """A groove that is 2 mm on presses its end against the bolt; zeroing hides it."""
    simulation = TaskSimulation(load_scenario("removal"), "twin")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulation.reset(1)
        simulation.reset(1, [GroovePose(x=-0.002)])
    with pytest.warns(LoadAtStartWarning, match=r"under \d+\.\d\d N at the start"):
        simulation.reset(1, [GroovePose(x=0.002)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # the same start again
        simulation.reset(2, [GroovePose(x=0.002)])


def test_effects_on_the_bolts_motion_may_come_with_an_episode() -> None:
    """Given for it, or drawn from a range: the diagram was built without them."""
    plain, ranged = (load_scenario("chapter3", IMPACT) for _ in range(2))
    ranged.randomisation = [Range("ChainPull.k", 400.0, 400.0)]
    ends = []
    for scenario, given in ((plain, [ChainPull(k=400.0)]), (ranged, None), (plain, [])):
        simulation = TaskSimulation(scenario, "twin")
        simulation.reset(0, given)
        pull = np.array([1e-3, 0.0, 0.0, 0.0, 0.0, 0.0])
        ends.append([simulation.step(pull).observation for _ in range(10)][-1])
    pulled, same, loose = ends
    assert np.array_equal(pulled, same)
    assert loose[6] - pulled[6] > 2.0  # N, of 4 by then

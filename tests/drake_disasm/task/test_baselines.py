"""What the two scripted policies do on turned grooves, and that no cheat pays more."""

from collections.abc import Callable

import numpy as np
import pytest

from drake_disasm.effects import GroovePose
from drake_disasm.mdp import BoltState, Outcome, TaskGeometry
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.episode import EpisodeSummary, run_episode
from drake_disasm.task.simulation import TaskSimulation

F_MAX = 20.0  # N
SCENARIO = load_scenario("removal")
GEOMETRY = TaskGeometry.of(SCENARIO)
HOVER = GEOMETRY.ends[-1] - 0.001  # m, just below the height that counts as out


def _episodes(
    model: str, policy: str, angle_deg: float, seeds: range, name: str = "removal"
) -> list[EpisodeSummary]:
    scenario = load_scenario(name)
    scenario.effects = [GroovePose(ry=np.deg2rad(angle_deg))]
    simulation = TaskSimulation(scenario, model, make_policy(policy, scenario))
    return [run_episode(simulation, seed) for seed in seeds]


def _assert_jammed(summaries: list[EpisodeSummary], travel: float) -> None:
    for summary in summaries:
        assert summary.outcome is Outcome.FORCE_LIMIT
        assert summary.travel < travel
        assert not summary.bolt_is_out


def _slow(*values: object) -> object:
    return pytest.param(*values, marks=pytest.mark.slow)


@pytest.mark.parametrize(("model", "angle_deg"), [
    ("cell", 4.0), _slow("cell", 0.0), ("twin", -4.0), _slow("twin", 0.0),
    _slow("twin", 2.0), _slow("twin", 4.0),
])  # fmt: skip
def test_admittance_removes_the_bolt(model: str, angle_deg: float) -> None:
    for summary in _episodes(model, "admittance", angle_deg, range(1)):
        assert summary.outcome is Outcome.SUCCESS
        assert summary.bolt_is_out
        assert summary.max_force < F_MAX


@pytest.mark.parametrize(("model", "angle_deg"), [
    ("cell", -4.0), ("twin", 2.0), _slow("cell", 2.0), _slow("twin", -4.0),
])  # fmt: skip
def test_straight_jams_before_the_end(model: str, angle_deg: float) -> None:
    """On the stiff grip; one that yields lets the arm go on for long."""
    episodes = _episodes(model, "straight", angle_deg, range(1), "chapter4_stiff")
    _assert_jammed(episodes, 0.055)


def _cheat(then: str) -> Callable[[np.ndarray], np.ndarray]:
    """Removes the bolt up to just below success, then flies on or up and down."""
    honest, cheats = make_policy("admittance", SCENARIO), []

    def act(observation: np.ndarray) -> np.ndarray:
        y = GEOMETRY.place(BoltState.from_vector(observation))[1]
        if y < HOVER - 0.0003 and not cheats:
            return np.minimum(honest(observation), [1, 0.0004, 1, 1, 1, 1])
        cheats.append(len(cheats) + 1)
        if then == "fly on":
            return np.array([0.003, 0.2 * (HOVER - y), 0.0, 0.0, 0.0, 0.0])
        return np.array([0.0, 0.003 * (-1.0) ** cheats[-1], 0.0, 0.0, 0.0, 0.0])

    return act


def _episode(policy: object) -> EpisodeSummary:
    return run_episode(TaskSimulation(SCENARIO, "twin", policy), 1)


def test_cheating_pays_less_than_removing_the_bolt() -> None:
    honest = _episode(make_policy("admittance", SCENARIO))
    assert honest.outcome is Outcome.SUCCESS
    ends = {"fly on": Outcome.WORKSPACE, "up and down": Outcome.STEP_LIMIT}
    for then, end in ends.items():
        cheat = _episode(_cheat(then))
        assert cheat.outcome is end and cheat.reward < honest.reward, then


@pytest.mark.parametrize(
    ("axis", "station"), [(0, "twin"), (1, "twin"), (2, "twin"), (1, "cell")]
)
def test_pulling_at_a_bolt_that_is_stuck_is_no_success(axis: int, station: str) -> None:
    """In a grip that yields the arm goes on; the bolt's place is judged."""
    action = np.zeros(6)
    action[axis] = (-0.001, 0.001, 0.001)[axis]
    scenario = load_scenario("removal", ["ft_sensor.noise=[0, 0, 0, 0, 0, 0]"])
    simulation = TaskSimulation(scenario, station)
    simulation.reset(1)
    for step in range(11):  # and two at rest: a damper acts while the arm moves
        result = simulation.step(action * (step < 9))
        assert result.outcome is Outcome.RUNNING
    X_GnB = simulation.evaluate(simulation.station, "bolt_pose")
    state = BoltState.from_vector(result.observation)
    assert abs(state.p[axis]) > 0.008
    place = GEOMETRY.place(state)
    np.testing.assert_allclose(place, X_GnB.translation(), atol=1e-4)

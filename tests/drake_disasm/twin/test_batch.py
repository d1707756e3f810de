"""Many twins in lockstep: seeds, ranges, noise, company, and what a batch refuses."""

import dataclasses

import numpy as np
import pytest

from drake_disasm import effects as ef
from drake_disasm.scenario import Range, Scenario, draw, load_scenario
from drake_disasm.twin.batch import BatchedTwin
from drake_disasm.twin.history import BatchHistory
from drake_disasm.twin.refusals import refuse_without_compiler
from drake_disasm.twin.starts import NextEpisodes
from tests.drake_disasm.twin.sizes import actions
from tests.refusals import refusal

IMPACT = ["contact.model=impact"]
QUIET = [*IMPACT, "ft_sensor.noise=[0, 0, 0, 0, 0, 0]"]
RANDOM = load_scenario("removal_randomised", IMPACT)


def _run(twin: BatchedTwin, seeds: list[int], steps: int = 4) -> np.ndarray:
    states = [twin.reset(seeds).copy()]
    for action in actions(steps):
        moves = np.repeat(action[None], twin.count, axis=0)
        states.append(twin.step(moves).observation.copy())
    return np.array(states)


def test_no_bit_of_an_environment_depends_on_its_company():
    seeds = [5, 8, 5, 11, 9]
    for scenario in (RANDOM, load_scenario("removal", IMPACT)):
        whole = _run(BatchedTwin(scenario, 5, "numpy"), seeds)
        for row in (1, 4):
            alone = _run(BatchedTwin(scenario, 1, "numpy"), [seeds[row]])
            assert np.array_equal(whole[:, row], alone[:, 0])
        assert np.array_equal(whole[:, 0], whole[:, 2])
        assert not np.array_equal(whole[:, 0], whole[:, 3])


def test_seeds_draw_what_the_diagram_draws_and_generators_seeds() -> None:
    twin = BatchedTwin(RANDOM, 3, "numpy")
    twin.reset([4, 9, 4])
    assert twin.drawn == [draw(RANDOM, seed) for seed in (4, 9, 4)]
    twin = BatchedTwin(RANDOM, 3, "numpy")
    twin.reset([0, 1, 2])
    following = NextEpisodes(twin, [np.random.default_rng(i) for i in range(3)])
    mine = [np.random.default_rng(i) for i in range(3)]
    for rows in ([1], [1, 2], [0, 1, 2]):
        seeds, episodes = following.take(np.array(rows))
        assert seeds == [int(mine[row].integers(2**31)) for row in rows]
        expected = twin.begin(np.array(rows), seeds)
        np.testing.assert_allclose(episodes.state.q, expected.state.q, atol=1e-9)


def test_noise_is_the_scenarios_and_of_the_seed():
    scenario = load_scenario("removal", IMPACT)
    twin = BatchedTwin(scenario, 400, "numpy")
    first = twin.reset(range(400)).copy()
    sigma = np.std(first[:, 6:9], axis=0)  # at A, sensor and groove are parallel
    np.testing.assert_allclose(np.sort(sigma), [0.035, 0.035, 0.15], rtol=0.15)
    again = twin.reset(range(400))
    assert np.array_equal(first, again)


def test_imprecision_is_that_of_algorithm_3_2():
    psi = 3e-4
    scenario = load_scenario("removal", [*QUIET, f"imprecision={psi}"])
    twin = BatchedTwin(scenario, 300, "numpy")
    twin.reset(range(300))
    moved = twin.step(np.tile([5e-4, 0, 0, 0, 0, 0], (300, 1))).observation
    commanded = twin.episodes.commanded
    assert np.std(commanded.p[:, 1]) == pytest.approx(psi, rel=0.2)
    assert np.mean(commanded.p[:, 0]) == pytest.approx(5e-4, abs=1e-4)
    assert np.array_equal(commanded.R[:, 0, 0], np.ones(300))
    assert np.isfinite(moved).all()


def test_what_is_not_finite_ends_its_own_environment_alone() -> None:
    scenario = load_scenario("removal", QUIET)
    twin, alone = BatchedTwin(scenario, 3, "numpy"), BatchedTwin(scenario, 1, "numpy")
    twin.reset([0, 1, 2])
    alone.reset([2])
    for number, action in enumerate(actions(3)):
        moves = np.repeat(action[None], 3, axis=0)
        if number == 1:
            moves[1, 4] = np.nan
        result, expected = twin.step(moves), alone.step(action[None])
        if number == 1:
            assert result.failure[1].startswith("environment 1: its action is not")
            assert result.reward[1] == 0.0
        assert not result.failure[0] and not result.failure[2]
        assert np.isfinite(result.observation).all()
    np.testing.assert_allclose(
        result.observation[2], expected.observation[0], atol=1e-9
    )
    twin = BatchedTwin(load_scenario("removal", QUIET), 2, "numpy")
    twin.reset([0, 1])
    twin.episodes.state.q[0, 3] = np.nan
    result = twin.step(np.repeat(actions(1), 2, axis=0))
    assert "environment 0: no contact force" in result.failure[0]
    assert not result.failure[1] and np.isfinite(result.observation).all()


def test_effects_in_other_orders_share_a_batch():
    one, two = ef.GroovePose(ry=0.02), ef.GrooveFriction(coefficient=0.1)
    base = load_scenario("removal", QUIET)
    orders = [[one, two], [two, one], [one], []]
    scenarios = [dataclasses.replace(base, effects=effects) for effects in orders]
    states = _run(BatchedTwin(scenarios, device="numpy"), [0] * 4)
    np.testing.assert_allclose(states[:, 0], states[:, 1], atol=1e-9)
    alone = _run(BatchedTwin(scenarios[2], device="numpy"), [0])
    np.testing.assert_allclose(states[:, 2], alone[:, 0], atol=1e-9)


def test_fixed_scenarios_share_their_starts_beside_randomised_ones(monkeypatch):
    fixed = _with()
    drawn = _with(randomisation=[Range("GroovePose.ry", 0.02, 0.06)])
    twin = BatchedTwin([drawn, fixed, drawn, fixed], device="numpy")
    begun = []

    def begin(rows, scenarios, own=twin._batch.begin):
        begun.append(rows)
        return own(rows, scenarios)

    monkeypatch.setattr(twin._batch, "begin", begin)
    states = _run(twin, [5, 6, 7, 8])
    assert begun == [[0, 2]]
    for row, scenario in enumerate(twin.scenarios):
        alone = _run(BatchedTwin([scenario], device="numpy"), [5 + row])
        np.testing.assert_allclose(states[:, row], alone[:, 0], atol=1e-9)


def test_a_bolt_that_is_thrown_away_ends_its_episode_alone():
    """Contact hardly does it: here the command goes where no arm does."""
    twin = BatchedTwin(load_scenario("chapter3", IMPACT), 2, device="numpy")
    twin.reset([0, 1])
    history = BatchHistory(twin)
    twin.episodes.goal[0, 1] = 20.0
    result = twin.step(np.zeros((2, 6)))
    history.add(result)
    assert "thrown" in result.failure[0] and not result.failure[1]
    assert np.abs(result.observation[:, :3]).max() < 1.0
    assert result.reward[0] == 0.0
    recorded = history.episode(0, 1)
    assert np.abs(recorded["X_GB_measured"]).max() < 2.0


def test_an_episode_whose_start_has_failed_is_recorded_in_numbers():
    twin = BatchedTwin(_with(), 2, "numpy")
    twin.reset([1, 2])
    history = BatchHistory(twin)
    twin.episodes.commanded.p[1] = np.nan
    history.begin(np.array([1]))
    history.add(twin.step(np.zeros((2, 6))))
    assert np.isfinite(history.episode(1, 1)["X_GB_commanded"]).all()


@dataclasses.dataclass
class OneAtATime(ef.EnvironmentEffect):
    """Friction by a table, which takes no arrays."""

    a: float = ef.amplitude("1", -1.0, 1.0, "what decides")

    def apply(self, environment: ef.Environment, bolt: object) -> ef.Environment:
        return dataclasses.replace(environment, friction=0.1 if self.a > 0 else 0.3)


def test_an_effect_of_a_user_whose_equation_takes_no_arrays_is_refused(own_effects):
    ef.register_effect(OneAtATime)
    message = refusal(BatchedTwin, [_with(effects=[OneAtATime(a=0.5)]), _with()])
    assert "OneAtATime: its equation takes no arrays" in message


def _with(*settings: str, **changes: object) -> Scenario:
    scenario = load_scenario("removal", [*QUIET, *settings])
    return dataclasses.replace(scenario, **changes)


FRICTION = ef.JointCoulombFriction(joint="iiwa_joint_1", size=1.0)
SLOW, LAG = ["ft_sensor.period=0.008"], ef.SensorLag(share=1.0)


@pytest.mark.parametrize(
    ("scenarios", "options", "words"),
    [
        (_with(), {"count": 0}, "num_envs: 0"),
        ([], {}, "num_envs: 0"),
        ([_with(), _with()], {"count": 3}, "scenarios: 2 for 3 environments"),
        (_with(), {"device": "tpu9"}, "device: 'tpu9' is not there"),
        (_with("contact.model=hydroelastic"), {}, "contact.model: 'hydroelastic'"),
        (_with(effects=[FRICTION]), {}, "JointCoulombFriction"),
        (_with(effects=[ef.PoseDelay(0.1)]), {}, "PoseDelay: a batch reports poses"),
        ([_with(), _with("task.period=0.2")], {}, "task.period: 0.2 and 0.1"),
        (_with(*SLOW, effects=[LAG]), {}, "ft_sensor.period: 0.008"),
        (_with(randomisation=[Range("task.period", 0.1, 0.2)]), {}, "task.period"),
    ],
)
def test_what_it_cannot_carry_is_one_clear_error(scenarios, options, words):
    assert words in refusal(BatchedTwin, scenarios, **options)


def test_steps_and_seeds_of_another_size_are_refused():
    twin = BatchedTwin(_with(), 2, "numpy")
    assert "nothing was reset" in refusal(twin.step, np.zeros((2, 6)))
    assert "seeds: 3 for 2" in refusal(twin.reset, range(3))
    twin.reset(range(2))
    assert "(2, 6)" in refusal(twin.step, np.zeros((2, 5)))


def test_a_gpu_that_is_not_there_or_without_its_compiler_is_refused(monkeypatch):
    monkeypatch.setattr("torch.cuda.is_available", lambda: False)
    assert "device: 'cuda' is not there" in refusal(BatchedTwin, _with(), device="cuda")
    monkeypatch.setattr("numba.cuda.is_available", lambda: False)
    assert "[gpu]" in refusal(refuse_without_compiler, "cuda")

"""The vector environment: gymnasium's contract, and the diagram's environment."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import drake_disasm.learning.environment  # noqa: F401, registers the ids
from drake_disasm.effects import GroovePose
from drake_disasm.learning.environment import DisassemblyEnv
from drake_disasm.learning.vector_environment import DisassemblyVectorEnv
from drake_disasm.scenario import Scenario, load_scenario
from tests.drake_disasm.conftest import without_imprecision
from tests.refusals import refused

QUIET = ["contact.model=impact", "ft_sensor.noise=[0, 0, 0, 0, 0, 0]"]


def _make(count: int, name: str = "Removal", **options: object) -> DisassemblyVectorEnv:
    return gymnasium.make_vec(
        f"drake_disasm/{name}-v0",
        num_envs=count,
        vectorization_mode="vector_entry_point",
        **options,
    )


def _short(steps: int = 3) -> Scenario:
    return load_scenario("removal", [*QUIET, f"task.steps={steps}"])


def test_gymnasium_makes_it_with_spaces_and_units():
    envs = _make(3)
    assert envs.num_envs == 3
    assert envs.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    assert envs.metadata["observation_units"]["fx"] == "N"
    assert envs.metadata["action_units"]["du"] == "rad"
    assert np.isfinite(envs.single_observation_space.high[:6]).all()
    np.testing.assert_allclose(envs.single_action_space.high[:3], 0.001)
    observation, _ = envs.reset(seed=1)
    assert envs.observation_space.contains(observation)
    envs.action_space.seed(0)
    for _ in range(3):
        observation, reward, *_ = envs.step(envs.action_space.sample())
        assert envs.observation_space.contains(observation)
        assert reward.shape == (3,)
    envs.close()


def test_an_environment_sees_what_the_diagrams_sees():
    """Through three episodes: the seed decides the ranges in all of them."""
    scenario = load_scenario("removal_randomised", [*QUIET, "task.steps=2"])
    scenario = without_imprecision(scenario)
    envs, one = _make(2, scenario=scenario), DisassemblyEnv(scenario)
    found, infos = envs.reset(seed=6)
    expected, info = one.reset(seed=7)
    action = np.array([8e-4, 0, 4e-4, 0, 2e-3, 0], np.float32)
    for _ in range(3):
        for _ in range(2):
            np.testing.assert_allclose(found[1, :6], expected[:6], atol=1e-6)
            np.testing.assert_allclose(found[1, 6:], expected[6:], atol=0.02)
            assert infos["outcome"][1] == info["outcome"] == "running"
            expected, reward, ended, out_of_time, info = one.step(action)
            found, rewards, *ends, infos = envs.step(np.tile(action, (2, 1)))
            assert rewards[1] == pytest.approx(reward, abs=5e-3)
            assert (ends[0][1], ends[1][1]) == (ended, out_of_time)
        final = infos["final_obs"][1]
        np.testing.assert_allclose(final[:6], expected[:6], atol=1e-6)
        assert infos["final_info"]["outcome"][1] == info["outcome"] == "step limit"
        expected, info = one.reset()


def test_an_episode_that_ends_is_followed_by_the_next_in_the_same_step():
    envs = _make(2, scenario=[_short(2), _short(3)])
    first, _ = envs.reset(seed=0)
    action = np.tile([5e-4, 0, 0, 0, 0, 0], (2, 1))
    envs.step(action)
    observation, reward, terminated, truncated, infos = envs.step(action)
    assert truncated.tolist() == [True, False] and not terminated.any()
    assert infos["_final_obs"].tolist() == [True, False]
    assert infos["final_obs"][0][0] > 8e-4 and infos["final_obs"][1] is None
    np.testing.assert_allclose(observation[0], first[0], atol=1e-5)
    assert observation[1, 0] > 8e-4
    assert infos["final_info"]["outcome"][0] == "step limit"
    assert infos["outcome"].tolist() == ["running", "running"]
    assert reward[0] > 0.5  # of the last step, not of the reset
    assert infos["final_info"]["reward_terms"]["progress"][0] > 0.5
    assert infos["reward_terms"]["progress"][0] == 0.0


def test_or_in_the_next_step_if_that_is_asked_for():
    envs = _make(1, scenario=_short(1), autoreset_mode=AutoresetMode.NEXT_STEP)
    first, _ = envs.reset(seed=0)
    action = np.tile([5e-4, 0, 0, 0, 0, 0], (1, 1))
    last, _, _, truncated, infos = envs.step(action)
    assert truncated[0] and last[0, 0] > 4e-4 and "final_obs" not in infos
    again, reward, _, truncated, _ = envs.step(action)
    np.testing.assert_allclose(again, first, atol=1e-5)
    assert reward[0] == 0.0 and not truncated[0]


def test_success_and_limits_terminate():
    scenario = load_scenario(
        "chapter3", [*QUIET, "task.travel_success=0.002", "task.reward.f_max=5"]
    )
    envs = _make(2, scenario=scenario)
    envs.reset(seed=0)
    moves = np.array([[3e-3, 0, 0, 0, 0, 0], [0, 0, 3e-3, 0, 0, 0]])
    ends = []
    for _ in range(5):
        _, _, terminated, truncated, infos = envs.step(moves)
        assert not truncated.any()
        ends += [infos["final_info"]["outcome"][i] for i in np.flatnonzero(terminated)]
    assert {"success", "force limit"} == set(ends)


def test_what_is_not_finite_ends_its_environment_and_is_named():
    envs = _make(3, scenario=_short(5))
    envs.reset(seed=0)
    action = np.tile([5e-4, 0, 0, 0, 0, 0], (3, 1))
    action[1, 2] = np.inf
    observation, reward, terminated, truncated, infos = envs.step(action)
    assert truncated.tolist() == [False, True, False] and not terminated.any()
    failure = infos["final_info"]["failure"][1]
    assert failure == "environment 1: its action is not finite; its episode ends"
    assert np.isfinite(observation).all() and np.isfinite(reward).all()
    action[1, 2] = 0.0
    observation, _, _, truncated, _ = envs.step(action)
    assert not truncated.any() and observation[1, 0] < observation[0, 0]


def test_effects_may_be_given_at_a_reset():
    envs = _make(1, scenario=_short(9))
    action = np.tile([5e-4, 0, 4e-4, 0, 0, 0], (1, 1))

    def force(options: dict[str, object] | None) -> float:
        envs.reset(seed=0, options=options)
        for _ in range(4):
            observation = envs.step(action)[0]
        return float(observation[0, 8])

    straight = force(None)
    assert force({"effects": [GroovePose(ry=0.1)]}) < straight - 0.05
    with refused("option 'efects'"):
        envs.reset(options={"efects": []})


@pytest.mark.parametrize(("count", "options", "words"), [
    (0, {}, "num_envs: 0"),
    (2, {"station": "cell"}, "station: 'cell' has no batch"),
    (2, {"device": "cuda:7"}, "device: 'cuda:7' is not there"),
    (2, {"scenario": ["removal"] * 3}, "scenario: 3 scenarios for 2"),
    (2, {"autoreset_mode": "Disabled"}, "autoreset_mode: Disabled"),
])  # fmt: skip
def test_bad_input_is_one_clear_error(count, options, words):
    with refused(words):
        _make(count, **options)


def test_seeds_may_be_a_list_and_the_same_seeds_repeat():
    envs = _make(2, "RemovalRandomised")
    first, _ = envs.reset(seed=[3, 5])
    again, _ = envs.reset(seed=[5, 3])
    np.testing.assert_allclose(first, again[::-1], atol=1e-6)
    other, _ = envs.reset()
    assert not np.allclose(other, again, atol=1e-4)
    with refused("seed: 3 seeds for 2"):
        envs.reset(seed=[1, 2, 3])
    with refused("actions: are of shape (6,)"):
        envs.step(np.zeros(6))

"""The environment, as Gymnasium and stable-baselines3 see it."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from drake_disasm.effects import GroovePose
from drake_disasm.learning.environment import DisassemblyEnv
from drake_disasm.learning.registration import IDS
from drake_disasm.mdp import REWARD_TERMS
from drake_disasm.scenario import load_scenario
from tests.refusals import refused


@pytest.fixture(scope="module")
def env() -> DisassemblyEnv:
    return DisassemblyEnv("removal")


def _push(env: DisassemblyEnv) -> tuple[bool, bool, dict, int]:
    """Pushes along +x until the episode ends."""
    for steps in range(1, 200):
        _, _, terminated, truncated, info = env.step(np.array([1e-3, 0, 0, 0, 0, 0]))
        if terminated or truncated:
            return terminated, truncated, info, steps
    raise AssertionError("the episode does not end")


@pytest.mark.parametrize("station", ["twin", "cell"])
def test_gymnasium_approves(station: str) -> None:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*infinity.*")
        check_env(DisassemblyEnv("removal", station))


def test_every_id_makes_its_scenario() -> None:
    for name in IDS:
        env = gymnasium.make(name, station="twin")
        assert isinstance(env.unwrapped, DisassemblyEnv)
        assert env.unwrapped.simulation.scenario.name == IDS[name]
        assert env.spec is not None and env.spec.max_episode_steps is None


def test_jams_and_success_terminate_and_a_time_limit_truncates(env):
    env.reset(seed=1, options={"effects": [GroovePose(ry=0.1)]})
    terminated, truncated, info, _ = _push(env)
    assert (terminated, truncated) == (True, False)
    assert info["outcome"] == "force limit" and not info["is_success"]
    short = DisassemblyEnv(load_scenario("removal", ["task.steps=3"]))
    short.reset(seed=1)
    terminated, truncated, info, steps = _push(short)
    assert (terminated, truncated, steps) == (False, True, 3)
    assert info["outcome"] == "step limit"
    near = DisassemblyEnv(load_scenario("chapter3", ["task.travel_success=0.003"]))
    near.reset(seed=1)
    terminated, truncated, info, _ = _push(near)
    assert (terminated, truncated, info["is_success"]) == (True, False, True)


def test_the_diagram_is_built_once_and_only_seeds_repeat(env: DisassemblyEnv) -> None:
    diagram = env.simulation.diagram
    runs = []
    for _ in range(2):
        first, _ = env.reset(seed=9)
        second, reward, _, _, info = env.step(np.array([1e-3, 0, 0, 0, 0, 0]))
        assert tuple(info["reward_terms"]) == REWARD_TERMS
        assert reward == pytest.approx(sum(info["reward_terms"].values()))
        np.testing.assert_allclose(info["wrench"], second[6:], rtol=1e-6)
        runs.append(np.concatenate([first, second]))
    assert env.simulation.diagram is diagram
    np.testing.assert_array_equal(*runs)
    env.reset(seed=9)
    assert not np.array_equal(env.reset()[0], env.reset()[0])


def test_bad_actions_and_options_are_refused(env: DisassemblyEnv) -> None:
    env.reset(seed=0)
    for action in (np.zeros(5), np.array([np.nan, 0, 0, 0, 0, 0])):
        with refused("give 6 finite numbers"):
            env.step(action)
    with refused("option 'speed' is not known"):
        env.reset(options={"speed": 1})

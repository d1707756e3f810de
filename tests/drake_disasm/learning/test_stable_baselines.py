"""The batch as stable-baselines3 sees it, against the single environment."""

import numpy as np
import pytest
from stable_baselines3 import SAC
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor, VecNormalize

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import GroovePose
from drake_disasm.learning.environment import DisassemblyEnv
from drake_disasm.learning.stable_baselines import DisassemblyVecEnv
from drake_disasm.scenario import Scenario, load_scenario

ACTION = np.array([8e-4, 0, 2e-4, 0, 1e-3, 0], np.float32)


def _scenario(steps: int = 3) -> Scenario:
    quiet = "ft_sensor.noise=[0, 0, 0, 0, 0, 0]"
    return load_scenario(
        "removal", [quiet, "contact.model=impact", f"task.steps={steps}"]
    )


def test_a_batch_runs_the_episodes_of_single_environments() -> None:
    """Against stable-baselines3's own vector of them, over the end of an episode."""
    batch = DisassemblyVecEnv(2, _scenario())
    single = DummyVecEnv([lambda: DisassemblyEnv(_scenario())] * 2)
    for envs in (batch, single):
        envs.seed(5)
    np.testing.assert_allclose(batch.reset(), single.reset(), atol=1e-5)
    for step in range(4):
        found, expected = (e.step(np.stack([ACTION, -ACTION])) for e in (batch, single))
        np.testing.assert_allclose(found[0][:, :6], expected[0][:, :6], atol=1e-6)
        np.testing.assert_allclose(found[0][:, 6:], expected[0][:, 6:], atol=0.02)
        np.testing.assert_allclose(found[1], expected[1], atol=5e-3)
        assert found[1].dtype == np.float32
        assert found[2].tolist() == expected[2].tolist() == [step == 2] * 2
        for info, known in zip(found[3], expected[3], strict=True):
            assert info.keys() - {"failure"} == known.keys()
            for name in ("outcome", "is_success", "TimeLimit.truncated"):
                assert info[name] == known[name]
            if step == 2:
                last, known_last = (i["terminal_observation"] for i in (info, known))
                np.testing.assert_allclose(last[:6], known_last[:6], atol=1e-6)
                assert info["reward_terms"].keys() == known["reward_terms"].keys()
    assert [info["outcome"] for info in batch.reset_infos] == ["running"] * 2


def test_sac_learns_on_it_with_the_usual_wrappers() -> None:
    envs = VecMonitor(DisassemblyVecEnv(4, _scenario()), info_keywords=("outcome",))
    normalised = VecNormalize(envs, norm_reward=False)
    options = {"learning_starts": 20, "batch_size": 16, "device": "cpu", "seed": 0}
    agent = SAC("MlpPolicy", normalised, policy_kwargs={"net_arch": [8]}, **options)
    agent.set_logger(Logger(None, []))  # its own makes a folder that stays
    agent.learn(200)
    assert len(agent.ep_info_buffer) == 200 // 4 // 3 * 4
    assert agent.ep_info_buffer[-1]["outcome"] == "step limit"
    # A jam or a limit ends an episode for good, its step limit does not.
    assert agent.replay_buffer.timeouts[:50].any(axis=1).sum() == 200 // 4 // 3
    mean, _ = evaluate_policy(agent, normalised, n_eval_episodes=4)
    assert np.isfinite(mean)


def test_options_hold_for_all_environments() -> None:
    envs = DisassemblyVecEnv(2, _scenario(9))
    envs.set_options({"effects": [GroovePose(ry=0.1)]})
    envs.reset()
    assert envs.envs.twin.scenarios[0].effects == [GroovePose(ry=0.1)]
    envs.set_options([{"effects": []}, {}])
    with pytest.raises(DisasmError, match=r"set_options.*one dictionary for all"):
        envs.reset()


def test_attributes_are_the_batch() -> None:
    envs = DisassemblyVecEnv(3)
    assert envs.get_attr("render_mode") == [None] * 3
    assert envs.get_attr("num_envs", [0, 2]) == [3, 3]
    assert envs.has_attr("twin") and not envs.has_attr("no_such_attribute")
    envs.set_attr("note", "x")
    assert envs.get_attr("note", 1) == ["x"]
    assert envs.env_is_wrapped(Monitor) == [False] * 3
    with pytest.raises(DisasmError, match="set_attr note"):
        envs.set_attr("note", "y", indices=0)
    with pytest.raises(DisasmError, match="env_method render"):
        envs.env_method("render")
    envs.close()


def test_seeds_repeat_and_hold_for_one_reset() -> None:
    envs = DisassemblyVecEnv(2, "removal_randomised")
    assert envs.seed(3) == [3, 4]
    first, second = envs.reset(), envs.reset()
    envs.seed(3)
    np.testing.assert_array_equal(envs.reset(), first)
    assert not np.array_equal(first, second)

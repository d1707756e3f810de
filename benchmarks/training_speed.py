"""How long whole trainings take: beside stable-baselines3's, and many side by side."""

import time
from typing import Any

from drake_disasm.learning.environment import DisassemblyEnv
from drake_disasm.learning.environments import make_environments
from drake_disasm.learning.hyperparameters import Hyperparameters, override, preset
from drake_disasm.learning.loop import TrainingLoop
from drake_disasm.learning.training import TrainingSpec, make_training
from drake_disasm.scenario import load_scenario

SEEDS = 64
_EPISODES = 150  # of chapter 4 on the twin
_FEW = 20  # of chapter 3, of each seed
_ON_DIAGRAMS = 2  # of the seeds are trained there; the others would take as long


def beside_sb3() -> tuple[float, float | None]:
    """Returns the time [s] of a training of chapter 4, ours and stable-baselines3's.

    DDPG with the thesis's numbers, 150 episodes on the diagram's twin, updates after
    each episode; the reference is None if it is not installed.
    """
    spec = _spec("chapter4", 0, preset("chapter4", "ddpg"))
    start = time.perf_counter()
    _run([spec])
    ours = time.perf_counter() - start
    try:
        return ours, _sb3(spec.config)
    except ImportError:
        return ours, None


def side_by_side() -> tuple[float, float]:
    """Returns the time [s] of 64 seeds of chapter 3 in lockstep, and one by one.

    Twenty episodes each, on one thread; one by one is on the diagram with hydroelastic
    contact, by two of them.
    """
    config = override(preset("chapter3", "ddpg"), [f"episodes={_FEW}"])
    _run([_spec("chapter3", SEEDS, override(config, ["episodes=2"]))])  # compiles
    start = time.perf_counter()
    for seed in range(_ON_DIAGRAMS):
        _run([_spec("chapter3", seed, config)])
    alone = (time.perf_counter() - start) * SEEDS / _ON_DIAGRAMS
    start = time.perf_counter()
    _run([_spec("chapter3", seed, config) for seed in range(SEEDS)])
    return time.perf_counter() - start, alone


def _spec(scenario: str, seed: int, config: Hyperparameters) -> TrainingSpec:
    return TrainingSpec(load_scenario(scenario), "twin", config, seed)


def _run(specs: list[TrainingSpec]) -> None:
    loop = TrainingLoop(make_environments(specs), [make_training(s) for s in specs])
    while loop.unfinished:
        loop.run_round()


def _sb3(config: Hyperparameters) -> float:
    """Returns the time of the same training with stable-baselines3's DDPG."""
    import numpy as np
    from stable_baselines3 import DDPG
    from stable_baselines3.common.callbacks import StopTrainingOnMaxEpisodes
    from stable_baselines3.common.noise import NormalActionNoise

    env, task = DisassemblyEnv("chapter4"), load_scenario("chapter4").task
    arguments: dict[str, Any] = {
        "net_arch": list(config.hidden),
        "optimizer_kwargs": {"eps": config.adam_epsilon},
    }
    sigma = np.full(6, config.exploration / task.max_translation)
    agent = DDPG(
        "MlpPolicy",
        env,
        learning_rate=config.actor_rate,
        buffer_size=config.replay,
        learning_starts=0,
        batch_size=config.batch,
        gamma=config.gamma,
        tau=config.tau,
        train_freq=(1, "episode"),
        gradient_steps=-1,
        action_noise=NormalActionNoise(np.zeros(6), sigma),
        device="cpu",
        seed=0,
        policy_kwargs=arguments,
    )
    stop = StopTrainingOnMaxEpisodes(_EPISODES)
    start = time.perf_counter()
    agent.learn(_EPISODES * task.steps, callback=stop)
    return time.perf_counter() - start

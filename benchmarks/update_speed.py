"""Gradient updates per second, ours and stable-baselines3's, in the same process."""

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

_TRANSITIONS = 5000
_REPEATS = 5
_SECONDS = 1.0  # that one repeat takes, about


def measure_updates(name: str) -> tuple[float, float | None]:
    """Returns DDPG updates per second of a preset, ours and stable-baselines3's.

    Both sample from a memory of 5000 transitions on one thread; the median of five
    repeats, taken in turns, so that whatever else the machine does hits both.

    Args:
        name: of the preset.

    Returns:
        Ours, and the reference's, or None if it is not installed.
    """
    import torch

    torch.set_num_threads(1)
    ours = _ours(name)
    try:
        theirs = _reference(name)
    except ImportError:
        theirs = None
    works = [work for work in (ours, theirs) if work]
    counts = [_count(work) for work in works]
    rates: list[list[float]] = [[] for _ in works]
    for _ in range(_REPEATS):
        for work, count, rate in zip(works, counts, rates, strict=True):
            rate.append(count / _seconds(work, count))
    medians = [statistics.median(rate) for rate in rates]
    return medians[0], medians[1] if theirs else None


def _ours(name: str) -> Callable[[int], None]:
    from drake_disasm.learning.actor_critic import ActorCritic
    from drake_disasm.learning.hyperparameters import preset
    from drake_disasm.learning.replay import WIDTH, Replay

    config = preset(name, "ddpg")
    agent, replay = ActorCritic(config, seed=0), Replay(_TRANSITIONS)
    generator = np.random.default_rng(0)
    rows = generator.standard_normal((_TRANSITIONS, WIDTH)).astype(np.float32)
    rows[:, -2:] = 0.0, 1.0
    replay.restore(rows, 0)

    def work(count: int) -> None:
        """Does so many updates."""
        for _ in range(count):
            agent.learn(replay.sample(config.batch, generator), generator)

    return work


def _reference(name: str) -> Callable[[int], None]:
    from stable_baselines3 import DDPG

    from drake_disasm.learning.environment import DisassemblyEnv
    from drake_disasm.learning.hyperparameters import preset

    config = preset(name, "ddpg")
    env = DisassemblyEnv("chapter3")
    arguments: dict[str, Any] = {
        "net_arch": list(config.hidden),
        "optimizer_kwargs": {"eps": config.adam_epsilon},
    }
    agent = DDPG(
        "MlpPolicy",
        env,
        learning_rate=config.actor_rate,
        buffer_size=_TRANSITIONS,
        batch_size=config.batch,
        gamma=config.gamma,
        tau=config.tau,
        device="cpu",
        policy_kwargs=arguments,
    )
    agent._setup_learn(1)
    generator = np.random.default_rng(0)
    for _ in range(_TRANSITIONS):
        agent.replay_buffer.add(  # type: ignore[union-attr]
            generator.standard_normal((1, 12)),
            generator.standard_normal((1, 12)),
            generator.uniform(-1, 1, (1, 6)),
            np.zeros(1),
            np.zeros(1),
            [{}],
        )
    return lambda count: agent.train(count, config.batch)


def _count(work: Callable[[int], None]) -> int:
    """Returns how many updates take about a second, after warming up."""
    work(5)
    return max(5, int(5 * _SECONDS / _seconds(work, 5)))


def _seconds(work: Callable[[int], None], count: int) -> float:
    start = time.perf_counter()
    work(count)
    return time.perf_counter() - start

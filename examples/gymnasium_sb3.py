"""The task as a Gymnasium environment, with an agent of stable-baselines3.

    pip install stable-baselines3
    python examples/gymnasium_sb3.py [STEPS]

SAC with its defaults, and how long its episodes last (20000 steps: docs/learning.md).
Wrappers scale m, rad, N and N m for a network; `tools/train.py` has our own agents.
"""

import sys
from collections import Counter
from collections.abc import Callable

import gymnasium
import numpy as np
from stable_baselines3 import SAC

#: The part before the colon is imported, and registers the environments.
ENVIRONMENT = "drake_disasm.learning.environment:drake_disasm/Removal-v0"
SCALE = np.array([0.01] * 3 + [0.1] * 3 + [5.0] * 3 + [0.5] * 3)  # m, rad, N, N m


def make_environment(station: str) -> gymnasium.Env:
    """Returns the default task, scaled to about [-1, 1]."""
    env = gymnasium.make(ENVIRONMENT, station=station)
    env = gymnasium.wrappers.RescaleAction(env, np.float32(-1), np.float32(1))
    return gymnasium.wrappers.TransformObservation(
        env, lambda s: (s / SCALE).astype(np.float32), env.observation_space
    )


def episodes_every(steps: int) -> Callable[[dict, dict], bool]:
    """Returns a callback that prints how long episodes last, and how they end."""
    ended: list[tuple[int, float, str]] = []

    def after_step(local: dict, _: dict) -> bool:
        """Takes note of an episode that has ended; prints once in a while."""
        info, done = local["infos"][0], local["self"].num_timesteps
        if "episode" in info:  # by the Monitor that stable-baselines3 puts around
            ended.append((*map(info["episode"].get, "lr"), info["outcome"]))
        if done % steps == 0:
            print(
                f"{done:6d} steps: {len(ended)} episodes", Counter(e[2] for e in ended)
            )
            print("  lengths:", sorted(episode[0] for episode in ended))
            print("  rewards:", [round(episode[1], 1) for episode in ended])
            ended.clear()
        return True

    return after_step


def main(steps: int = 20) -> None:
    """Trains for a number of steps on the twin, then plays one episode."""
    env = make_environment("twin")
    agent = SAC("MlpPolicy", env, seed=0, device="cpu")
    agent.learn(steps, callback=episodes_every(min(steps, 2000)))
    observation, info = env.reset(seed=0)
    total = 0.0
    while info["outcome"] == "running":
        action, _ = agent.predict(observation, deterministic=True)
        observation, reward, _, _, info = env.step(action)
        total += float(reward)
    print(f"trained for {steps} steps; then one episode without noise:")
    print(f"reward {total:.2f}, outcome: {info['outcome']}", info["reward_terms"])


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))

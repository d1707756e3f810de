"""The task as a Gymnasium environment, with an agent of stable-baselines3.

    pip install stable-baselines3
    python examples/gymnasium_sb3.py [STEPS]

SAC with its defaults, and how long its episodes last. The environment is in m, rad, N
and N m; wrappers of Gymnasium scale it for a network. The default number of steps only
shows that all fits together; 20000 are in docs/learning.md. `tools/train.py` trains
the agents of this project, which resume.
"""

import sys

import gymnasium
import numpy as np
from stable_baselines3 import SAC
from stable_baselines3.common.callbacks import BaseCallback

#: The part before the colon is imported, and registers the environments.
ENVIRONMENT = "drake_disasm.learning.environment:drake_disasm/Removal-v0"
SCALE = np.array([0.01] * 3 + [0.1] * 3 + [5.0] * 3 + [0.5] * 3)  # m, rad, N, N m


def make_environment(station: str) -> gymnasium.Env:
    """Returns the default task, scaled to about [-1, 1]."""
    env = gymnasium.make(ENVIRONMENT, station=station)
    one = np.ones(6, np.float32)
    env = gymnasium.wrappers.RescaleAction(env, -one, one)
    return gymnasium.wrappers.TransformObservation(
        env, lambda s: (s / SCALE).astype(np.float32), env.observation_space
    )


class Episodes(BaseCallback):
    """Prints how long episodes last, and how they end.

    Args:
        every: steps of training between two lines.
    """

    def __init__(self, every: int) -> None:
        super().__init__()
        self._every = every
        self._ended: list[tuple[int, float, str]] = []
        self._steps, self._reward = 0, 0.0

    def _on_step(self) -> bool:
        self._steps, self._reward = (
            self._steps + 1,
            self._reward + self.locals["rewards"][0],
        )
        if self.locals["dones"][0]:
            outcome = self.locals["infos"][0]["outcome"]
            self._ended.append((self._steps, self._reward, outcome))
            self._steps, self._reward = 0, 0.0
        if self.num_timesteps % self._every == 0:
            self._print()
        return True

    def _print(self) -> None:
        if not self._ended:
            print(f"{self.num_timesteps:6d} steps: no episode has ended", flush=True)
            return
        lengths, rewards, outcomes = zip(*self._ended, strict=True)
        ends = {name: outcomes.count(name) for name in sorted(set(outcomes))}
        print(
            f"{self.num_timesteps:6d} steps: {len(lengths)} episodes of "
            f"{min(lengths)} to {max(lengths)} steps, median {np.median(lengths):.0f}; "
            f"reward {np.mean(rewards):.1f}; {ends}",
            flush=True,
        )
        self._ended.clear()


def main(steps: int = 20) -> None:
    """Trains for a number of steps on the twin, then plays one episode."""
    env = make_environment("twin")
    agent = SAC("MlpPolicy", env, seed=0, device="cpu")
    agent.learn(steps, callback=Episodes(every=min(steps, 2000)))
    observation, info = env.reset(seed=0)
    rewards = []
    while len(rewards) < steps and info["outcome"] == "running":
        action, _ = agent.predict(observation, deterministic=True)
        observation, reward, _, _, info = env.step(action)
        rewards.append(float(reward))
    print(f"trained for {steps} steps; then {len(rewards)} steps without noise:")
    print(f"reward {sum(rewards):.2f}, outcome: {info['outcome']}")
    for name, value in info["reward_terms"].items():
        print(f"  {name:10} {value:7.3f} in the last step")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))

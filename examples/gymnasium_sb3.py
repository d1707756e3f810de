"""SAC of stable-baselines3 on a batch of twins, then one episode of its policy.

    pip install stable-baselines3
    python examples/gymnasium_sb3.py [STEPS [ENVIRONMENTS [UPDATES]]]

UPDATES are gradient steps after each step of the batch; -1 makes one for each
transition, as with a single environment. The program prints the steps per second.
"""

import sys
import time
from collections import Counter, deque

import gymnasium
from stable_baselines3 import SAC
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from drake_disasm.learning.stable_baselines import DisassemblyVecEnv


class Episodes:
    """A callback that prints how the newest episodes ended, every `period` steps."""

    def __init__(self, period: int) -> None:
        self._period = self._next = period
        self._newest: deque[dict] = deque(maxlen=50)

    def __call__(self, local: dict, _: dict) -> bool:
        """Takes note of episodes that have ended; training goes on."""
        self._newest += [i["episode"] for i in local["infos"] if "episode" in i]
        steps = local["self"].num_timesteps
        if steps >= self._next and self._newest:
            self._next += self._period
            outcomes = Counter(episode["outcome"] for episode in self._newest)
            reward = sum(e["r"] for e in self._newest) / len(self._newest)
            print(f"{steps:6d} steps: reward {reward:6.1f}", dict(outcomes), flush=True)
        return True


def main(steps: int = 200, environments: int = 16, updates: int = 1) -> None:
    """Trains for a number of steps on the twin, then plays one episode on it."""
    batch = DisassemblyVecEnv(environments, "removal")
    monitored = VecMonitor(batch, info_keywords=("outcome",))
    envs = VecNormalize(monitored, norm_reward=False)  # m, rad, N and N m to about 1
    agent = SAC("MlpPolicy", envs, gradient_steps=updates, seed=0, device="cpu")
    wall, processor = time.perf_counter(), time.process_time()
    agent.learn(steps, callback=Episodes(max(1, steps // 10)))
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    print(f"{steps} steps in {wall:.0f} s: {steps / wall:.0f} steps/s "
          f"({processor:.0f} s of processor time)")  # fmt: skip
    play(agent, envs)


def play(agent: SAC, envs: VecNormalize) -> None:
    """Plays one episode without noise on the single environment."""
    env = gymnasium.make("drake_disasm/Removal-v0", station="twin")
    observation, info = env.reset(seed=0)
    total = 0.0
    while info["outcome"] == "running":
        action, _ = agent.predict(envs.normalize_obs(observation), deterministic=True)
        observation, reward, _, _, info = env.step(action)
        total += float(reward)
    print(f"one episode: reward {total:.2f}, outcome: {info['outcome']}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:4]))

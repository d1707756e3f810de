"""An environment of your own, in the training loop.

    python examples/own_environment.py [EPISODES]

Any vector environment of gymnasium can be trained in, whose spaces are boxes: here a
peg that is pushed over a rough table to a mark. DDPG learns it from eight at a time.
"""

import sys
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from drake_disasm.learning.actor_critic import ActorCritic
from drake_disasm.learning.environments import GymnasiumRows
from drake_disasm.learning.hyperparameters import Hyperparameters
from drake_disasm.learning.loop import TrainingLoop
from drake_disasm.learning.training import Training
from drake_disasm.policies import TaskView

MASS, FRICTION, PERIOD, STEPS = 0.5, 1.0, 0.05, 20  # kg, N, s


class PegOnATable(VectorEnv):
    """Observation: distance to the mark and velocity [m, m/s]; action: force [N]."""

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(self, num_envs: int) -> None:
        self.num_envs = num_envs
        self.single_observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2,))
        self.single_action_space = gymnasium.spaces.Box(-4.0, 4.0, (1,))
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(self, *, seed: Any = None, options: Any = None) -> tuple[Any, dict]:
        """Lays the pegs down somewhere, each by its own seed."""
        start = [np.random.default_rng(one).uniform(-0.3, 0.3) for one in seed]
        self.x, self.v, self.steps = np.array(start), np.zeros(self.num_envs), 0
        return self._observation(), {}

    def step(self, actions: np.ndarray) -> tuple[Any, Any, Any, Any, dict]:
        """Pushes for one period."""
        pushed = self.v + PERIOD / MASS * actions[:, 0]
        held = PERIOD / MASS * FRICTION
        self.v = np.sign(pushed) * np.maximum(np.abs(pushed) - held, 0.0)
        self.x = self.x + PERIOD * self.v
        self.steps += 1
        none = np.zeros(self.num_envs, bool)
        reward = -np.abs(self.x) - 0.01 * np.abs(self.v)
        return self._observation(), reward, none, none | (self.steps >= STEPS), {}

    def _observation(self) -> np.ndarray:
        return np.stack([self.x, self.v], axis=1).astype(np.float32)


def main(episodes: int = 120) -> None:
    """Trains, and prints the reward of the first and the last round."""
    rows = GymnasiumRows(PegOnATable(8))
    config = Hyperparameters(
        episodes=episodes, batch=64, tau=0.05, gamma=0.95, exploration=0.1
    )
    states, actions = rows.sizes
    agent = ActorCritic(config, 0, compiled=False, states=states, actions=actions)
    view = TaskView(np.array([0.2, 1.0]), np.ones(actions))  # m, m/s
    training = Training(agent, config, seed=0, view=view, sizes=rows.sizes)
    loop = TrainingLoop(rows, [training])
    while loop.unfinished:
        loop.run_round()
    for name, some in (("first", slice(8)), ("last", slice(-8, None))):
        rewards = [summary.reward for summary in training.summaries[some]]
        print(f"{name:5} eight episodes: mean reward {np.mean(rewards):6.2f}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))

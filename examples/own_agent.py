"""An agent of your own, in the training loop, with checkpoints.

    python examples/own_agent.py [EPISODES]

An agent explores, learns from batches of transitions, and hands out its state as
arrays. This one has torch's own modules and optimisers: a critic for the next step's
reward alone, and an actor that climbs it. It acts in four twins at a time.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
import torch
from torch.nn import Linear, ReLU, Sequential

from drake_disasm.learning.environments import make_environments
from drake_disasm.learning.hyperparameters import Hyperparameters
from drake_disasm.learning.replay import split
from drake_disasm.learning.run import run_trainings
from drake_disasm.learning.training import Training, TrainingSpec, task_view
from drake_disasm.scenario import load_scenario


class MyopicAgent:
    """Does what pays at once."""

    def __init__(self) -> None:
        torch.manual_seed(0)
        self.updates = 0
        self.actor = Sequential(Linear(12, 32), ReLU(), Linear(32, 6), torch.nn.Tanh())
        self.critic = Sequential(Linear(18, 32), ReLU(), Linear(32, 1))
        nets = torch.nn.ModuleList([self.actor, self.critic])
        self.state = nets.state_dict()  # shares the networks' memory
        self.optimisers = [torch.optim.Adam(net.parameters(), 3e-3) for net in nets]

    def explore(self, observation, noise, sigma):
        """Returns actions (n, 6) for scaled observations (n, 12)."""
        with torch.no_grad():
            action = self.actor(torch.from_numpy(observation)).numpy()
        return np.clip(action + sigma * noise, -1.0, 1.0)

    def learn(self, rows, generator):
        """Fits the critic, then climbs it."""
        self.updates += 1
        batch = split(torch.from_numpy(rows))
        worth = self.critic(torch.cat([batch.observation, batch.action], 1))[:, 0]
        self._descend(self.optimisers[1], (worth - batch.reward).square().mean())
        action = self.actor(batch.observation)
        value = self.critic(torch.cat([batch.observation, action], 1)).mean()
        self._descend(self.optimisers[0], -value)

    def _descend(self, optimiser, loss):
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()

    def arrays(self):
        """Returns the networks; Adam's moments begin anew."""
        return {name: tensor.numpy() for name, tensor in self.state.items()}

    def restore(self, arrays):
        """Restores them."""
        for name, tensor in self.state.items():
            tensor.copy_(torch.from_numpy(arrays[name]))


def main(episodes: int = 24) -> None:
    """Trains to the half, goes on from the checkpoint, and prints rewards."""
    scenario = load_scenario("removal", ["contact.model=impact", "task.steps=30"])
    print("episodes  updates  mean reward of the latest 4")
    with tempfile.TemporaryDirectory() as folder:
        for end in (episodes // 2, episodes):
            config = Hyperparameters(episodes=end, batch=64, exploration=0.0005)
            spec = TrainingSpec(scenario, "twin", config, seed=0, envs=4)
            training = Training(
                MyopicAgent(),
                config,
                seed=0,
                view=task_view(scenario, config),
                exploration_unit=scenario.task.max_translation,
            )
            run_trainings(
                [training], lambda s=spec: make_environments([s]), [Path(folder)]
            )
            latest = np.mean([summary.reward for summary in training.summaries[-4:]])
            print(f"{end:8d} {training.agent.updates:8d} {latest:8.2f}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))

"""The task as a Gymnasium environment, with an agent of stable-baselines3.

    pip install stable-baselines3
    python examples/gymnasium_sb3.py [STEPS]

Observations are in m, rad, N and N m; wrappers of Gymnasium scale them for a network.
Some thousand steps teach an agent to slide the bolt; the default only shows that all
fits together. `tools/train.py` trains the agents of this project, which resume.
"""

import sys

import gymnasium
import numpy as np
from stable_baselines3 import TD3

#: The part before the colon is imported, and registers the environments.
ENVIRONMENT = "drake_disasm.learning.environment:drake_disasm/Sliding-v0"
SCALE = np.array([0.01] * 3 + [0.1] * 3 + [10.0] * 3 + [0.5] * 3)  # m, rad, N, N m


def make_environment(station: str) -> gymnasium.Env:
    """Returns the sliding task, scaled to about [-1, 1]."""
    env = gymnasium.make(ENVIRONMENT, station=station)
    one = np.ones(6, np.float32)
    env = gymnasium.wrappers.RescaleAction(env, -one, one)
    return gymnasium.wrappers.TransformObservation(
        env, lambda s: (s / SCALE).astype(np.float32), env.observation_space
    )


def main(steps: int = 20) -> None:
    """Trains for a number of steps on the twin, then plays one episode."""
    env = make_environment("twin")
    agent = TD3("MlpPolicy", env, learning_starts=10, batch_size=16, seed=0)
    agent.learn(steps)
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

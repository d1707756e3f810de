"""Each gradient update, held against stable-baselines3's on the same batch."""

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import torch
from stable_baselines3 import DDPG, SAC, TD3
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.type_aliases import ReplayBufferSamples
from torch.utils._pytree import tree_leaves

from drake_disasm.learning.actor_critic import ActorCritic
from drake_disasm.learning.agent_state import AgentState
from drake_disasm.learning.environment import DisassemblyEnv
from drake_disasm.learning.hyperparameters import Hyperparameters, preset
from drake_disasm.learning.replay import WIDTH, split

_REFERENCES = {"ddpg": DDPG, "td3": TD3, "sac": SAC}
_UPDATES = 6


@pytest.fixture(scope="module")
def env() -> DisassemblyEnv:
    return DisassemblyEnv("chapter3")


def _batches(count: int, size: int = 20) -> Iterator[np.ndarray]:
    generator = np.random.default_rng(3)
    for _ in range(count):
        rows = generator.standard_normal((size, WIDTH)).astype(np.float32)
        rows[:, 12:18] = np.tanh(rows[:, 12:18])
        rows[:, 31] = generator.random(size) < 0.2
        rows[:, 32] = 1.0
        yield rows


class _Fed:
    """A replay buffer of the reference's that gives out the prescribed batches."""

    def __init__(self, batches: list[np.ndarray]) -> None:
        self._batches = iter(batches)

    def sample(self, size: int, env: Any = None) -> ReplayBufferSamples:
        b = split(torch.from_numpy(next(self._batches)))
        column = lambda x: x[:, None]  # noqa: E731
        states = (b.observation, b.action, b.next_observation)
        return ReplayBufferSamples(*states, column(b.terminated), column(b.reward))


def _reference(algorithm: str, config: Hyperparameters, env: DisassemblyEnv) -> Any:
    policy: dict[str, Any] = {"net_arch": list(config.hidden)}
    policy["optimizer_kwargs"] = {"eps": config.adam_epsilon}
    arguments: dict[str, Any] = {
        "learning_rate": config.actor_rate, "gamma": config.gamma, "tau": config.tau,
        "batch_size": config.batch, "learning_starts": 0, "device": "cpu",
        "policy_kwargs": policy,
    }  # fmt: skip
    if algorithm == "sac":
        arguments["ent_coef"] = (
            f"auto_{config.entropy}" if config.adapt_entropy else config.entropy
        )
    if algorithm == "td3":
        arguments |= {
            "policy_delay": config.policy_delay,
            "target_policy_noise": config.target_noise,
            "target_noise_clip": config.target_noise_limit,
        }
    return _REFERENCES[algorithm]("MlpPolicy", env, **arguments)


def _linear(layers: Any) -> list[Any]:
    return [m for m in layers if isinstance(m, torch.nn.Linear)]


def _actor_modules(actor: Any) -> list[Any]:
    if isinstance(actor.mu, torch.nn.Sequential):
        return _linear(actor.mu)
    return [*_linear(actor.latent_pi), actor.mu, actor.log_std]


def _pairs(reference: Any, state: AgentState) -> Iterator[tuple[Any, Any]]:
    """Yields each tensor of the reference's networks with the agent's."""
    actor = state.actor
    if isinstance(reference, SAC):  # the agent has mean and deviation in one layer
        heads = {k: v.chunk(2) for k, v in actor[-1].items()}
        actor = (*actor[:-1], *({k: v[i] for k, v in heads.items()} for i in (0, 1)))
    networks = [(_actor_modules(reference.actor), actor)]
    if not isinstance(reference, SAC):
        target = _actor_modules(reference.actor_target)
        networks.append((target, state.target_actor))
    for critic, own in (
        (reference.critic, state.critics),
        (reference.critic_target, state.target_critics),
    ):
        nets = zip(critic.q_networks, own, strict=True)
        networks += [(_linear(net), layers) for net, layers in nets]
    for modules, layers in networks:
        for module, layer in zip(modules, layers, strict=True):
            for name in ("weight", "bias"):
                yield getattr(module, name).data, layer[name]


def _share_noise(agent: ActorCritic, monkeypatch: pytest.MonkeyPatch) -> None:
    """Makes agent and reference use the same noise, wherever each draws it."""
    noise = torch.from_numpy(np.random.default_rng(5).standard_normal((20, 12))).float()
    now, then = noise[:, :6], noise[:, 6:]
    calls = iter(range(10**6))  # SAC asks for the states, then for the next states
    monkeypatch.setattr(
        torch.distributions.Normal,
        "rsample",
        lambda self, shape=None: self.loc + self.scale * (now, then)[next(calls) % 2],
    )
    monkeypatch.setattr(
        torch.Tensor,
        "normal_",
        lambda self, mean=0.0, std=1.0: self.copy_(mean + std * now),
    )
    given = noise if agent.config.algorithm == "sac" else now
    monkeypatch.setattr(agent, "_noise", lambda *_: given)


def _train_reference(reference: Any, batches: list[np.ndarray]) -> None:
    reference.replay_buffer = _Fed(batches)
    reference.set_logger(Logger(None, []))  # its own makes a folder that stays
    reference._setup_learn(1)
    reference.train(len(batches), reference.batch_size)


@pytest.mark.parametrize(("algorithm", "changes"), [
    ("ddpg", {}),
    ("td3", {"target_noise": 0.3, "target_noise_limit": 0.2}),
    ("sac", {}),
    ("sac", {"adapt_entropy": True}),
])  # fmt: skip
def test_updates_are_those_of_stable_baselines3(algorithm, changes, env, monkeypatch):
    config = dataclasses.replace(
        preset("chapter3", algorithm), tau=0.3, batch=20, **changes
    )
    agent = ActorCritic(config, seed=1, compiled=False)
    reference = _reference(algorithm, config, env)
    for theirs, own in _pairs(reference, agent.state):
        theirs.copy_(own)
    _share_noise(agent, monkeypatch)
    batches = list(_batches(_UPDATES))
    for rows in batches:
        agent.learn(rows, np.random.default_rng(0))
    _train_reference(reference, batches)
    for theirs, own in _pairs(reference, agent.state):
        torch.testing.assert_close(theirs, own, rtol=1e-4, atol=2e-6)
    if config.adapt_entropy:
        assert float(agent.state.log_entropy) == pytest.approx(
            float(reference.log_ent_coef), abs=1e-6
        )


@pytest.mark.slow  # compiling takes ten seconds each
@pytest.mark.parametrize("algorithm", ["ddpg", "td3", "sac"])
def test_a_compiled_update_is_the_same_law(algorithm: str) -> None:
    config = dataclasses.replace(
        preset("chapter3", algorithm), layer_norm=True, hidden=[16], critics=2
    )
    agents = [ActorCritic(config, seed=1, compiled=c) for c in (False, True)]
    for rows in _batches(4):
        for agent in agents:
            agent.learn(rows, np.random.default_rng(7))
    leaves = [torch.utils._pytree.tree_leaves(agent.state) for agent in agents]
    for eager, compiled in zip(*leaves, strict=True):
        torch.testing.assert_close(eager, compiled, rtol=1e-3, atol=1e-5)


def test_termination_cuts_the_bootstrap_and_nothing_else_does() -> None:
    """With a discount of 1 and targets that differ, only `terminated` matters."""
    config = dataclasses.replace(preset("chapter3"), batch=20)
    rows = next(iter(_batches(1)))
    other = rows.copy()
    other[:, 19:31] += 5.0  # other next states
    for terminated, equal in ((1.0, True), (0.0, False)):
        rows[:, 31] = other[:, 31] = terminated
        critics = []
        for batch in (rows, other):
            agent = ActorCritic(config, seed=1, compiled=False)
            agent.learn(batch, np.random.default_rng(0))
            critics.append(agent.state.critics[0][0]["weight"])
        assert torch.equal(*critics) is equal


@pytest.mark.parametrize("algorithm", ["ddpg", "sac"])
def test_merged_draws_give_the_gradient_of_the_repeated_ones(algorithm: str) -> None:
    """Each row twice, or once with twice the weight, beside one that counts once."""
    config = dataclasses.replace(preset("chapter3", algorithm), batch=20)
    merged = next(iter(_batches(1)))
    merged[:-1, -1] = 2.0
    repeated = np.concatenate([merged, merged[:-1]])
    repeated[:, -1] = 1.0
    agents = []
    for rows in (merged, repeated):
        agent = ActorCritic(config, seed=1, compiled=False)
        agent._noise = lambda count, _: torch.zeros(count, 12 if agent._soft else 6)  # type: ignore[method-assign]  # noqa: B023
        agent.learn(rows, np.random.default_rng(0))
        agents.append(torch.utils._pytree.tree_leaves(agent.state))
    for one, other in zip(*agents, strict=True):
        torch.testing.assert_close(one, other, rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("algorithm", ["ddpg", "td3", "sac"])
def test_no_two_tensors_of_a_state_are_one(algorithm: str) -> None:
    """Fresh or later: torch compiles one graph, and can tell agents apart."""
    agent = ActorCritic(preset("chapter3", algorithm), 0, compiled=False)
    generator = np.random.default_rng(0)
    for rows in _batches(2):
        tensors = [t for t in tree_leaves(agent.state) if isinstance(t, torch.Tensor)]
        assert len({t.data_ptr() for t in tensors}) == len(tensors)
        agent.learn(rows, generator)

"""DDPG, TD3 and SAC: their networks, how they explore, and their updates."""

import functools
import os
import shutil
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.utils._pytree import tree_flatten, tree_map, tree_unflatten

from drake_disasm.common.arrays import Array, namespace
from drake_disasm.learning.agent_state import AgentState, make_state
from drake_disasm.learning.hyperparameters import Hyperparameters
from drake_disasm.learning.networks import Layers, evaluate
from drake_disasm.learning.random_numbers import Random
from drake_disasm.learning.replay import ACTIONS, STATES
from drake_disasm.learning.updates import (
    LOG_SIGMA,
    update_deterministic,
    update_soft,
)
from drake_disasm.policies import Network

_Update = Callable[[AgentState, Tensor, Tensor], tuple[AgentState, Tensor]]
#: Small networks spend most time between kernels; this saves it, with equal results.
_OPTIONS: dict[str, str | int | bool | Callable[..., Any]] = {
    "cpp_wrapper": True,
    "size_asserts": False,
}
#: Compiled updates by everything that they depend on; tracing one takes seconds.
_COMPILED: dict[tuple[str, bool, str], _Update] = {}


def can_compile() -> bool:
    """Returns whether there is a C++ compiler, which torch.compile needs."""
    return shutil.which(os.environ.get("CXX", "g++")) is not None


class ActorCritic:
    """DDPG, TD3 or SAC, by its hyper-parameters.

    Attributes:
        state: parameters of the networks, targets, and the optimiser's moments.
        updates: gradient updates done.
        compiled: whether updates run compiled; results differ by rounding.

    Args:
        config: hyper-parameters.
        seed: of the initial parameters.
        compiled: whether to compile, where there is a compiler.
        states, actions: how many numbers it observes and chooses.
        device: where it computes, "numpy" or one of torch's.
    """

    def __init__(
        self,
        config: Hyperparameters,
        seed: int,
        compiled: bool = True,
        states: int = STATES,
        actions: int = ACTIONS,
        device: str = "numpy",
    ) -> None:
        self.config = config
        self._device = "cpu" if device == "numpy" else device
        state = make_state(config, seed, states, actions)
        self.state: AgentState = tree_map(lambda x: x.to(self._device), state)
        self.updates = 0
        self.compiled = compiled and can_compile()
        if compiled and not self.compiled:
            warnings.warn(
                "no C++ compiler (g++, or what CXX names): updates run uncompiled, "
                "up to five times slower",
                stacklevel=2,
            )
        self._soft, self._actions = config.algorithm == "sac", actions
        self._noise_width = 2 * actions if self._soft else actions
        self._calm = not self._soft and config.target_noise == 0.0
        shape = config.batch, self._noise_width
        self._no_noise = torch.zeros(shape, device=self._device)
        self._network: Network | None = None
        self._updates = {
            with_actor: _update(config, with_actor, self.compiled, self._device)
            for with_actor in (False, True)
        }

    def network(self) -> Network:
        """Returns a copy of the actor that runs in NumPy: (s,) to (a,), before tanh.

        SAC's gives (2 a,): means, then log sigmas.
        """
        if self._network is None:
            self._network = as_network(self.state.actor)
        return self._network

    def explore(self, observation: Array, noise: Array, sigma: Array) -> Array:
        """Returns exploring actions (n, a), see `Agent`; SAC has its own sigma.

        Tensors go through the network all together, rows of NumPy one by one: so an
        episode is the same bits whatever runs with it.
        """
        xp = namespace(observation)
        if isinstance(observation, Tensor):
            output: Array = evaluate(self.state.actor, observation)
        else:
            output = np.stack([self.network()(row) for row in observation])
        if self._soft:
            log_sigma = xp.clip(output[:, self._actions :], *LOG_SIGMA)
            return xp.tanh(output[:, : self._actions] + xp.exp(log_sigma) * noise)
        return xp.clip(xp.tanh(output) + sigma * noise, -1.0, 1.0)

    def learn(self, rows: Array, generator: Random) -> None:
        """Does one gradient update on transitions."""
        self.updates += 1
        with_actor = self.updates % self.config.policy_delay == 0
        batch, noise = torch.as_tensor(rows), self._noise(len(rows), generator)
        if len(rows) != self.config.batch:  # merged draws: their number varies
            for tensor in (batch, noise):
                torch._dynamo.mark_dynamic(tensor, 0)
        with torch.no_grad():
            self.state, _ = self._updates[with_actor](self.state, batch, noise)
        self._network = None

    def _noise(self, count: int, generator: Random) -> Tensor:
        if self._calm:
            return self._no_noise[:count]
        shape = (count, self._noise_width)
        return torch.as_tensor(generator.standard_normal(shape, dtype=np.float32))

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns the leaves of the state."""
        leaves, _ = tree_flatten(self.state)
        return {
            f"state_{i:03d}": leaf.numpy(force=True) for i, leaf in enumerate(leaves)
        }

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Restores the result of `arrays`."""
        leaves, structure = tree_flatten(self.state)
        names = [f"state_{i:03d}" for i in range(len(leaves))]
        restored = [torch.from_numpy(arrays[name]).to(self._device) for name in names]
        self.state = tree_unflatten(restored, structure)
        self._network = None


def as_network(actor: Layers) -> Network:
    """Returns layers as a network that runs in NumPy."""
    return Network(
        tuple(layer["weight"].numpy(force=True).copy() for layer in actor),
        tuple(layer["bias"].numpy(force=True).copy() for layer in actor),
    )


def _update(
    config: Hyperparameters, with_actor: bool, compiled: bool, device: str
) -> _Update:
    law = update_soft if config.algorithm == "sac" else update_deterministic
    plain = functools.partial(law, config=config, with_actor=with_actor)
    if not compiled:
        return plain
    key = (repr(config), with_actor, device)
    if key not in _COMPILED:
        # One graph per agent is intended; torch suspects a fault from the eighth on.
        torch._dynamo.config.recompile_limit = max(64, 2 * len(_COMPILED))
        options = _OPTIONS if device == "cpu" else None
        _COMPILED[key] = torch.compile(plain, fullgraph=True, options=options)
    return _COMPILED[key]

"""An agent: its networks, how it explores, and its updates."""

import functools
import os
import shutil
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from torch import Tensor

from drake_disasm.learning.agent_state import AgentState, make_state
from drake_disasm.learning.hyperparameters import Hyperparameters
from drake_disasm.learning.networks import Layers
from drake_disasm.learning.updates import (
    LOG_SIGMA,
    update_deterministic,
    update_soft,
)
from drake_disasm.mdp import ACTION_NAMES
from drake_disasm.policies import Network

_ACTIONS = len(ACTION_NAMES)
_Update = Callable[[AgentState, Tensor, Tensor], tuple[AgentState, Tensor]]
#: Small networks spend most time between kernels; this saves it, with equal results.
_OPTIONS: dict[str, str | int | bool | Callable[..., Any]] = {
    "cpp_wrapper": True,
    "size_asserts": False,
}
#: Compiled updates by everything that they depend on; tracing one takes seconds.
_COMPILED: dict[tuple[str, bool], _Update] = {}


def can_compile() -> bool:
    """Returns whether there is a C++ compiler, which torch.compile needs."""
    return shutil.which(os.environ.get("CXX", "g++")) is not None


class Agent:
    """DDPG, TD3 or SAC, by its hyper-parameters.

    Attributes:
        state: parameters of the networks, targets, and the optimiser's moments.
        updates: gradient updates done.
        compiled: whether updates run compiled; results differ by rounding.

    Args:
        config: hyper-parameters.
        seed: of the initial parameters.
        compiled: whether to compile, where there is a compiler.
    """

    def __init__(
        self, config: Hyperparameters, seed: int, compiled: bool = True
    ) -> None:
        self.config = config
        self.state = make_state(config, seed)
        self.updates = 0
        self.compiled = compiled and can_compile()
        if compiled and not self.compiled:
            warnings.warn(
                "no C++ compiler (g++, or what CXX names): updates run uncompiled, "
                "up to five times slower",
                stacklevel=2,
            )
        self._soft = config.algorithm == "sac"
        self._noise_width = 2 * _ACTIONS if self._soft else _ACTIONS
        self._calm = not self._soft and config.target_noise == 0.0
        self._no_noise = torch.zeros(config.batch, self._noise_width)
        self._updates = {
            with_actor: _update(config, with_actor, self.compiled)
            for with_actor in (False, True)
        }

    def network(self) -> Network:
        """Returns a copy of the actor that runs in NumPy: (12,) to (6,), before tanh.

        SAC's gives (12,): means, then log sigmas.
        """
        return as_network(self.state.actor)

    def explore(
        self,
        output: np.ndarray,
        sigma: float,
        generator: np.random.Generator,
    ) -> np.ndarray:
        """Returns an exploring action (6,) in [-1, 1].

        Args:
            output: of the network.
            sigma: standard deviation of the noise on it; SAC has its own.
            generator: source of the noise.
        """
        noise = generator.standard_normal(_ACTIONS, dtype=np.float32)
        if self._soft:
            log_sigma = np.clip(output[_ACTIONS:], *LOG_SIGMA)
            return np.tanh(output[:_ACTIONS] + np.exp(log_sigma) * noise)
        return np.clip(np.tanh(output) + np.float32(sigma) * noise, -1.0, 1.0)

    def learn(self, rows: np.ndarray, generator: np.random.Generator) -> None:
        """Does one gradient update on transitions (n, WIDTH)."""
        self.updates += 1
        with_actor = self.updates % self.config.policy_delay == 0
        batch, noise = torch.from_numpy(rows), self._noise(len(rows), generator)
        if len(rows) != self.config.batch:  # merged draws: their number varies
            for tensor in (batch, noise):
                torch._dynamo.mark_dynamic(tensor, 0)
        with torch.no_grad():
            self.state, _ = self._updates[with_actor](self.state, batch, noise)

    def _noise(self, count: int, generator: np.random.Generator) -> Tensor:
        if self._calm:
            return self._no_noise[:count]
        shape = (count, self._noise_width)
        return torch.from_numpy(generator.standard_normal(shape, dtype=np.float32))


def as_network(actor: Layers) -> Network:
    """Returns layers as a network that runs in NumPy."""
    return Network(
        tuple(layer["weight"].numpy().copy() for layer in actor),
        tuple(layer["bias"].numpy().copy() for layer in actor),
    )


def _update(config: Hyperparameters, with_actor: bool, compiled: bool) -> _Update:
    law = update_soft if config.algorithm == "sac" else update_deterministic
    plain = functools.partial(law, config=config, with_actor=with_actor)
    if not compiled:
        return plain
    key = (repr(config), with_actor)
    if key not in _COMPILED:
        # One graph per agent is intended; torch suspects a fault from the eighth on.
        torch._dynamo.config.recompile_limit = max(64, 2 * len(_COMPILED))
        _COMPILED[key] = torch.compile(plain, fullgraph=True, options=_OPTIONS)
    return _COMPILED[key]

"""Trained policies in NumPy: no torch, no autograd, a few microseconds."""

import dataclasses
import functools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from drake_disasm.common.arrays import Array, array_like
from drake_disasm.common.errors import DisasmError
from drake_disasm.mdp import ACTION_NAMES, STATE_NAMES
from drake_disasm.policies.scripted import Admittance, Straight
from drake_disasm.scenario import Scenario


@dataclasses.dataclass(frozen=True, eq=False)
class Network:
    """A multilayer perceptron with ReLU in the hidden layers and a linear output.

    It reuses its working memory from call to call, so use it in one thread only.

    Attributes:
        weights: (out, in) float32 of each layer; not to be changed after a call.
        biases: (out,) float32 of each layer; the same.
    """

    weights: tuple[np.ndarray, ...]
    biases: tuple[np.ndarray, ...]

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Returns the output (m,) float32, newly made, for one input (n,) float32."""
        memory = self._memory
        memory.given[:] = x
        for affine, before, after, zeros in memory.hidden:
            affine.dot(before, out=after)
            np.maximum(after, zeros, out=after)
        return memory.output.dot(memory.last)

    def rows(self, x: np.ndarray) -> np.ndarray:
        """Returns the outputs (k, m) for inputs (k, n) float32."""
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = np.maximum(x @ weight.T + bias, 0.0)
        return x @ self.weights[-1].T + self.biases[-1]

    def __reduce__(self) -> tuple[Any, ...]:
        """Leaves the working memory out of copies: its views would come apart."""
        return type(self), (self.weights, self.biases)

    @functools.cached_property
    def _memory(self) -> "_Memory":
        return _Memory(self.weights, self.biases)


class _Memory:
    """A network's working memory, allocated once.

    Biases are a further column of the weights and each layer's input ends in a 1, so
    that a layer is one product. Zeros of the right size spare `maximum` a conversion.
    """

    def __init__(
        self, weights: tuple[np.ndarray, ...], biases: tuple[np.ndarray, ...]
    ) -> None:
        affine = [np.column_stack(layer) for layer in zip(weights, biases, strict=True)]
        inputs = [np.ones(layer.shape[1], np.float32) for layer in affine]
        self.given, self.last, self.output = inputs[0][:-1], inputs[-1], affine[-1]
        self.hidden = [
            (layer, before, after[:-1], np.zeros(len(after) - 1, np.float32))
            for layer, before, after in zip(affine, inputs, inputs[1:], strict=False)
        ]


@dataclasses.dataclass(frozen=True, eq=False)
class ActionMap:
    """Maps an agent's output in [-1, 1] to an action, and back.

    a = scale * chosen, plus the base policy's action where there is one: then the
    agent only corrects a policy that works, by at most `action_scale` (bounded
    residual; Johannink et al., 2019). Whoever asks the policy clips to the task's
    bounds (`systems.policy.ask`).

    Attributes:
        action_scale: (6,) largest action or correction [m, rad]; 0 leaves an axis
            to the base policy.
        base: policy that is corrected, or None.
    """

    action_scale: np.ndarray
    base: Straight | Admittance | None = None

    def to_action(self, observation: Array, chosen: Array) -> Array:
        """Returns the actions (..., 6) [m, rad] of choices (..., 6) in [-1, 1].

        Args:
            observation: (..., 12) the states, in SI units.
            chosen: in [-1, 1].
        """
        scale = self.action_scale
        if not isinstance(chosen, np.ndarray):
            scale = array_like(scale, observation)
        action = scale * chosen
        return action if self.base is None else action + self.base(observation)

    def from_action(self, observation: np.ndarray, action: np.ndarray) -> np.ndarray:
        """Returns the choices (..., 6) float32 that come nearest to actions.

        Args:
            observation: (..., 12) the states, in SI units.
            action: (..., 6) [m, rad].
        """
        if self.base is not None:
            action = action - self.base(observation)
        free = self.action_scale > 0.0
        chosen = np.divide(
            action, self.action_scale, out=np.zeros(action.shape), where=free
        )
        return np.clip(chosen, -1.0, 1.0).astype(np.float32)


@dataclasses.dataclass(frozen=True)
class PolicyDescription:
    """What a policy was trained for, and its provenance; the dicts as JSON has them.

    Attributes:
        agent: "ddpg", "td3" or "sac".
        preset: name of the hyper-parameters that it started from.
        hyperparameters: all of them.
        scenario_hash: of the scenario that it was trained on.
        station: "twin" or "cell", on which it was trained.
        state_names, action_names: inputs and outputs, in order.
        observation_variant: of the scenario that it was trained on.
        period: of the MDP [s].
        max_translation, max_rotation: bounds of the action [m, rad].
        way: along and about which coordinates the bolt leaves (`AXES`).
        provenance: command, date, seed, versions, commit.
        evaluation: its figures.
    """

    agent: str = ""
    preset: str = ""
    hyperparameters: dict[str, Any] = dataclasses.field(default_factory=dict)
    scenario_hash: str = ""
    station: str = ""
    state_names: tuple[str, ...] = STATE_NAMES
    action_names: tuple[str, ...] = ACTION_NAMES
    observation_variant: str = "exact"
    period: float = 0.1
    max_translation: float = 0.003
    max_rotation: float = 0.0174533
    way: str = "xy"
    provenance: dict[str, Any] = dataclasses.field(default_factory=dict)
    evaluation: dict[str, Any] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True, eq=False)
class LearnedPolicy:
    """A trained policy: observation (12,) to action (6,), in SI units.

    action = action_map(tanh(network(observation / observation_scale)))

    Attributes:
        network: (12,) to (6,), before the tanh.
        observation_scale: (12,) what the state is divided by [m, rad, N, N m].
        action_map: from the tanh's range to an action.
        description: what it was trained for.
    """

    network: Network
    observation_scale: np.ndarray
    action_map: ActionMap
    description: PolicyDescription = dataclasses.field(
        default_factory=PolicyDescription
    )

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """Returns the action (6,) [m, rad] for an observation (12,), not clipped."""
        return self.to_action(observation, self.normalised(observation))

    def normalised(self, observation: np.ndarray) -> np.ndarray:
        """Returns the choice (6,) float32 in [-1, 1] for an observation (12,)."""
        scaled = (observation / self.observation_scale).astype(np.float32)
        return np.tanh(self.network(scaled))

    def to_action(self, observation: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        """Returns the action (6,) [m, rad] of a choice (6,) in [-1, 1]."""
        return self.action_map.to_action(observation, chosen)

    def check_fits(self, scenario: Scenario) -> None:
        """Refuses a task whose observations or actions differ from the policy's.

        Another part of the same way out, friction or effect is accepted: transfer to
        those is the purpose.
        So are wider bounds, which it does not use.

        Raises:
            DisasmError: names what differs, and the remedy.
        """
        for name, then, now, fits in _compared(self.description, scenario):
            if not fits:
                remedy = f"set {name}={then}, or train anew"
                raise DisasmError(
                    f"the policy was trained with {name} {then}, scenario "
                    f"'{scenario.name}' has {now}; "
                    f"{remedy if '.' in name else 'train anew'}"
                )


def _compared(
    trained: PolicyDescription, scenario: Scenario
) -> Iterator[tuple[str, Any, Any, bool]]:
    """Yields what a policy depends on: name, value then, value now, if they fit."""
    task, variant = scenario.task, scenario.observation.variant
    for name, then, now in (
        ("state", trained.state_names, STATE_NAMES),
        ("action", trained.action_names, ACTION_NAMES),
        ("observation.variant", trained.observation_variant, variant),
        ("the way out", trained.way, scenario.part.way),
    ):
        yield name, then, now, then == now
    same = math.isclose(trained.period, task.period)
    yield "task.period", trained.period, task.period, same
    for name in ("max_translation", "max_rotation"):
        before, after = getattr(trained, name), getattr(task, name)
        yield f"task.{name}", before, after, after >= before

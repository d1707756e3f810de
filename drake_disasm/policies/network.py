"""Trained policies in NumPy: no torch, no autograd, a few microseconds."""

import dataclasses
import functools
import math
from collections.abc import Iterator
from typing import Any, Self

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.mdp import ACTION_NAMES, STATE_NAMES
from drake_disasm.policies.scripted import make_policy, name_of
from drake_disasm.policies.task_view import StageAxes, TaskView
from drake_disasm.scenario import Scenario

_WAY = "the way out"


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

    action = view.to_action(observation, tanh(network(view.observe(observation))))

    Attributes:
        network: (12,) to (6,), before the tanh.
        view: what the network sees of the task, and what its choices do there.
        description: what it was trained for.
    """

    network: Network
    view: TaskView
    description: PolicyDescription = dataclasses.field(
        default_factory=PolicyDescription
    )

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """Returns the action (6,) [m, rad] for an observation (12,), not clipped."""
        return self.to_action(observation, self.normalised(observation))

    def normalised(self, observation: np.ndarray) -> np.ndarray:
        """Returns the choice (6,) float32 in [-1, 1] for an observation (12,)."""
        return np.tanh(self.network(self.view.observe(observation).astype(np.float32)))

    def to_action(self, observation: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        """Returns the action (6,) [m, rad] of a choice (6,) in [-1, 1]."""
        return self.view.to_action(observation, chosen)

    def acting_on(self, scenario: Scenario) -> Self:
        """Returns the policy for a scenario's part and arm.

        One that sees and acts in a stage's axes gets those of the part, and a base
        policy whose gains are for the arm.

        Raises:
            DisasmError: see `check_fits`.
        """
        self.check_fits(scenario)
        view = self.view
        if view.axes is None:
            return self
        base = view.base and make_policy(name_of(view.base), scenario)
        view = dataclasses.replace(view, base=base, axes=StageAxes.of(scenario))
        return dataclasses.replace(self, view=view)

    def check_fits(self, scenario: Scenario) -> None:
        """Refuses a task whose observations or actions differ from the policy's.

        Another part of the same way out, friction or effect is accepted: transfer to
        those is the purpose. So are wider bounds, which it does not use, and any way
        out by a policy in a stage's axes.

        Raises:
            DisasmError: names what differs, and the remedy.
        """
        for name, then, now, fits in _compared(self.description, scenario):
            if not fits and not (name == _WAY and self.view.axes):
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
        (_WAY, trained.way, scenario.part.way),
    ):
        yield name, then, now, then == now
    same = math.isclose(trained.period, task.period)
    yield "task.period", trained.period, task.period, same
    for name in ("max_translation", "max_rotation"):
        before, after = getattr(trained, name), getattr(task, name)
        yield f"task.{name}", before, after, after >= before

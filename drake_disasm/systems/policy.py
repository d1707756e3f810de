"""A policy in the diagram."""

from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import (
    Context,
    DiscreteValues,
    EventStatus,
    LeafSystem,
    OutputPort,
    System,
)

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.stopwatch import Stopwatch
from drake_disasm.common.timing import POLICY_DELAY
from drake_disasm.mdp import ACTION_NAMES, STATE_NAMES
from drake_disasm.systems.imprecision import clamped

#: Observation (12,) to action (6,), both in the groove's nominal frame.
Policy = Callable[[np.ndarray], np.ndarray]


class PolicySystem(LeafSystem):
    """Asks a policy for an action at the MDP's period and holds it.

    @system
    name: PolicySystem
    input_ports:
    - observation
    output_ports:
    - action
    @endsystem

    Attributes:
        policy: that is asked.
        stopwatch: what it takes.

    Args:
        policy: any callable from observation (12,) to action (6,). If it has a
            method `reset`, an episode's start calls it.
        period: of the MDP [s].
        bounds: (6,) actions are clipped to [-bounds, bounds].
    """

    def __init__(self, policy: Policy, period: float, bounds: np.ndarray) -> None:
        super().__init__()
        self.policy, self._bounds = policy, bounds
        self.stopwatch = Stopwatch()
        self._observation = self.DeclareVectorInputPort("observation", 12)
        action = self.DeclareDiscreteState(6)
        self._action = action
        self.DeclarePeriodicDiscreteUpdateEvent(period, POLICY_DELAY, self._update)
        self.DeclareStateOutputPort("action", action)

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        observation = self._observation.Eval(context)
        with self.stopwatch:
            action = ask(self.policy, observation, self._bounds)
        state.set_value(self._action, action)
        return EventStatus.Succeeded()


class ActionHold(LeafSystem):
    """Samples an action at the MDP's period, checks it and holds it.

    For a policy that is a System of its own; a policy's own discrete updates at the
    same time come after the sample.

    @system
    name: ActionHold
    input_ports:
    - action
    output_ports:
    - action_held
    @endsystem

    Attributes:
        stopwatch: what computing the action takes.

    Args:
        period: of the MDP [s].
        bounds: (6,) actions are clipped to [-bounds, bounds].
    """

    def __init__(self, period: float, bounds: np.ndarray) -> None:
        super().__init__()
        self._bounds = bounds
        self.stopwatch = Stopwatch()
        self._action = self.DeclareVectorInputPort("action", 6)
        self._held = self.DeclareDiscreteState(6)
        self.DeclarePeriodicDiscreteUpdateEvent(period, POLICY_DELAY, self._update)
        self.DeclareStateOutputPort("action_held", self._held)

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        with self.stopwatch:  # where a policy's output is computed
            action = self._action.Eval(context)
        state.set_value(self._held, checked(action, self._bounds))
        return EventStatus.Succeeded()


def action_port(policy: System) -> OutputPort:
    """Returns the output port `action` (6) of a policy that is a System.

    Raises:
        DisasmError: it lacks that port or the input port `observation` (12).
    """
    inputs, outputs = policy.HasInputPort, policy.HasOutputPort
    _refuse_port(policy, "input", "observation", len(STATE_NAMES), inputs)
    _refuse_port(policy, "output", "action", len(ACTION_NAMES), outputs)
    return policy.GetOutputPort("action")


def _refuse_port(
    policy: System, kind: str, name: str, size: int, has: Callable[[str], bool]
) -> None:
    """Refuses a System without a port of a policy, or with one of another size."""
    where = f"policy {type(policy).__name__}"
    if not has(name):
        raise DisasmError(
            f"{where}: has no {kind} port '{name}' of size {size}; declare it, or give "
            "a callable from (12,) to (6,)"
        )
    get = policy.GetInputPort if kind == "input" else policy.GetOutputPort
    if get(name).size() != size:
        raise DisasmError(
            f"{where}: its {kind} port '{name}' has size {get(name).size()}; make it "
            f"{size}"
        )


def ask(policy: Policy, observation: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Returns the policy's action (6,), clipped to its bounds.

    Raises:
        DisasmError: it is not six finite numbers.
    """
    return checked(np.asarray(policy(observation), dtype=float), bounds)


def checked(action: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Returns a policy's action (6,), clipped to its bounds.

    Raises:
        DisasmError: it is not six finite numbers.
    """
    if action.shape != (6,):
        raise DisasmError(
            f"the policy returned shape {action.shape}; return 6 numbers "
            "[dx dy dz du dv dw] in m and rad"
        )
    if not np.isfinite(action).all():
        raise DisasmError(
            f"the policy returned {action}; an action must be finite (NaN in its "
            "weights or in its input?)"
        )
    return clamped(action, bounds)

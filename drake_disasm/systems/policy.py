"""A policy in the diagram."""

from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.timing import POLICY_DELAY
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

    Args:
        policy: any callable from observation (12,) to action (6,). If it has a
            method `reset`, an episode's start calls it.
        period: of the MDP [s].
        bounds: (6,) actions are clipped to [-bounds, bounds].
    """

    def __init__(self, policy: Policy, period: float, bounds: np.ndarray) -> None:
        super().__init__()
        self.policy, self._bounds = policy, bounds
        self._observation = self.DeclareVectorInputPort("observation", 12)
        action = self.DeclareDiscreteState(6)
        self._action = action
        self.DeclarePeriodicDiscreteUpdateEvent(period, POLICY_DELAY, self._update)
        self.DeclareStateOutputPort("action", action)

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        action = ask(self.policy, self._observation.Eval(context), self._bounds)
        state.set_value(self._action, action)
        return EventStatus.Succeeded()


def ask(policy: Policy, observation: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Returns the policy's action (6,), clipped to its bounds.

    Raises:
        DisasmError: it is not six finite numbers.
    """
    action = np.asarray(policy(observation), dtype=float)
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

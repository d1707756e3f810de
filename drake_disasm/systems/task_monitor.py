"""Reward and outcome of the running episode, as output ports."""

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    EventStatus,
    LeafSystem,
)

from drake_disasm.common.timing import POLICY_DELAY
from drake_disasm.mdp import (
    REWARD_TERMS,
    BoltState,
    TaskGeometry,
    outcome,
    reward_terms,
)
from drake_disasm.scenario import TaskConfig


class TaskMonitor(LeafSystem):
    """Compares the observation with the one a period ago.

    Read at the end of a period, before its updates, `reward_terms` (in the order
    of REWARD_TERMS) and `outcome` (an `Outcome`) are those of the step just done. A
    simulation connects `X_GB`, where the bolt truly is in the groove.

    @system
    name: TaskMonitor
    input_ports:
    - observation
    - X_GB
    output_ports:
    - reward_terms
    - outcome
    @endsystem

    Attributes:
        geometry: where the groove ends and the bolt is out.

    Args:
        task: the MDP.
        geometry: as above.
    """

    def __init__(self, task: TaskConfig, geometry: TaskGeometry) -> None:
        super().__init__()
        self._task, self.geometry = task, geometry
        self._observation = self.DeclareVectorInputPort("observation", 12)
        self._X_GB = self.DeclareAbstractInputPort("X_GB", Value[RigidTransform]())
        self._before = self.DeclareDiscreteState(12)
        self._steps = self.DeclareDiscreteState(1)
        self.DeclarePeriodicDiscreteUpdateEvent(task.period, POLICY_DELAY, self._update)
        inputs = {self._observation.ticket(), self._X_GB.ticket(), self.xd_ticket()}
        self.DeclareVectorOutputPort(
            "reward_terms",
            len(REWARD_TERMS),
            self._calc_reward,
            prerequisites_of_calc=inputs,
        )
        self.DeclareVectorOutputPort(
            "outcome", 1, self._calc_outcome, prerequisites_of_calc=inputs
        )

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        steps = context.get_discrete_state(self._steps).value()
        state.set_value(self._before, self._observation.Eval(context))
        state.set_value(self._steps, steps + 1.0)
        return EventStatus.Succeeded()

    def _calc_reward(self, context: Context, output: BasicVector) -> None:
        before = context.get_discrete_state(self._before).value()
        terms = reward_terms(
            BoltState.from_vector(before),
            self._state(context),
            self._task,
            self.geometry,
        )
        output.SetFromVector(np.array([terms[name] for name in REWARD_TERMS]))

    def _calc_outcome(self, context: Context, output: BasicVector) -> None:
        steps = int(context.get_discrete_state(self._steps).value()[0])
        p_GBo = None
        if self._X_GB.HasValue(context):
            p_GBo = self._X_GB.Eval(context).translation()
        state = self._state(context)
        result = outcome(state, steps, self._task, self.geometry, p_GBo)
        output.SetFromVector([float(result)])

    def _state(self, context: Context) -> BoltState:
        return BoltState.from_vector(self._observation.Eval(context))

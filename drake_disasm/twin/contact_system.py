"""IMPACT contact in the twin's diagram, implicit as the plant's own is."""

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RotationMatrix
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import Context, LeafSystem

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.common.spatial import shifted_wrench
from drake_disasm.twin.conditions import ImpactConditions
from drake_disasm.twin.contact_step import NO_BALANCE, ImpactStep


class ImpactContact(LeafSystem):
    """Pushes on the bolt so that IMPACT holds at the *end* of the plant's step.

    The plant's step without contact is linear in the twin's six joints, so this system
    can foresee it: `ImpactStep` finds the force at the velocities after the step, and
    with that force the plant arrives at them. The conditions know the environment's
    pull on the bolt; other forces from outside (an optional port) are passed on, and
    the foresight leaves them out.

    @system
    name: ImpactContact
    input_ports:
    - state
    - desired_state
    - applied_spatial_force
    output_ports:
    - spatial_forces
    @endsystem

    Args:
        bolt: the body that is pushed.
        R_WGn: nominal groove frame in the world.
        time_step: of the plant, h [s].
        conditions: of the default Context.
        groove: the body that is pushed back, if anything weighs it.
    """

    def __init__(
        self,
        bolt: BodyIndex,
        R_WGn: RotationMatrix,
        time_step: float,
        conditions: ImpactConditions,
        groove: BodyIndex | None = None,
    ) -> None:
        super().__init__()
        self._bolt, self._R_WGn, self._h = bolt, R_WGn.matrix(), time_step
        self._groove = groove
        self._conditions = self.DeclareAbstractParameter(Value[object](conditions))
        self._state = self.DeclareVectorInputPort("state", 12)
        self._desired = self.DeclareVectorInputPort("desired_state", 12)
        self._outside = self.DeclareAbstractInputPort(
            "applied_spatial_force", Value[list[ExternallyAppliedSpatialForce]]()
        )
        self.DeclareAbstractOutputPort(
            "spatial_forces",
            Value[list[ExternallyAppliedSpatialForce]],
            self._calc,
            prerequisites_of_calc={
                self._state.ticket(),
                self._desired.ticket(),
                self._outside.ticket(),
                self.all_parameters_ticket(),
            },
        )

    def set_conditions(self, context: Context, conditions: ImpactConditions) -> None:
        """Puts law, shape and twin into this system's Context."""
        parameter = context.get_mutable_abstract_parameter(self._conditions)
        parameter.set_value(conditions)

    def conditions(self, context: Context) -> ImpactConditions:
        """Returns what `set_conditions` put there."""
        return context.get_abstract_parameter(self._conditions).get_value()

    def _calc(self, context: Context, output: Value) -> None:
        state, desired = self._state.Eval(context), self._desired.Eval(context)
        step = ImpactStep.of(
            self.conditions(context),
            self._h,
            *(part[None] for part in (state[:6], state[6:], desired[:6], desired[6:])),
        )
        if not step.is_solved[0]:
            raise RuntimeError(NO_BALANCE)
        forces = [self._force(self._bolt, step.wrench[0])]
        if self._groove is not None:
            p_GoBo = self._p_GoBo(context, state[:6])
            back = -shifted_wrench(step.wrench[0], np.eye(3), p_GoBo)
            forces.append(self._force(self._groove, back))
        has_more = self._outside.HasValue(context)
        output.set_value([*forces, *(self._outside.Eval(context) if has_more else [])])

    def _force(
        self, body: BodyIndex, wrench: np.ndarray
    ) -> ExternallyAppliedSpatialForce:
        """Returns a wrench (6,), [f; tau] in Gn, at a body's origin."""
        force = ExternallyAppliedSpatialForce()
        force.body_index = body
        f, t = wrench[:3], wrench[3:]
        force.F_Bq_W = SpatialForce(tau=self._R_WGn @ t, f=self._R_WGn @ f)
        return force

    def _p_GoBo(self, context: Context, q: np.ndarray) -> np.ndarray:
        """Returns where the bolt is from the groove (3,), in Gn."""
        conditions = self.conditions(context)
        X_GnB = BoltCoordinates(conditions.p_BoTo_B).pose(q)
        return np.asarray(X_GnB.translation() - conditions.around.p_GnG[0])

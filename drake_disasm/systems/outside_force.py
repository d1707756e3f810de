"""A force on the bolt other than contact, such as a chain's pull."""

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RotationMatrix
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_disasm.effects import Environment


class OutsideForce(LeafSystem):
    """The environment's force on the bolt at Bo, and the station's force input.

    The force is a parameter of the Context; the output is computed when it changes,
    not in each step of the plant.

    @system
    name: OutsideForce
    input_ports:
    - applied_spatial_force
    output_ports:
    - spatial_forces
    @endsystem

    Args:
        bolt: the body that is pulled.
        R_WGn: nominal groove frame in the world.
        environment: of the default Context.
    """

    def __init__(
        self, bolt: BodyIndex, R_WGn: RotationMatrix, environment: Environment
    ) -> None:
        super().__init__()
        self._bolt, self._R_WGn = bolt, R_WGn.matrix()
        force = BasicVector(np.array(environment.force_Gn))
        self._force = self.DeclareNumericParameter(force)
        self._material = self.DeclareAbstractParameter(Value[object](environment))
        self._outside = self.DeclareAbstractInputPort(
            "applied_spatial_force", Value[list[ExternallyAppliedSpatialForce]]()
        )
        self.DeclareAbstractOutputPort(
            "spatial_forces",
            Value[list[ExternallyAppliedSpatialForce]],
            self._calc,
            prerequisites_of_calc={
                self._outside.ticket(),
                self.all_parameters_ticket(),
            },
        )

    def set_force(self, context: Context, f_Gn: np.ndarray) -> None:
        """Puts a force (3,) [N], in Gn, into this system's Context."""
        context.get_mutable_numeric_parameter(self._force).SetFromVector(f_Gn)

    def set_material(self, context: Context, environment: Environment) -> None:
        """Records the environment whose material the scene graph's Context has."""
        parameter = context.get_mutable_abstract_parameter(self._material)
        parameter.set_value(environment)

    def material(self, context: Context) -> Environment:
        """Returns what `set_material` recorded."""
        return context.get_abstract_parameter(self._material).get_value()

    def _calc(self, context: Context, output: Value) -> None:
        f_Gn = context.get_numeric_parameter(self._force).value()
        forces = []
        if f_Gn.any():
            force = ExternallyAppliedSpatialForce()
            force.body_index = self._bolt
            force.F_Bq_W = SpatialForce(tau=np.zeros(3), f=self._R_WGn @ f_Gn)
            forces.append(force)
        if self._outside.HasValue(context):
            forces += self._outside.Eval(context)
        output.set_value(forces)

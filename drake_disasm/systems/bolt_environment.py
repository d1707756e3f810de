"""What surrounds the bolt, and pulls on it besides contact, as a chain does."""

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RotationMatrix
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import Context, LeafSystem

from drake_disasm.effects import Environment


class BoltEnvironment(LeafSystem):
    """The bolt's environment in force, its pull, and the station's force input.

    The environment is a parameter of the Context; the output is computed when it
    changes, not in each step of the plant.

    @system
    name: BoltEnvironment
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
        self._environment = self.DeclareAbstractParameter(Value[object](environment))
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

    def set(self, context: Context, environment: Environment) -> None:
        """Puts an environment into this system's Context."""
        parameter = context.get_mutable_abstract_parameter(self._environment)
        parameter.set_value(environment)

    def get(self, context: Context) -> Environment:
        """Returns the environment in this system's Context."""
        return context.get_abstract_parameter(self._environment).get_value()

    def _calc(self, context: Context, output: Value) -> None:
        f_Gn = np.array(self.get(context).force_Gn)
        forces = []
        if f_Gn.any():
            force = ExternallyAppliedSpatialForce()
            force.body_index = self._bolt
            force.F_Bq_W = SpatialForce(tau=np.zeros(3), f=self._R_WGn @ f_Gn)
            forces.append(force)
        if self._outside.HasValue(context):
            forces += self._outside.Eval(context)
        output.set_value(forces)

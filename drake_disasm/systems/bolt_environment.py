"""What surrounds the bolt, and pulls on it besides contact: a chain, a detent."""

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import Context, LeafSystem

from drake_disasm.effects import Environment
from drake_disasm.parts import Part


class BoltEnvironment(LeafSystem):
    """The bolt's environment in force, its pull, and the station's force input.

    The environment is a parameter of the Context; the output is computed when it
    changes, not in each step of the plant, unless the part has a spring.

    @system
    name: BoltEnvironment
    input_ports:
    - applied_spatial_force
    - X_GB
    output_ports:
    - spatial_forces
    @endsystem

    Args:
        bolt: the body that is pulled.
        part: whose spring pulls, if it has one.
        R_WGn: nominal groove frame in the world.
        environment: of the default Context.
    """

    def __init__(
        self,
        bolt: BodyIndex,
        part: Part,
        R_WGn: RotationMatrix,
        environment: Environment,
    ) -> None:
        super().__init__()
        self._part = part
        self._bolt, self._R_WGn = bolt, R_WGn.matrix()
        self._environment = self.DeclareAbstractParameter(Value[object](environment))
        self._outside = self.DeclareAbstractInputPort(
            "applied_spatial_force", Value[list[ExternallyAppliedSpatialForce]]()
        )
        self._X_GB = self.DeclareAbstractInputPort("X_GB", Value[RigidTransform]())
        tickets = {self._outside.ticket(), self.all_parameters_ticket()}
        if part.has_spring:
            tickets.add(self._X_GB.ticket())
        self.DeclareAbstractOutputPort(
            "spatial_forces",
            Value[list[ExternallyAppliedSpatialForce]],
            self._calc,
            prerequisites_of_calc=tickets,
        )

    def set(self, context: Context, environment: Environment) -> None:
        """Puts an environment into this system's Context."""
        parameter = context.get_mutable_abstract_parameter(self._environment)
        parameter.set_value(environment)

    def get(self, context: Context) -> Environment:
        """Returns the environment in this system's Context."""
        return context.get_abstract_parameter(self._environment).get_value()

    def _calc(self, context: Context, output: Value) -> None:
        environment = self.get(context)
        f_Gn, t_Gn = np.array(environment.force_Gn), np.zeros(3)
        if self._part.has_spring:
            R_GnG, X_GB = environment.X_GnG.rotation(), self._X_GB.Eval(context)
            wrench = self._part.spring_wrench(X_GB, environment)
            f_Gn, t_Gn = f_Gn + R_GnG @ wrench[:3], R_GnG @ wrench[3:]
        forces = []
        if f_Gn.any() or t_Gn.any():
            force = ExternallyAppliedSpatialForce()
            force.body_index = self._bolt
            tau, f = self._R_WGn @ t_Gn, self._R_WGn @ f_Gn
            force.F_Bq_W = SpatialForce(tau=tau, f=f)
            forces.append(force)
        if self._outside.HasValue(context):
            forces += self._outside.Eval(context)
        output.set_value(forces)

"""One body's pose, picked out of a plant's."""

from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, LeafSystem


class BodyPose(LeafSystem):
    """Picks one body's pose, expressed in the groove's nominal frame.

    @system
    name: BodyPose
    input_ports:
    - body_poses
    output_ports:
    - X_GnB
    @endsystem

    Args:
        body: its index in the plant.
        X_WG: the groove's nominal frame in the world.
    """

    def __init__(self, body: int, X_WG: RigidTransform) -> None:
        super().__init__()
        self._body, self._X_GW = body, X_WG.inverse()
        poses = self.DeclareAbstractInputPort(
            "body_poses", Value[list[RigidTransform]]()
        )
        self._poses = poses
        self.DeclareAbstractOutputPort(
            "X_GnB",
            Value[RigidTransform],
            self._calc,
            prerequisites_of_calc={poses.ticket()},
        )

    def _calc(self, context: Context, output: Value) -> None:
        X_WB = self._poses.Eval(context)[self._body]
        output.set_value(self._X_GW @ X_WB)

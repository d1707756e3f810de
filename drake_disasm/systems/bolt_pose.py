"""Where the bolt truly is, which only a simulation knows."""

from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import Context, LeafSystem


class BoltPose(LeafSystem):
    """Picks the bolt's pose out of a plant's, in the nominal and in the true groove.

    @system
    name: BoltPose
    input_ports:
    - body_poses
    output_ports:
    - X_GnB
    - X_GB
    @endsystem

    Args:
        bolt, groove: bodies of the plant.
        X_WG: the groove's nominal frame in the world.
    """

    def __init__(
        self, bolt: BodyIndex, groove: BodyIndex, X_WG: RigidTransform
    ) -> None:
        super().__init__()
        self._bolt, self._groove, self._X_GnW = int(bolt), int(groove), X_WG.inverse()
        self._poses = self.DeclareAbstractInputPort(
            "body_poses", Value[list[RigidTransform]]()
        )
        for name, calc in (("X_GnB", self._calc_nominal), ("X_GB", self._calc_true)):
            self.DeclareAbstractOutputPort(
                name,
                Value[RigidTransform],
                calc,
                prerequisites_of_calc={self._poses.ticket()},
            )

    def _calc_nominal(self, context: Context, output: Value) -> None:
        output.set_value(self._X_GnW @ self._poses.Eval(context)[self._bolt])

    def _calc_true(self, context: Context, output: Value) -> None:
        X_W = self._poses.Eval(context)
        output.set_value(X_W[self._groove].inverse() @ X_W[self._bolt])

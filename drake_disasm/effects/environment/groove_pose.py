"""The groove is rotated or offset."""

import dataclasses

from drake_disasm.common.rotations import pose_from_vectors
from drake_disasm.effects.base import BoltMotion, Environment, EnvironmentEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class GroovePose(EnvironmentEffect):
    """The lock is mounted rotated about A, or offset, from its nominal pose.

    Equation: X_GnG = (Exp([rx, ry, rz]), [x, y, z]) with Gn the nominal groove
    frame (origin at A, x along the groove, y out of the plate) and G the true
    one. The rotated fixture of the thesis (3.3.1.1) is ry.
    Where it acts: the pose of the lock in the plant. An episode begins with the
    bolt in the groove whatever the offset: beyond the clearance, arm and gripper
    yield and press it against the walls. The bounds of the offsets are those within
    which the bolt still finds the slot.
    """

    rx: float = amplitude("rad", -0.2, 0.2, "rotation about the groove's axis")
    ry: float = amplitude("rad", -0.2, 0.2, "rotation about the plate's normal")
    rz: float = amplitude("rad", -0.2, 0.2, "tilt: the far end goes up")
    x: float = amplitude("m", -0.01, 0.003, "offset along the groove")
    y: float = amplitude("m", -0.001, 0.001, "offset out of the plate")
    z: float = amplitude("m", -0.002, 0.002, "offset across the groove")

    noun = "a groove that is turned or offset"
    experiment = "pulls in both directions, the bolt turned by a known angle between"

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Composes the true groove frame onto the pose so far."""
        turn = self.vector(bolt.p, "rx", "ry", "rz")
        moved = pose_from_vectors(turn, self.vector(bolt.p, "x", "y", "z"))
        return dataclasses.replace(environment, X_GnG=environment.X_GnG @ moved)

"""A joint whose drive is geared to the joint before it, as in many wrists."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from drake_disasm.effects.base import ArmSamples, ArmTorqueEffect
from drake_disasm.effects.fields import amplitude, joint_name, shape_parameter
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class JointCoupling(ArmTorqueEffect):
    """The drive of the next joint turns with this one, too: a coupled wrist.

    Equation: with i this joint and j the next, tau_i = I vd_j + b v_j + r and
    tau_j = I vd_i + b v_i + r, r = c tanh((v_i + v_j) / e): inertia, viscous and dry
    friction of a motor that turns by q_i + q_j (Gautier and Janot's model of the
    Staubli TX40; what it adds for each joint alone is RotorInertia and its friction).
    Where it acts: two neighbouring joints, on the torques that their sensors measure.
    """

    joint: str = joint_name()
    inertia: float = amplitude("kg m^2", -50.0, 50.0, "I, of the common motor")
    viscous: float = amplitude("N m s/rad", -500.0, 500.0, "b, of its bearings")
    dry: float = amplitude("N m", -200.0, 200.0, "c, of its bearings")
    creep: float = shape_parameter(
        0.02, "rad/s", 1e-4, 0.1, "e, velocity of the transition", (0.02,)
    )

    noun = "coupling to another joint"
    is_common = False
    experiment = "this joint and the next, alone and together, both ways"

    @classmethod
    def places(cls, joints: Sequence[str]) -> list[dict[str, str]]:
        """See ArmEffect: each joint that another follows."""
        return [{"joint": joint} for joint in joints[:-1]]

    def torques(self, samples: ArmSamples) -> np.ndarray:
        """See ArmTorqueEffect."""
        added = np.zeros_like(samples.load)
        i = samples.joints.index(self.joint)
        pair = slice(i, i + 2)
        v, vd = samples.v[..., pair], samples.vd[..., pair]
        both = v.sum(axis=-1, keepdims=True)
        dry = self.column("dry") * np.tanh(both / self.column("creep"))
        other = self.column("inertia") * vd[..., ::-1]
        other = other + self.column("viscous") * v[..., ::-1]
        added[..., pair] = other + dry if v.shape[-1] == 2 else 0.0
        return added

"""A spring that pulls at a joint."""

import dataclasses
from typing import ClassVar

import numpy as np

from drake_disasm.effects.base import JointEffect, JointSamples
from drake_disasm.effects.fields import amplitude, joint_name
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class JointSpring(JointEffect):
    """A spring between two links: a counterbalance, or cables that a joint winds up.

    Equation: tau = k q, Hooke's law by the joint's angle. Of a spring that is slack
    at q_0, tau = k (q - q_0), the constant part -k q_0 is a `TorqueOffset`; one whose
    torque is a sine of the angle is `TorqueRipple` with one period per turn. A
    counterbalance may act with a negative k.
    Where it acts: one joint of the arm, on the torque that its sensor measures, or that
    its drive has to give. In the cell it is slack at q = 0.
    """

    joint: str = joint_name()
    stiffness: float = amplitude("N m/rad", -2000.0, 2000.0, "k, of the spring")

    is_filtered = True
    noun = "a spring"
    experiment = (
        "this joint slowly over its whole range, both ways, in two poses of the joints "
        "before it"
    )
    rest_experiment = (
        "rests of this joint over its whole range, its axis turned upright by the "
        "joints before it, so that gravity does not load it"
    )
    experiments_against: ClassVar = {
        "TorqueOffset": "rests of this joint over its whole range",
        "TorqueRipple": "this joint slowly over its whole range: a spring's torque "
        "never returns",
        "FlangePayload": "rests at the same angle of this joint, the joints before it "
        "turned: weight changes with them, a spring does not",
        "ArmTilt": "rests at the same angle of this joint, the joints before it "
        "turned: weight changes with them, a spring does not",
    }

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        return self.stiffness * samples.q

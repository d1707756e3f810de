"""A joint whose gear has play, with the encoder on the motor's side."""

import dataclasses
from typing import ClassVar

from drake_disasm.effects.base import ArmEffect
from drake_disasm.effects.fields import amplitude, joint_name, shape_parameter
from drake_disasm.effects.registry import register_effect

#: The time that a link takes from one end to the other, and so what a motion shows, is
#: in no proportion to a small play.
_STEP = 2e-3  # rad, beyond most encoders


@register_effect
@dataclasses.dataclass
class JointBacklash(ArmEffect):
    """A gear has play: where its load changes sign, motor and link come apart.

    Equation: q - q_link = b / 2 tanh(tau / tau_0), with tau the load of the gear: a
    dead zone (Nordin and Gutman 2002, "Controlling mechanical systems with backlash -
    a survey") with softened edges.
    Where it acts: between one joint's motor and its link, on the motion of an arm
    behind its drives (logs of kind `joint_response`). No log of torques offers it: in
    those it is a blow, shorter than what is left of a filtered motion.
    """

    joint: str = joint_name()
    play: float = amplitude("rad", 0.0, 0.1, "b, from one end to the other", _STEP)
    load: float = shape_parameter(
        0.1, "N m", 1e-3, 20.0, "tau_0, that takes a link to an end", (0.01, 0.1, 1.0)
    )

    noun = "backlash"
    experiment = (
        "reversals of this joint about where gravity pulls its gear neither way, slow "
        "ones first"
    )
    experiments_against: ClassVar = {
        "JointElasticity": "the same reversals under two loads: play does not grow",
        "JointCoulombFriction": "reversals under a load that keeps its sign: friction "
        "stays, play does not show",
    }

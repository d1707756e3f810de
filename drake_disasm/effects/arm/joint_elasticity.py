"""A joint whose gear yields, with the encoder on the motor's side."""

import dataclasses
from typing import ClassVar

from drake_disasm.effects.base import ArmEffect
from drake_disasm.effects.fields import amplitude, joint_name
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class JointElasticity(ArmEffect):
    """A gear yields: the encoder, on the motor's side, is not where the link is.

    Equation: q_link = q - c tau_i, so that to first order in c the joints' torques
    change by -c (dtau/dq_i tau_i + dtau/dv_i tau_i' + dtau/dvd_i tau_i''), with i this
    joint (Spong 1987, whose spring has the stiffness 1 / c). tau_i and the derivatives
    are those of the rigid bodies by the URDF, with gravity: where that has no mass,
    the effect does nothing. Motion at a share s of the joint's resonance makes c too
    large by a share of about s^2.
    Where it acts: between one joint's motor and its link, on the torques that all
    joints' sensors measure.
    """

    joint: str = joint_name()
    compliance: float = amplitude(
        "rad/(N m)", 0.0, 0.1, "c, of gear and coupling: 1 / stiffness"
    )

    noun = "a gear that yields"
    experiment = "swings of this joint at several frequencies, under a known load"
    rest_experiment = (
        "the same poses with two known payloads: a gear yields with the load"
    )
    experiments_against: ClassVar = {
        "RotorInertia": "fast reversals: with a spring, torque grows with a higher "
        "power of the frequency than with inertia",
        "ArmDelay": "swings at several frequencies: a spring turns no phase, a delay "
        "turns it ever more",
        "JointDelay": "swings at several frequencies: a spring turns no phase, a delay "
        "turns it ever more",
        "FlangePayload": "rests with the arm stretched out, then fast reversals",
    }

"""A joint's encoder that reads another angle than the link's."""

import dataclasses
from typing import ClassVar

from drake_disasm.common.arrays import Array
from drake_disasm.effects.base import ArmEffect
from drake_disasm.effects.fields import amplitude, joint_name
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class EncoderError(ArmEffect):
    """An encoder's zero is elsewhere, or its scale or the gear's ratio is another.

    Equation: q_read = (1 + s) q + o, v_read = (1 + s) v, so that to first order in s
    and o the torques by what was read change by
    -o dtau/dq_i - s (q_i dtau/dq_i + v_i dtau/dv_i + vd_i dtau/dvd_i), with i this
    joint (offset and gain errors of joint sensors as in Mooring, Roth and Driels 1991,
    "Fundamentals of manipulator calibration"). The derivatives are those of the rigid
    bodies by the URDF, with gravity: where that has no mass, the effect does nothing.
    Where it acts: between one joint and who reads its position, the controller among
    them: the arm is elsewhere than commanded. It shows in the torques of all joints. An
    offset of a vertical first joint, or of a last joint whose link's weight is free,
    does not show.
    """

    joint: str = joint_name()
    offset: float = amplitude("rad", -0.2, 0.2, "o, what it reads at zero")
    scale: float = amplitude("1", -0.1, 0.1, "s, relative error of the scale")

    is_common = False
    noun = "an encoder error"
    experiment = (
        "rests over the whole range of this joint, and fast swings of it in two places"
    )
    rest_experiment = "rests over the whole range of this joint, with a known payload"
    experiments_against: ClassVar = {
        "TorqueGain": "rests with two known payloads: a gain shows at its joint alone, "
        "a wrong angle at all joints",
        "FlangePayload": "the same rests with and without a known payload: a wrong "
        "angle turns the known weight, too",
        "ArmTilt": "rests with the joints before this one turned: a tilt stays with "
        "the base, a wrong angle turns with the arm",
        "JointElasticity": "the same rests with two known payloads: a spring yields "
        "with the load, an encoder's offset does not",
        "RotorInertia": "swings of this joint with two known payloads: a scale changes "
        "what the links take, a rotor's share stays",
    }

    def off(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Returns by how much position and velocity (...) are read too large."""
        return self.offset + self.scale * q, self.scale * v

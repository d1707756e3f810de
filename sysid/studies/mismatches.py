"""What a robot may have that its twin lacks, in studies."""

import math
from dataclasses import dataclass

from drake_disasm.effects import (
    ChainPull,
    CommandGain,
    Effect,
    GrooveFriction,
    GroovePose,
    SensorBias,
    SensorCrossTalk,
)


@dataclass(frozen=True)
class Mismatch:
    """Effects that the robot has and the nominal twin lacks.

    Attributes:
        text: in words.
        effects: as the simulated robot has them.
    """

    text: str
    effects: tuple[Effect, ...]


#: By name.
MISMATCHES = {
    "turned": Mismatch(
        "the groove is turned by 6 degrees in the plate and rubs more",
        (GroovePose(ry=math.radians(6.0)), GrooveFriction(coefficient=0.15)),
    ),
    "tilted": Mismatch(
        "the groove's far end stands up by 3 degrees",
        (GroovePose(rz=math.radians(3.0)),),
    ),
    "sunk": Mismatch(
        "the groove's far end is down by 6 degrees",
        (GroovePose(rz=math.radians(-6.0)),),
    ),
    "rolled": Mismatch(
        "the groove is rolled by -5 degrees about its axis",
        (GroovePose(rx=math.radians(-5.0)),),
    ),
    "biased": Mismatch(
        "the sensor has an offset of 3 N along x_S since it was zeroed",
        (SensorBias(fx=3.0),),
    ),
    "cross_talk": Mismatch(
        "fy and fz pick up 0.4 of fx",
        (SensorCrossTalk(fy_fx=0.4, fz_fx=0.4),),
    ),
    "pulled": Mismatch("the chain pulls back with 150 N/m", (ChainPull(k=150.0),)),
    "short": Mismatch(
        "the arm goes 0.6 of what it is told along x", (CommandGain(x=-0.4),)
    ),
}

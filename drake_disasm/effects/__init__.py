"""Physical effects that a scenario can list. To add one: a file and a line here."""

from drake_disasm.effects.arm.asymmetric_friction import JointAsymmetricFriction
from drake_disasm.effects.arm.coulomb_friction import JointCoulombFriction
from drake_disasm.effects.arm.load_friction import JointLoadFriction
from drake_disasm.effects.arm.rotor_inertia import RotorInertia
from drake_disasm.effects.arm.stribeck_friction import JointStribeckFriction
from drake_disasm.effects.arm.torque_gain import TorqueGain
from drake_disasm.effects.arm.torque_offset import TorqueOffset
from drake_disasm.effects.arm.viscous_friction import JointViscousFriction
from drake_disasm.effects.base import (
    ArmEffect,
    Effect,
    Environment,
    EnvironmentEffect,
    JointSamples,
    Sensing,
    SensorEffect,
    sensor_chain,
    shapes,
    sizes,
)
from drake_disasm.effects.environment.groove_friction import GrooveFriction
from drake_disasm.effects.environment.groove_pose import GroovePose
from drake_disasm.effects.sensor.bias import SensorBias
from drake_disasm.effects.sensor.cross_talk import SensorCrossTalk
from drake_disasm.effects.sensor.drift import SensorDrift
from drake_disasm.effects.sensor.gain import SensorGain
from drake_disasm.effects.sensor.mounting import SensorMounting
from drake_disasm.effects.sensor.payload_error import PayloadError
from drake_disasm.effects.sensor.warm_up import SensorWarmUp

#: Every effect that a scenario may name, in the order of the documentation.
EFFECTS: tuple[type[Effect], ...] = (
    GroovePose,
    GrooveFriction,
    SensorBias,
    SensorDrift,
    SensorWarmUp,
    SensorGain,
    SensorCrossTalk,
    SensorMounting,
    PayloadError,
    JointViscousFriction,
    JointCoulombFriction,
    JointStribeckFriction,
    JointAsymmetricFriction,
    JointLoadFriction,
    TorqueOffset,
    TorqueGain,
    RotorInertia,
)

__all__ = [
    "EFFECTS",
    "ArmEffect",
    "Effect",
    "Environment",
    "EnvironmentEffect",
    "GrooveFriction",
    "GroovePose",
    "JointAsymmetricFriction",
    "JointCoulombFriction",
    "JointLoadFriction",
    "JointSamples",
    "JointStribeckFriction",
    "JointViscousFriction",
    "PayloadError",
    "RotorInertia",
    "Sensing",
    "SensorBias",
    "SensorCrossTalk",
    "SensorDrift",
    "SensorEffect",
    "SensorGain",
    "SensorMounting",
    "SensorWarmUp",
    "TorqueGain",
    "TorqueOffset",
    "sensor_chain",
    "shapes",
    "sizes",
]

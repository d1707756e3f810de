"""Physical effects that a scenario can list.

To add one to the library: a file, and its import below. To add one of your own from
anywhere else: `register_effect`.
"""

from drake_disasm.effects.base import (
    AT_REST,
    LONGEST_POSE_MEMORY,
    ArmEffect,
    ArmSamples,
    ArmTorqueEffect,
    BoltMotion,
    DelayEffect,
    Effect,
    Environment,
    EnvironmentEffect,
    JointEffect,
    JointMemoryEffect,
    JointSamples,
    MotionEffect,
    PoseEffect,
    Reach,
    Sensing,
    SensorEffect,
    SensorMemoryEffect,
)
from drake_disasm.effects.chains import (
    environment_at,
    is_local,
    motion_chain,
    pose_weights,
    reported_poses,
    sensor_chain,
)
from drake_disasm.effects.fields import (
    acts_at_joint,
    amplitude,
    amplitudes,
    files_of,
    joint_name,
    shape_parameter,
    shape_parameters,
)
from drake_disasm.effects.registry import (
    find_effect,
    register_effect,
    registered_effects,
)

# Effects are registered, documented and tried in the order of these lines.
# isort: off
from drake_disasm.effects.environment.groove_pose import GroovePose
from drake_disasm.effects.environment.groove_bend import GrooveBend
from drake_disasm.effects.environment.groove_clearance import GrooveClearance
from drake_disasm.effects.environment.groove_friction import GrooveFriction
from drake_disasm.effects.environment.viscous_friction import GrooveViscousFriction
from drake_disasm.effects.environment.stribeck_friction import GrooveStribeckFriction
from drake_disasm.effects.environment.rusty_patch import RustyPatch
from drake_disasm.effects.environment.contact_stiffness import ContactStiffness
from drake_disasm.effects.environment.contact_exponent import ContactExponent
from drake_disasm.effects.environment.chain_pull import ChainPull
from drake_disasm.effects.environment.detent_torque import DetentTorque
from drake_disasm.effects.motion.command_gain import CommandGain
from drake_disasm.effects.motion.lag import MotionLag
from drake_disasm.effects.motion.backlash import Backlash
from drake_disasm.effects.motion.compliance import Compliance
from drake_disasm.effects.motion.slip import BoltSlip
from drake_disasm.effects.motion.imprecision import Imprecision
from drake_disasm.effects.pose.delay import PoseDelay
from drake_disasm.effects.sensor.bias import SensorBias
from drake_disasm.effects.sensor.drift import SensorDrift
from drake_disasm.effects.sensor.warm_up import SensorWarmUp
from drake_disasm.effects.sensor.step import SensorStep
from drake_disasm.effects.sensor.gain import SensorGain
from drake_disasm.effects.sensor.gain_drift import SensorGainDrift
from drake_disasm.effects.sensor.cross_talk import SensorCrossTalk
from drake_disasm.effects.sensor.lag import SensorLag
from drake_disasm.effects.sensor.delay import SensorDelay
from drake_disasm.effects.sensor.hysteresis import SensorHysteresis
from drake_disasm.effects.sensor.saturation import SensorSaturation
from drake_disasm.effects.sensor.dead_band import SensorDeadBand
from drake_disasm.effects.sensor.mounting import SensorMounting
from drake_disasm.effects.sensor.payload_error import PayloadError
from drake_disasm.effects.sensor.base_tilt import BaseTilt
from drake_disasm.effects.sensor.residual_model import SensorResidualModel
from drake_disasm.effects.arm.coulomb_friction import JointCoulombFriction
from drake_disasm.effects.arm.viscous_friction import JointViscousFriction
from drake_disasm.effects.arm.stribeck_friction import JointStribeckFriction
from drake_disasm.effects.arm.asymmetric_friction import JointAsymmetricFriction
from drake_disasm.effects.arm.load_friction import JointLoadFriction
from drake_disasm.effects.arm.quadratic_friction import JointQuadraticFriction
from drake_disasm.effects.arm.dahl_friction import JointDahlFriction
from drake_disasm.effects.arm.joint_spring import JointSpring
from drake_disasm.effects.arm.torque_offset import TorqueOffset
from drake_disasm.effects.arm.torque_gain import TorqueGain
from drake_disasm.effects.arm.rotor_inertia import RotorInertia
from drake_disasm.effects.arm.torque_ripple import TorqueRipple
from drake_disasm.effects.arm.joint_coupling import JointCoupling
from drake_disasm.effects.arm.time_shift import ArmDelay, JointDelay
from drake_disasm.effects.arm.base_tilt import ArmTilt
from drake_disasm.effects.arm.flange_payload import FlangePayload
from drake_disasm.effects.arm.link_payload import LinkPayload
from drake_disasm.effects.arm.joint_elasticity import JointElasticity
from drake_disasm.effects.arm.joint_backlash import JointBacklash
from drake_disasm.effects.arm.encoder_error import EncoderError
from drake_disasm.effects.arm.residual_model import ArmResidualModel
# isort: on

__all__ = [
    "AT_REST",
    "LONGEST_POSE_MEMORY",
    "ArmDelay",
    "ArmEffect",
    "ArmResidualModel",
    "ArmSamples",
    "ArmTilt",
    "ArmTorqueEffect",
    "Backlash",
    "BaseTilt",
    "BoltMotion",
    "BoltSlip",
    "ChainPull",
    "CommandGain",
    "Compliance",
    "ContactExponent",
    "ContactStiffness",
    "DelayEffect",
    "DetentTorque",
    "Effect",
    "EncoderError",
    "Environment",
    "EnvironmentEffect",
    "FlangePayload",
    "GrooveBend",
    "GrooveClearance",
    "GrooveFriction",
    "GroovePose",
    "GrooveStribeckFriction",
    "GrooveViscousFriction",
    "Imprecision",
    "JointAsymmetricFriction",
    "JointBacklash",
    "JointCoulombFriction",
    "JointCoupling",
    "JointDahlFriction",
    "JointDelay",
    "JointEffect",
    "JointElasticity",
    "JointLoadFriction",
    "JointMemoryEffect",
    "JointQuadraticFriction",
    "JointSamples",
    "JointSpring",
    "JointStribeckFriction",
    "JointViscousFriction",
    "LinkPayload",
    "MotionEffect",
    "MotionLag",
    "PayloadError",
    "PoseDelay",
    "PoseEffect",
    "Reach",
    "RotorInertia",
    "RustyPatch",
    "Sensing",
    "SensorBias",
    "SensorCrossTalk",
    "SensorDeadBand",
    "SensorDelay",
    "SensorDrift",
    "SensorEffect",
    "SensorGain",
    "SensorGainDrift",
    "SensorHysteresis",
    "SensorLag",
    "SensorMemoryEffect",
    "SensorMounting",
    "SensorResidualModel",
    "SensorSaturation",
    "SensorStep",
    "SensorWarmUp",
    "TorqueGain",
    "TorqueOffset",
    "TorqueRipple",
    "acts_at_joint",
    "amplitude",
    "amplitudes",
    "environment_at",
    "files_of",
    "find_effect",
    "is_local",
    "joint_name",
    "motion_chain",
    "pose_weights",
    "register_effect",
    "registered_effects",
    "reported_poses",
    "sensor_chain",
    "shape_parameter",
    "shape_parameters",
]

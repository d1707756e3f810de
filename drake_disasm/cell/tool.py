"""Sensor and gripper on the flange, and where the bolt sits in them.

Frames: F flange, S sensor, T the gripper's tcp (z towards the tips), B bolt.
"""

import copy
import dataclasses
from collections.abc import Sequence
from typing import Self

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    Frame,
    ModelInstanceIndex,
    PrismaticJoint,
    RigidBody,
    SpatialInertia,
)

from drake_disasm.cell.parsing import add_model, model_frame
from drake_disasm.cell.sensor import SensorModel, add_sensor
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.scenario import GripperConfig, Scenario


@dataclasses.dataclass(frozen=True)
class Tool:
    """Rigid geometry and mass of everything beyond the sensor's joint.

    Without a sensor in the wrist that is all on the flange, and S is F.

    Attributes:
        X_FB, X_SB: pose of the bolt, as grasped, in flange and sensor frame.
        X_TB: pose of the bolt, as grasped, in the gripper's tcp.
        M_F: spatial inertia about Fo in F, sensor's body and bolt included.
        M_palm_F: the same without fingers and bolt.
        M_fingers_B: spatial inertia of the fingers about Bo in B; zero without any.
        M_bolt_B: of the bolt.
        p_SoScm_S: centre of mass in the sensor frame (3,) [m].
    """

    X_FB: RigidTransform
    X_SB: RigidTransform
    X_TB: RigidTransform
    M_F: SpatialInertia
    M_palm_F: SpatialInertia
    M_fingers_B: SpatialInertia
    M_bolt_B: SpatialInertia
    p_SoScm_S: np.ndarray

    @property
    def M_gripped_B(self) -> SpatialInertia:
        """Of fingers and bolt, which move when the fingers yield."""
        return summed([self.M_fingers_B, self.M_bolt_B])

    @property
    def p_BoTo_B(self) -> np.ndarray:
        """The gripper's tcp, where its compliance is, (3,) in B [m]."""
        return self.X_TB.inverse().translation()

    @property
    def mass(self) -> float:
        """Mass of what hangs on the sensor's joint [kg]."""
        return self.M_F.get_mass()

    @classmethod
    def from_models(cls, scenario: Scenario) -> Self:
        """Returns the tool of the scenario's sensor, gripper and lock."""
        plant, M_bolt_B = MultibodyPlant(0.0), scenario.part.M_moved_B
        models = add_tool(plant, plant.world_frame(), scenario)
        bolt = plant.AddRigidBody("bolt", plant.AddModelInstance("bolt"), M_bolt_B)
        X_TB = grasp_pose(scenario, models)
        plant.WeldFrames(models.frame_T, bolt.body_frame(), X_TB)
        plant.Finalize()
        _refuse_wide_grasp(scenario, models)
        context = plant.CreateDefaultContext()
        for joint in models.fingers:
            joint.set_translation(context, scenario.part.grip_width / 2)
        X_SF = models.frame_S.CalcPoseInWorld(context).inverse()
        X_FB = plant.EvalBodyPoseInWorld(context, bolt)
        bodies = [b for i in models.instances for b in plant.GetBodyIndices(i)]
        M_F = plant.CalcSpatialInertia(
            context, plant.world_frame(), [*bodies, bolt.index()]
        )
        fingers = [joint.child_body().index() for joint in models.fingers]
        palm = [index for index in bodies if index not in fingers]
        return cls(
            X_FB=X_FB,
            X_SB=X_SF @ X_FB,
            X_TB=X_TB,
            M_F=M_F,
            M_palm_F=plant.CalcSpatialInertia(context, plant.world_frame(), palm),
            M_fingers_B=plant.CalcSpatialInertia(context, bolt.body_frame(), fingers)
            if fingers
            else SpatialInertia.Zero(),
            M_bolt_B=M_bolt_B,
            p_SoScm_S=X_SF @ M_F.get_com(),
        )


@dataclasses.dataclass(frozen=True)
class ToolModels:
    """Handles of sensor and gripper in a plant.

    Attributes:
        frame_S, frame_T: sensing frame (the flange without a sensor in the wrist), and
            tool centre point.
        frame_tip: where the pads, or a tool without fingers, end along z_T.
        carriage: body that carries the fingers, fixed to the palm, or else the tool.
        fingers: the joints of the two fingers, or none.
        sensor: in the wrist, or None.
        gripper: model instance.
    """

    frame_S: Frame
    frame_T: Frame
    frame_tip: Frame
    carriage: RigidBody
    fingers: tuple[PrismaticJoint, ...]
    sensor: SensorModel | None
    gripper: ModelInstanceIndex

    @property
    def instances(self) -> tuple[ModelInstanceIndex, ...]:
        """The model instances."""
        return (*([self.sensor.instance] if self.sensor else []), self.gripper)


def add_tool(plant: MultibodyPlant, frame_F: Frame, scenario: Scenario) -> ToolModels:
    """Adds the sensor to the flange, if it is in the wrist, and the gripper to it.

    Without one S is the gripper's base, on the flange.

    Raises:
        DisasmError: a model file is missing or is of another device.
    """
    on, sensor = frame_F, None
    if scenario.ft_sensor.place == "wrist":
        sensor = add_sensor(plant, frame_F, scenario.ft_sensor.model)
        on = sensor.tool_side
    url = scenario.gripper.model
    gripper = add_model(plant, url)
    base = model_frame(plant, gripper, "gripper_base", url)
    plant.WeldFrames(on, base)
    frame_S = sensor.frame_S if sensor else base
    frame_T = model_frame(plant, gripper, "tcp", url)
    frame_tip, carriage = frame_T, frame_T.body()
    if scenario.gripper.fingers:
        frame_tip = model_frame(plant, gripper, "fingertip", url)
        carriage = model_frame(plant, gripper, "finger_carriage", url).body()
    fingers = _fingers(plant, gripper, scenario.gripper)
    return ToolModels(frame_S, frame_T, frame_tip, carriage, fingers, sensor, gripper)


def _fingers(
    plant: MultibodyPlant, instance: ModelInstanceIndex, gripper: GripperConfig
) -> tuple[PrismaticJoint, ...]:
    """Returns the joints of the fingers, or refuses a gripper that has others."""
    joints = [plant.get_joint(index) for index in plant.GetJointIndices(instance)]
    moving = {each.name(): each for each in joints if each.num_velocities() > 0}
    names = list(moving)
    for name in gripper.fingers:
        if name not in moving:
            raise DisasmError(
                f"gripper.fingers: {gripper.model} has no movable joint '{name}'; "
                f"{closest(name, names)}"
            )
    fingers = tuple(moving[name] for name in gripper.fingers)
    are_sliding = all(isinstance(each, PrismaticJoint) for each in fingers)
    if set(gripper.fingers) != set(names) or not are_sliding:
        raise DisasmError(
            f"gripper.model: {gripper.model} moves by {', '.join(names)}; a gripper "
            "here has two sliding fingers, named by gripper.fingers, or none: make the "
            "other joints fixed"
        )
    return fingers


def _refuse_wide_grasp(scenario: Scenario, models: ToolModels) -> None:
    if not models.fingers:
        return
    width = scenario.part.grip_width
    opening = sum(joint.position_upper_limit() for joint in models.fingers)
    if width > opening:
        raise DisasmError(
            f"gripper.model: {scenario.gripper.model} opens to {opening:g} m, and the "
            f"bolt's grip is {width:g} m wide; give a narrower one, or another gripper"
        )


def summed(inertias: Sequence[SpatialInertia]) -> SpatialInertia:
    """Returns the spatial inertia of bodies together, about one point in one frame."""
    total = copy.copy(inertias[0])
    for inertia in inertias[1:]:
        total += inertia
    return total


def grasp_rotation() -> RotationMatrix:
    """Returns R_TB: y_B points back at the robot.

    x_B = -x_T, since the flange's x axis points back at the base when the tool
    points down with joint 7 at zero.
    """
    return RotationMatrix(np.array([[-1.0, 0, 0], [0, 0, -1.0], [0, -1.0, 0]]))


def grasp_pose(scenario: Scenario, models: ToolModels) -> RigidTransform:
    """Returns X_TB: the fingertips end above the plate."""
    above = scenario.part.surface + scenario.gripper.fingertip_gap
    X_CT, X_CTip = (
        frame.GetFixedPoseInBodyFrame() for frame in (models.frame_T, models.frame_tip)
    )
    tip = (X_CT.inverse() @ X_CTip).translation()[2]
    return RigidTransform(grasp_rotation(), [0.0, 0.0, above + tip])

"""A scenario's arm in a plant: on its base, with its drives."""

import dataclasses

from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, ModelInstanceIndex, WeldJoint

from drake_disasm.cell.arm_description import ArmChain, find_chain, per_joint
from drake_disasm.cell.arm_drives import complete_drives
from drake_disasm.cell.parsing import add_model
from drake_disasm.common.errors import DisasmError
from drake_disasm.scenario import ArmConfig


@dataclasses.dataclass(frozen=True)
class ArmModel:
    """Handles of an arm in a plant.

    Attributes:
        instance: of its model.
        base: the frame that stands.
        frame_F: its flange.
        joints: names of its driven joints, from base to flange.
        held: names of the model's other movable joints, which are held at zero.
        has_assumed_drives: whether the file leaves out something of the drives.
    """

    instance: ModelInstanceIndex
    base: Frame
    frame_F: Frame
    joints: tuple[str, ...]
    held: tuple[str, ...]
    has_assumed_drives: bool


def add_arm(plant: MultibodyPlant, arm: ArmConfig) -> ArmModel:
    """Adds the arm with its base on the world's origin, or where its file fixes it.

    Args:
        plant: not yet finalized.
        arm: names the file, its links and joints.

    Raises:
        DisasmError: the file is missing, or is not an arm that a station can take.
    """
    constraints = plant.num_constraints()
    instance = add_model(plant, arm.model)
    chain = find_chain(plant, instance, arm)
    if plant.num_constraints() > constraints:
        raise DisasmError(
            f"arm.model: {arm.model} has a joint that follows another; take its "
            "<mimic> out"
        )
    _refuse_other_lengths(arm, len(chain.joints))
    held = tuple(joint.name() for joint in chain.held)
    _hold(plant, chain)
    _stand(plant, instance, chain, arm)
    assumed = complete_drives(plant, instance, chain.joints, arm)
    names = tuple(joint.name() for joint in chain.joints)
    return ArmModel(instance, chain.base, chain.flange, names, held, assumed)


def arm_joints(arm: ArmConfig) -> tuple[str, ...]:
    """Returns the names of an arm's joints from its base, if a station can take it.

    Raises:
        DisasmError: as of `add_arm`.
    """
    return add_arm(MultibodyPlant(0.0), arm).joints


def _refuse_other_lengths(arm: ArmConfig, joints: int) -> None:
    """Refuses lists of another number of values than the arm has joints."""
    per_joint(arm.posture, joints, "arm.posture")
    if arm.control == "position":
        per_joint(arm.stiffness, joints, "arm.stiffness")
    if arm.control == "joint_impedance":
        per_joint(
            arm.joint_impedance.stiffness, joints, "arm.joint_impedance.stiffness"
        )


def _hold(plant: MultibodyPlant, chain: ArmChain) -> None:
    """Puts welds in the place of joints that are held at zero."""
    indices = {joint.index() for joint in chain.held}
    for index in plant.GetJointActuatorIndices():
        if plant.get_joint_actuator(index).joint().index() in indices:
            plant.RemoveJointActuator(plant.get_joint_actuator(index))
    for joint in chain.held:
        parent, child = joint.frame_on_parent(), joint.frame_on_child()
        plant.RemoveJoint(joint)
        plant.WeldFrames(parent, child)


def _stand(
    plant: MultibodyPlant, instance: ModelInstanceIndex, chain: ArmChain, arm: ArmConfig
) -> None:
    """Welds the base to the world's origin, unless the file holds it already."""
    joints = [plant.get_joint(index) for index in plant.GetJointIndices(instance)]
    by_child = {joint.child_body().index(): joint for joint in joints}
    root, X_RootBase = chain.base.body(), chain.base.GetFixedPoseInBodyFrame()
    if root.index() not in by_child:
        plant.WeldFrames(plant.world_frame(), chain.base)
        return
    while root.index() in by_child:
        joint = by_child[root.index()]
        X_RootBase = _fixed_pose(joint) @ X_RootBase
        root = joint.parent_body()
    if root.index() != plant.world_body().index():
        plant.WeldFrames(plant.world_frame(), root.body_frame(), X_RootBase.inverse())


def _fixed_pose(joint: Joint) -> RigidTransform:
    """Returns the pose of a weld's child body in its parent body."""
    assert isinstance(joint, WeldJoint)  # what moves before the base is held
    X_PF = joint.frame_on_parent().GetFixedPoseInBodyFrame()
    X_CM = joint.frame_on_child().GetFixedPoseInBodyFrame()
    return X_PF @ joint.X_FM() @ X_CM.inverse()

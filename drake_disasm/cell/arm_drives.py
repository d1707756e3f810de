"""The drives of an arm's joints, with what its model file leaves out."""

import dataclasses
import functools
import math
import warnings
from collections.abc import Sequence
from xml.etree import ElementTree

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint, JointActuator, ModelInstanceIndex

from drake_disasm.cell.arm_description import names_of, refuse
from drake_disasm.common.errors import DisasmWarning
from drake_disasm.common.resources import model_path
from drake_disasm.scenario import ArmConfig

#: Reflected inertia that is assumed of a drive [kg m^2 per N m of its effort limit].
#: iiwa 14: 0.011 to 0.029; Franka FR3: 0.005 to 0.017.
INERTIA_PER_EFFORT = 0.01
#: Assumed of a drive without an effort limit [kg m^2].
INERTIA_UNLIMITED = 1.0


class AssumedDrivesWarning(DisasmWarning):
    """An arm's model file leaves out something of its drives, which is assumed."""


@dataclasses.dataclass(frozen=True)
class _Drive:
    """A drive as the file states it; a gear and rotor of zero are not stated."""

    effort_limit: float
    rotor_inertia: float = 0.0
    gear_ratio: float = 1.0


def complete_drives(
    plant: MultibodyPlant,
    instance: ModelInstanceIndex,
    joints: Sequence[Joint],
    arm: ArmConfig,
) -> bool:
    """Gives each joint one drive with rotor inertia, in the joints' order.

    Says once by an AssumedDrivesWarning what the file leaves out: a drive then has the
    joint's effort limit, and a reflected inertia of 0.01 kg m^2 for each N m of it.

    Args:
        plant: with the arm, not yet finalized.
        instance: of the arm.
        joints: that are driven, from base to flange.
        arm: whose model it is.

    Returns:
        Whether anything had to be assumed.

    Raises:
        DisasmError: a joint has two drives, or neither a drive nor an effort limit.
    """
    stated = _stated(plant, instance)
    _refuse_second_drives(stated, joints, arm)
    driven = [drive.joint().name() for drive in stated]
    missing = [joint for joint in joints if joint.name() not in driven]
    if driven != [joint.name() for joint in joints]:
        _drive_in_order(plant, stated, joints, _efforts(arm, missing))
    still = [
        drive
        for drive in _stated(plant, instance)
        if not drive.default_reflected_inertia() > 0.0
    ]
    for drive in still:
        drive.set_default_gear_ratio(1.0)
        drive.set_default_rotor_inertia(_assumed_inertia(drive.effort_limit()))
    if still:
        _warn(arm.model, names_of(missing), names_of([d.joint() for d in still]))
    return bool(missing or still)


def _stated(plant: MultibodyPlant, instance: ModelInstanceIndex) -> list[JointActuator]:
    """Returns the actuators of a model, in the plant's order."""
    actuators = map(plant.get_joint_actuator, plant.GetJointActuatorIndices())
    return [each for each in actuators if each.model_instance() == instance]


def _refuse_second_drives(
    drives: Sequence[JointActuator], joints: Sequence[Joint], arm: ArmConfig
) -> None:
    driven = [drive.joint().name() for drive in drives]
    twice = [joint for joint in joints if driven.count(joint.name()) > 1]
    if twice:
        refuse(
            arm, f"states two drives of {names_of(twice)}", "keep one <transmission>"
        )


def _drive_in_order(
    plant: MultibodyPlant,
    stated: Sequence[JointActuator],
    joints: Sequence[Joint],
    efforts: dict[str, float],
) -> None:
    """Replaces a model's drives by one for each joint, in the joints' order.

    Args:
        stated: the drives of the file.
        efforts: limits [N m] of the joints that it states no drive of.
    """
    drives = {name: _Drive(limit) for name, limit in efforts.items()}
    for drive in stated:
        drives[drive.joint().name()] = _Drive(
            drive.effort_limit(),
            drive.default_rotor_inertia(),
            drive.default_gear_ratio(),
        )
        plant.RemoveJointActuator(drive)
    for joint in joints:
        drive = drives[joint.name()]
        added = plant.AddJointActuator(joint.name(), joint, drive.effort_limit)
        added.set_default_rotor_inertia(drive.rotor_inertia)
        added.set_default_gear_ratio(drive.gear_ratio)


def _efforts(arm: ArmConfig, joints: Sequence[Joint]) -> dict[str, float]:
    """Returns the effort limits [N m] that a URDF states of joints without a drive."""
    if not joints:
        return {}
    root = ElementTree.parse(model_path(arm.model)).getroot()
    limits = {each.get("name"): each.find("limit") for each in root.iter("joint")}
    efforts = {}
    for joint in joints:
        limit = limits.get(joint.name())
        effort = _number(limit.get("effort")) if limit is not None else 0.0
        if not effort > 0.0:
            refuse(
                arm,
                f"states neither a drive nor an effort limit of {joint.name()}",
                "add effort to the joint's <limit>",
            )
        efforts[joint.name()] = effort
    return efforts


def _number(text: str | None) -> float:
    try:
        return float(text or 0.0)
    except ValueError:
        return 0.0


def _assumed_inertia(effort_limit: float) -> float:
    """Returns the reflected inertia [kg m^2] that is assumed of a drive."""
    if not math.isfinite(effort_limit):
        return INERTIA_UNLIMITED
    return INERTIA_PER_EFFORT * effort_limit


@functools.cache  # once for each file, however often it is read
def _warn(url: str, missing: str, still: str) -> None:
    no_drive = f"no drive of {missing} and " if missing else ""
    warnings.warn(
        f"arm.model: {url} states {no_drive}no rotor inertia of {still}; assumed: the "
        f"joints' effort limits, and {INERTIA_PER_EFFORT:g} kg m^2 of reflected "
        "inertia for each N m of them (<drake:rotor_inertia> states it)",
        AssumedDrivesWarning,
        stacklevel=2,
    )

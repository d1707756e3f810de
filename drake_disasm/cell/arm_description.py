"""What the model file of a scenario's arm has to describe.

A station's arm is a chain of at least six revolute joints from its base to its flange.
Anything else is refused as soon as the file is read, by each station in the same words.
"""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, ModelInstanceIndex, RigidBody

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.scenario import ArmConfig

_LEAST_JOINTS = 6  # to hold a bolt at any pose


@dataclasses.dataclass(frozen=True)
class ArmChain:
    """The part of a model that is the arm, before the plant is finalized.

    Attributes:
        base, flange: its ends.
        joints: the driven ones, from base to flange.
        held: other movable joints of the model, which the scenario leaves out.
    """

    base: Frame
    flange: Frame
    joints: tuple[Joint, ...]
    held: tuple[Joint, ...]


def find_chain(
    plant: MultibodyPlant, instance: ModelInstanceIndex, arm: ArmConfig
) -> ArmChain:
    """Returns the arm in a model, and refuses one that no station can take.

    Args:
        plant: with the model, which nothing is fixed to, not yet finalized.
        instance: of the model.
        arm: names base, flange and joints.

    Raises:
        DisasmError: names the key and the file, what it lacks, and the remedy.
    """
    joints = [plant.get_joint(index) for index in plant.GetJointIndices(instance)]
    links = [plant.get_body(index) for index in plant.GetBodyIndices(instance)]
    base, flange = (
        _end(plant, instance, arm, links, key) for key in ("base", "flange")
    )
    way = _way(arm, joints, base, flange)
    moving = [joint for joint in joints if joint.num_velocities() > 0]
    driven = _driven(arm, moving, [joint for joint in way if joint in moving])
    held = [joint for joint in moving if joint not in driven]
    _refuse_other_joints(arm, driven)
    if not sum(link.default_mass() for link in links) > 0.0:
        refuse(arm, "states no mass of any link", "add an <inertial> to its links")
    return ArmChain(base, flange, tuple(driven), tuple(held))


def per_joint(values: Sequence[float], joints: int, key: str) -> np.ndarray:
    """Returns a list of the scenario as an array (joints,); one value is for all.

    Args:
        values: as the scenario has them.
        joints: of the arm.
        key: of the scenario, for the message.

    Raises:
        DisasmError: the list has another number of values.
    """
    if len(values) not in (1, joints):
        raise DisasmError(
            f"{key}: {len(values)} values given, and the arm has {joints} joints; give "
            f"{joints}, or [one] for all"
        )
    return np.full(joints, values[0]) if len(values) == 1 else np.array(values)


def refuse_unlimited_arm(joints: Sequence[Joint], url: str) -> None:
    """Refuses an arm that states no limits, for a station that keeps a real one safe.

    Args:
        joints: of the arm.
        url: of its file, for the message.

    Raises:
        DisasmError: names the first joint without a limit of position or velocity.
    """
    for joint in joints:
        positions = joint.position_lower_limits(), joint.position_upper_limits()
        velocities = joint.velocity_lower_limits(), joint.velocity_upper_limits()
        for what, limits in (("position", positions), ("velocity", velocities)):
            if not all(math.isfinite(value) for each in limits for value in each):
                raise DisasmError(
                    f"arm.model: {url} states no {what} limit of joint "
                    f"'{joint.name()}', and hardware's safety limits are made of it; "
                    "add it to the joint's <limit>"
                )


def refuse(arm: ArmConfig, fault: str, remedy: str) -> None:
    """Raises DisasmError about the model of an arm.

    Args:
        arm: whose file it is.
        fault: what the file does, after its name.
        remedy: what to do.
    """
    raise DisasmError(f"arm.model: {arm.model} {fault}; {remedy}")


def names_of(elements: Sequence[Joint] | Sequence[RigidBody]) -> str:
    """Returns the names of joints or links, for a message."""
    return ", ".join(element.name() for element in elements)


def _end(
    plant: MultibodyPlant,
    instance: ModelInstanceIndex,
    arm: ArmConfig,
    links: list[RigidBody],
    key: str,
) -> Frame:
    """Returns the base or the flange, or refuses its name and gives the nearest."""
    name = getattr(arm, key)
    if plant.HasFrameNamed(name, instance):
        return plant.GetFrameByName(name, instance)
    raise DisasmError(
        f"arm.{key}: {arm.model} has no link '{name}'; "
        f"{closest(name, [link.name() for link in links])}"
    )


def _way(
    arm: ArmConfig, joints: Sequence[Joint], base: Frame, flange: Frame
) -> list[Joint]:
    """Returns the joints that lead from the base to the flange, in this order."""
    by_child = {joint.child_body().index(): joint for joint in joints}
    way: list[Joint] = []
    link = flange.body().index()
    while link != base.body().index():
        if link not in by_child:
            raise DisasmError(
                f"arm.flange: no joints of {arm.model} lead from '{arm.base}' "
                f"(arm.base) to '{arm.flange}'; name the link that stands, and the one "
                "that carries the tool"
            )
        way.insert(0, by_child[link])
        link = way[0].parent_body().index()
    return way


def _driven(arm: ArmConfig, moving: list[Joint], way: list[Joint]) -> list[Joint]:
    """Returns the joints that the scenario lists, or all movable ones on the way."""
    if not arm.joints:
        loose = [joint for joint in moving if joint not in way]
        if loose:
            refuse(
                arm,
                f"has movable joints elsewhere than between '{arm.base}' and "
                f"'{arm.flange}' ({names_of(loose)})",
                "list the arm's own in arm.joints, which holds all others at zero",
            )
        return way
    between = [joint.name() for joint in way]
    known = [joint.name() for joint in moving]
    for name in arm.joints:
        if name not in known:
            raise DisasmError(
                f"arm.joints: {arm.model} has no movable joint '{name}'; "
                f"{closest(name, known)}"
            )
        if name not in between:
            raise DisasmError(
                f"arm.joints: '{name}' is not between '{arm.base}' and '{arm.flange}' "
                f"in {arm.model}; take it out, or name other links in arm.base and "
                "arm.flange"
            )
    in_order = [name for name in between if name in arm.joints]
    if arm.joints != in_order:
        raise DisasmError(
            f"arm.joints: not once each from base to flange; give "
            f"[{', '.join(in_order)}]"
        )
    return [joint for joint in way if joint.name() in arm.joints]


def _refuse_other_joints(arm: ArmConfig, joints: Sequence[Joint]) -> None:
    """Refuses joints of another number or kind than a station's."""
    if len(joints) < _LEAST_JOINTS:
        names = f" ({names_of(joints)})" if joints else ""
        refuse(
            arm,
            f"has {len(joints)} driven joints from '{arm.base}' to '{arm.flange}'"
            f"{names}; a station's arm has {_LEAST_JOINTS} or more",
            "give such an arm (excite, import-log, identify and close-loop take any, "
            "by its URDF)",
        )
    for joint in joints:
        if joint.type_name() != "revolute":
            refuse(
                arm,
                f"has the {joint.type_name()} joint '{joint.name()}'; all joints of a "
                "station's arm are revolute",
                "list the others in arm.joints, or give another arm",
            )

"""What the model file of a scenario's arm has to describe.

A station's arm has seven revolute joints in a chain from its base to its flange, each
with one drive whose rotor has inertia. Anything else is refused as soon as the file is
read, by every station in the same words.
"""

import dataclasses
import math
from collections.abc import Sequence
from typing import Self

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BodyIndex,
    Frame,
    Joint,
    JointActuator,
    ModelInstanceIndex,
    RigidBody,
)

from drake_disasm.common.errors import DisasmError

#: Links, or frames, of the arm that the world and the tool are fixed to.
BASE, FLANGE = "iiwa_link_0", "iiwa_link_ee"

_JOINTS = 7  # of the ports, and of the scenario's lists
_EXAMPLE = "see models/iiwa14/iiwa14.urdf"


@dataclasses.dataclass(frozen=True)
class _Arm:
    """What a plant has of an arm, before it is finalized.

    Attributes:
        links: of its model instance.
        joints: all of them.
        moving: the joints that move.
        drives: the joints' actuators, in their order in the plant.
        ends: base and flange, as far as there are any, by name.
    """

    links: list[RigidBody]
    joints: list[Joint]
    moving: list[Joint]
    drives: list[JointActuator]
    ends: dict[str, Frame]

    @classmethod
    def of(cls, plant: MultibodyPlant, arm: ModelInstanceIndex) -> Self:
        """Returns the arm that is a plant's model instance."""
        joints = [plant.get_joint(index) for index in plant.GetJointIndices(arm)]
        actuators = map(plant.get_joint_actuator, plant.GetJointActuatorIndices())
        return cls(
            [plant.get_body(index) for index in plant.GetBodyIndices(arm)],
            joints,
            [joint for joint in joints if joint.num_velocities() > 0],
            [each for each in actuators if each.model_instance() == arm],
            {
                name: plant.GetFrameByName(name, arm)
                for name in (BASE, FLANGE)
                if plant.HasFrameNamed(name, arm)
            },
        )


def refuse_unfit_arm(plant: MultibodyPlant, arm: ModelInstanceIndex, url: str) -> None:
    """Refuses an arm that no station can take.

    Args:
        plant: with the arm, which nothing is fixed to, not yet finalized.
        arm: its model instance.
        url: of its file, for the message.

    Raises:
        DisasmError: names the file, what it lacks, and the remedy.
    """
    found = _Arm.of(plant, arm)
    _refuse_other_joints(found, url)
    _refuse_missing_links(found, url)
    _refuse_broken_chain(found, url)
    _refuse_missing_drives(found, url)
    _refuse_missing_rotors(found, url)
    _refuse_weightless(found, url)


def refuse_unlimited_arm(
    plant: MultibodyPlant, arm: ModelInstanceIndex, url: str
) -> None:
    """Refuses an arm that states no limits, for a station that keeps a real one safe.

    Args:
        plant: with the arm.
        arm: its model instance.
        url: of its file, for the message.

    Raises:
        DisasmError: names the first joint without a limit of position or velocity.
    """
    for index in plant.GetJointIndices(arm):
        joint = plant.get_joint(index)
        positions = joint.position_lower_limits(), joint.position_upper_limits()
        velocities = joint.velocity_lower_limits(), joint.velocity_upper_limits()
        for what, limits in (("position", positions), ("velocity", velocities)):
            if not all(math.isfinite(value) for each in limits for value in each):
                _refuse(
                    url,
                    f"states no {what} limit of joint '{joint.name()}', and hardware's "
                    "safety limits are made of it",
                    "add it to the joint's <limit>",
                )


def _refuse(url: str, fault: str, remedy: str) -> None:
    raise DisasmError(f"arm.model: {url} {fault}; {remedy}")


def _refuse_other_joints(arm: _Arm, url: str) -> None:
    """Refuses an arm of another number or kind of joints than a station's."""
    if len(arm.moving) != _JOINTS:
        names = f" ({_names(arm.moving)})" if arm.moving else ""
        more = ', or make the others type="fixed"' if len(arm.moving) > _JOINTS else ""
        _refuse(
            url,
            f"has {len(arm.moving)} movable joints{names}; a station's arm has "
            f"{_JOINTS}",
            f"give such an arm{more} (excite, import-log, identify and close-loop take "
            "any arm, by its URDF)",
        )
    for joint in arm.moving:
        if joint.type_name() != "revolute":
            _refuse(
                url,
                f"has the {joint.type_name()} joint '{joint.name()}'; all joints of a "
                "station's arm are revolute",
                "give such an arm",
            )


def _refuse_missing_links(arm: _Arm, url: str) -> None:
    """Refuses an arm without the links that it is held by, and names their likes."""
    held = {joint.child_body().name() for joint in arm.joints}
    holding = {joint.parent_body().name() for joint in arm.joints}
    roots = [link for link in arm.links if link.name() not in held]
    tips = [link for link in arm.links if link.name() not in holding]
    missing = [
        f"no link '{name}' for its {meaning}: {_names(ends)})"
        for name, meaning, ends in (
            (BASE, "base (root", roots),
            (FLANGE, "flange (tip", tips),
        )
        if name not in arm.ends
    ]
    if missing:
        _refuse(
            url,
            f"has {' and '.join(missing)}",
            "rename it, or add one of that name by a fixed joint (a flange's z points "
            "out of the arm)",
        )


def _refuse_broken_chain(arm: _Arm, url: str) -> None:
    """Refuses joints that do not lead from the base to the flange in their order."""
    chain = _chain(arm)
    loose = [joint for joint in arm.moving if joint not in chain]
    base = arm.ends[BASE].body().index()
    if not loose and chain[0].parent_body().index() != base:
        loose = chain[:1]
    if loose:
        _refuse(
            url,
            f"has {_names(loose)} elsewhere than between '{BASE}' and '{FLANGE}'",
            "put the base before the first joint, and the flange behind the last",
        )
    on_world = [j for j in arm.joints if j.parent_body().index() == BodyIndex(0)]
    if on_world:
        _refuse(
            url,
            f"fixes the arm to the world by joint '{on_world[0].name()}', and a "
            f"station puts '{BASE}' on the world's origin itself",
            "take that joint and the link 'world' out",
        )


def _chain(arm: _Arm) -> list[Joint]:
    """Returns the joints that lead from the base to the flange, as far as they do."""
    base, flange = (arm.ends[name].body().index() for name in (BASE, FLANGE))
    by_child = {joint.child_body().index(): joint for joint in arm.joints}
    found: list[Joint] = []
    link = flange
    while link != base and link in by_child:
        found.insert(0, by_child[link])
        link = found[0].parent_body().index()
    return found


def _refuse_missing_drives(arm: _Arm, url: str) -> None:
    """Refuses joints without a drive of their own, and drives in another order."""
    driven = [drive.joint().name() for drive in arm.drives]
    joints = [joint for joint in _chain(arm) if joint.num_velocities() > 0]
    for count, fault, remedy in (
        (0, "no drive", "add a <transmission> with an <actuator>, and an effort limit"),
        (2, "two drives", "keep one <transmission>"),
    ):
        wrong = [j for j in joints if min(driven.count(j.name()), 2) == count]
        if wrong:
            _refuse(url, f"states {fault} of {_names(wrong)}", f"{remedy}; {_EXAMPLE}")
    if driven != [joint.name() for joint in joints]:
        _refuse(
            url,
            f"lists its <transmission>s as {', '.join(driven)}, and the joints are "
            f"{_names(joints)}",
            "bring them into one order",
        )


def _refuse_missing_rotors(arm: _Arm, url: str) -> None:
    still = [d.joint() for d in arm.drives if not d.default_reflected_inertia() > 0.0]
    if still:
        _refuse(
            url,
            f"states no rotor inertia of {_names(still)}",
            'add <drake:rotor_inertia value="..."/> [kg m^2] and '
            f'<drake:gear_ratio value="..."/> to the <actuator>; {_EXAMPLE}',
        )


def _refuse_weightless(arm: _Arm, url: str) -> None:
    if not sum(link.default_mass() for link in arm.links) > 0.0:
        _refuse(url, "states no mass of any link", "add an <inertial> to its links")


def _names(elements: Sequence[Joint] | Sequence[RigidBody]) -> str:
    return ", ".join(element.name() for element in elements)

"""An arm of a URDF as a Drake plant, welded to the world at its base."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import PrismaticJoint, RigidBody

from drake_disasm.cell.parsing import add_model, weld_root
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.common.resources import ONE_JOINT_MODELS


@dataclass(frozen=True)
class ArmPlant:
    """An arm.

    Attributes:
        plant: finalized, with the arm alone.
        bodies: its links, in the URDF's order.
        columns: index of each actuated joint among the plant's velocities.
    """

    plant: MultibodyPlant
    bodies: list[RigidBody]
    columns: list[int]

    @classmethod
    def of(
        cls, urdf: str, joints: Sequence[str], gravity: Sequence[float] | None = None
    ) -> Self:
        """Returns the arm of a URDF.

        Args:
            urdf: a path, or `package://`.
            joints: names of the actuated joints, in the order of a log's columns;
                that of a packaged model of one joint may have any.
            gravity: (3,) in the base's frame [m/s^2]; None for an arm that stands
                upright.

        Raises:
            DisasmError: the URDF lacks one of them.
        """
        plant = MultibodyPlant(0.0)
        if gravity is not None:
            plant.mutable_gravity_field().set_gravity_vector(gravity)
        instance = add_model(plant, urdf)
        bodies = [plant.get_body(i) for i in plant.GetBodyIndices(instance)]
        weld_root(plant, bodies)
        plant.Finalize()
        if len(joints) == 1 and urdf in ONE_JOINT_MODELS.values():
            return cls(plant, bodies, [0])
        return cls(plant, bodies, _velocity_columns(plant, joints, urdf))

    def prismatic(self, joints: Sequence[str]) -> frozenset[str]:
        """Returns the names of those joints that slide."""
        all_joints = [self.plant.get_joint(i) for i in self.plant.GetJointIndices()]
        slide = {
            joint.velocity_start()
            for joint in all_joints
            if joint.type_name() == PrismaticJoint.kTypeName
        }
        names = zip(joints, self.columns, strict=True)
        return frozenset(name for name, column in names if column in slide)

    def moved(self, joints: Sequence[str]) -> list[int]:
        """Returns the number of the link that each joint moves."""
        all_joints = [self.plant.get_joint(i) for i in self.plant.GetJointIndices()]
        children = {
            joint.velocity_start(): joint.child_body().index()
            for joint in all_joints
            if joint.num_velocities() == 1
        }
        numbers = {body.index(): number for number, body in enumerate(self.bodies)}
        pairs = zip(joints, self.columns, strict=True)
        return [numbers[children[column]] for _, column in pairs]

    @property
    def last_body(self) -> int:
        """The number of the link that is farthest from the base."""
        return _farthest(self.plant, self.bodies)


def _farthest(plant: MultibodyPlant, bodies: Sequence[RigidBody]) -> int:
    """Returns which body has the most joints, welds too, between it and the world."""
    joints = [plant.get_joint(i) for i in plant.GetJointIndices()]
    parents = {j.child_body().index(): j.parent_body().index() for j in joints}

    depths = []
    for body in bodies:
        index, depth = body.index(), 0
        while index in parents:
            index, depth = parents[index], depth + 1
        depths.append(depth)
    return int(np.argmax(depths))


def _velocity_columns(
    plant: MultibodyPlant, joints: Sequence[str], urdf: str
) -> list[int]:
    """Returns the index among the plant's velocities of each joint's."""
    known = {
        joint.name(): joint
        for joint in (plant.get_joint(i) for i in plant.GetJointIndices())
        if joint.num_velocities() == 1
    }
    for name in joints:
        if name not in known:
            raise DisasmError(
                f"{urdf}: has no joint '{name}', which the log has; "
                f"{closest(name, list(known))}"
            )
    return [known[name].velocity_start() for name in joints]

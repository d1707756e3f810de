"""What an arm must not do: joint limits, collisions with itself, and the floor."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import (
    CollisionFilterDeclaration,
    GeometryId,
    GeometrySet,
    QueryObject,
    SceneGraph,
)
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import BodyIndex, RigidBody
from pydrake.systems.framework import DiagramBuilder

from drake_disasm.cell.parsing import add_model, weld_root
from drake_disasm.common.errors import DisasmError

Array = NDArray[np.float64]

_POSTURES = 200  # random ones, to see which links are near by their very models
_ALWAYS = 0.95  # share of the postures
_NORM = 40  # p of the p-norm that stands for the greatest share
_FAR = 1.0  # m: clearance that is reported if nothing is nearer


@dataclasses.dataclass(frozen=True)
class JointLimits:
    """Limits of an arm's joints, (joints,) each, in SI.

    Attributes:
        names: of the joints.
        lower, upper: positions.
        velocity, acceleration, effort: greatest absolute values.
    """

    names: tuple[str, ...]
    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    effort: Array

    @classmethod
    def of_urdf(
        cls, urdf: str, joints: Sequence[str], acceleration: float, margin: float
    ) -> Self:
        """Returns the limits that a URDF states, less a margin.

        Args:
            urdf: a path, or `package://`.
            joints: their names.
            acceleration: greatest, where the URDF states none.
            margin: share of each joint's range that stays free at either end, and of
                its velocity, acceleration and effort.

        Raises:
            DisasmError: the URDF has no such joint, or states no position, velocity
                or effort limit for one.
        """
        builder = DiagramBuilder()
        plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
        add_model(plant, urdf)
        plant.Finalize()
        rows = [_stated(plant, name, acceleration, urdf) for name in joints]
        lower, upper, velocity, most_acceleration, effort = np.array(rows).T
        free = margin * (upper - lower)
        share = 1.0 - margin
        return cls(
            tuple(joints),
            lower + free,
            upper - free,
            share * velocity,
            share * most_acceleration,
            share * effort,
        )

    def largest(self, centre: Array, q: Array, v: Array, vd: Array) -> Array:
        """Returns the factor (joints,) by which a motion about a centre may grow.

        By a p-norm of its shares of the limits, not by the greatest share: that is
        somewhat less, and smooth, as a search by derivatives needs it.

        Args:
            centre: (joints,) within the limits.
            q, v, vd: (n, joints).
        """
        room = np.where(q > centre, self.upper - centre, centre - self.lower)
        shares = np.abs(
            np.concatenate(
                [(q - centre) / room, v / self.velocity, vd / self.acceleration]
            )
        )
        most = np.maximum(shares.max(axis=0), 1e-9)
        smooth = most * np.sum((shares / most) ** _NORM, axis=0) ** (1.0 / _NORM)
        return np.asarray(1.0 / smooth)


def _stated(
    plant: MultibodyPlant, name: str, acceleration: float, urdf: str
) -> tuple[float, ...]:
    """Returns a joint's limits in the order of `JointLimits`, all of them finite."""
    if not plant.HasJointNamed(name):
        raise DisasmError(f"{urdf}: has no joint '{name}'; give names of its joints")
    joint = plant.GetJointByName(name)
    actuators = map(plant.get_joint_actuator, plant.GetJointActuatorIndices())
    efforts = [a.effort_limit() for a in actuators if a.joint().name() == name]
    most = float(joint.acceleration_upper_limits()[0])
    found = {
        "lower position": float(joint.position_lower_limits()[0]),
        "upper position": float(joint.position_upper_limits()[0]),
        "velocity": float(joint.velocity_upper_limits()[0]),
        "acceleration": most if math.isfinite(most) else acceleration,
        "effort": float(min(efforts, default=math.inf)),
    }
    for what, value in found.items():
        if not math.isfinite(value):
            actuated = ", and a <transmission>" if what == "effort" else ""
            raise DisasmError(
                f"{urdf}: states no {what} limit of joint '{name}'; add it to the "
                f"joint's <limit>{actuated}"
            )
    return tuple(found.values())


class CollisionFreeSpace:
    """Clearance of an arm's links from each other, and their height over a floor.

    By the collision geometry of its URDF, whatever pairs that filters; links that a
    joint connects are left out, links that are fixed to each other, and pairs that are
    nearer than the clearance in almost all postures: they are so by their models.

    Attributes:
        has_geometry: whether there is any, so that clearance means something.

    Args:
        urdf: a path, or `package://`; its root is welded to the world.
        joints: names of the joints, in the order of q.
        limits: of which random postures are drawn.
        clearance: that links are to keep from each other [m].
    """

    def __init__(
        self,
        urdf: str,
        joints: Sequence[str],
        limits: JointLimits,
        clearance: float = 0.0,
    ) -> None:
        builder = DiagramBuilder()
        plant, self._scene = AddMultibodyPlantSceneGraph(builder, 0.0)
        instance = add_model(plant, urdf)
        links = [plant.get_body(i) for i in plant.GetBodyIndices(instance)]
        weld_root(plant, links)
        plant.Finalize()
        _allow_all_but_neighbours(plant, self._scene)
        self._plant, self._diagram = plant, builder.Build()
        self._root = self._diagram.CreateDefaultContext()
        self._context = plant.GetMyContextFromRoot(self._root)
        self._places = [plant.GetJointByName(n).position_start() for n in joints]
        welded = plant.GetBodiesWeldedTo(plant.world_body())
        self._moving = [link for link in links if link not in welded]
        self._ignored: frozenset[tuple[GeometryId, GeometryId]] = frozenset()
        pairs = self._scene.model_inspector().GetCollisionCandidates()
        self.has_geometry = bool(pairs)
        self._ignored = self._always_near(limits, clearance)

    def clearance(self, q: Array, most: float = _FAR) -> Array:
        """Returns the least distance [m] between links in postures (n, joints), (n,).

        Negative where they overlap, `most` where nothing is nearer.
        """
        return np.array([self._distance(posture, most) for posture in q])

    def height(self, q: Array) -> Array:
        """Returns the least height [m] of a moving link's origin, (n,)."""
        return np.array([self._height(posture) for posture in q])

    def _always_near(
        self, limits: JointLimits, clearance: float
    ) -> frozenset[tuple[GeometryId, GeometryId]]:
        if not self.has_geometry:
            return frozenset()
        random = np.random.default_rng(0)
        size = (_POSTURES, len(self._places))
        counts: dict[tuple[GeometryId, GeometryId], int] = {}
        for posture in random.uniform(limits.lower, limits.upper, size):
            self._set(posture)
            query = self._query()
            near = query.ComputeSignedDistancePairwiseClosestPoints(clearance)
            pairs = [*query.ComputePointPairPenetration(), *near]
            for key in {(pair.id_A, pair.id_B) for pair in pairs}:
                counts[key] = counts.get(key, 0) + 1
        return frozenset(k for k, n in counts.items() if n >= _ALWAYS * _POSTURES)

    def _distance(self, posture: Array, most: float) -> float:
        self._set(posture)
        query = self._query()
        hits = [
            -pair.depth
            for pair in query.ComputePointPairPenetration()
            if (pair.id_A, pair.id_B) not in self._ignored
        ]
        if hits:
            return float(min(hits))
        near = query.ComputeSignedDistancePairwiseClosestPoints(most)
        found = [
            pair.distance
            for pair in near
            if (pair.id_A, pair.id_B) not in self._ignored
        ]
        return float(min(found, default=most))

    def _height(self, posture: Array) -> float:
        self._set(posture)
        plant, context = self._plant, self._context
        return min(
            float(plant.EvalBodyPoseInWorld(context, link).translation()[2])
            for link in self._moving
        )

    def _set(self, posture: Array) -> None:
        full = self._plant.GetPositions(self._context).copy()
        full[self._places] = posture
        self._plant.SetPositions(self._context, full)

    def _query(self) -> QueryObject:
        context = self._scene.GetMyContextFromRoot(self._root)
        found: QueryObject = self._scene.get_query_output_port().Eval(context)
        return found


def _allow_all_but_neighbours(plant: MultibodyPlant, scene: SceneGraph) -> None:
    """Filters collisions of links that a joint connects or fixes, and no others."""

    def geometry_of(*bodies: RigidBody) -> GeometrySet:
        """Returns the collision geometry of links."""
        own = map(plant.GetCollisionGeometriesForBody, bodies)
        return GeometrySet([geometry for found in own for geometry in found])

    filters = scene.collision_filter_manager()
    bodies = [plant.get_body(BodyIndex(i)) for i in range(plant.num_bodies())]
    every = [g for b in bodies for g in plant.GetCollisionGeometriesForBody(b)]
    filters.Apply(CollisionFilterDeclaration().AllowWithin(GeometrySet(every)))
    for body in bodies:
        rigid = geometry_of(*plant.GetBodiesWeldedTo(body))
        filters.Apply(CollisionFilterDeclaration().ExcludeWithin(rigid))
    for index in plant.GetJointIndices():
        joint = plant.get_joint(index)
        pair = geometry_of(joint.parent_body()), geometry_of(joint.child_body())
        filters.Apply(CollisionFilterDeclaration().ExcludeBetween(*pair))

"""The part in a plant: bodies, geometry, and what changes in their Contexts."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from pydrake.geometry import (
    CollisionFilterDeclaration,
    GeometryId,
    GeometrySet,
    ProximityProperties,
    RoleAssign,
    SceneGraph,
)
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    RigidBody,
    SpatialInertia,
)
from pydrake.systems.framework import Context

from drake_disasm.effects import Environment
from drake_disasm.parts import ContactConfig, Part, Solid

_BRASS = np.array([0.80, 0.65, 0.30, 1.0])
_STEEL = np.array([0.55, 0.58, 0.62, 1.0])


@dataclasses.dataclass(frozen=True)
class Lock:
    """Handles of a part in a plant.

    Attributes:
        part: what it is.
        contact: what its bodies are made of.
        groove, bolt: the fixed and the moved body, whose frames are G and B.
        frame: the frame that the groove is welded to; its pose in Gn is a
            parameter of the plant's Context.
        groove_names, groove_ids: of its collision geometries.
        bolt_ids: collision geometries of the bolt that touch the groove, by name.
    """

    part: Part
    contact: ContactConfig
    groove: RigidBody
    bolt: RigidBody
    frame: FixedOffsetFrame
    groove_names: tuple[str, ...]
    groove_ids: tuple[GeometryId, ...]
    bolt_ids: dict[str, GeometryId]

    @property
    def environment(self) -> Environment:
        """Of the bolt, before effects."""
        return self.part.environment(self.contact)


def add_lock(
    plant: MultibodyPlant,
    frame_Gn: Frame,
    part: Part,
    contact: ContactConfig,
    environment: Environment | None = None,
    M_fixed: SpatialInertia | None = None,
) -> Lock:
    """Adds groove (welded to a movable frame in Gn) and bolt (free) to the plant.

    Args:
        plant: not yet finalized.
        frame_Gn: the groove's nominal frame.
        part: what they are.
        contact: what they are made of.
        environment: of the default Context; None is the nominal one.
        M_fixed: inertia of the groove about Go in G, for a sensor that weighs it.
    """
    actual = environment or part.environment(contact)
    frame = plant.AddFrame(FixedOffsetFrame("groove_pose", frame_Gn, actual.X_GnG))
    instance = plant.AddModelInstance("lock")
    M_G = M_fixed or SpatialInertia.Zero()  # it never moves
    groove = plant.AddRigidBody("groove", instance, M_G)
    plant.WeldFrames(frame, groove.body_frame())
    bolt = plant.AddRigidBody("bolt", plant.AddModelInstance("bolt"), part.M_moved_B)
    fixed, moved = part.fixed_solids(actual), part.moved_solids
    of_fixed = {name: part.fixed_material(name, actual) for name in fixed}
    of_moved = part.moved_materials(actual, contact.resolution)
    groove_ids = _add_geometry(plant, groove, fixed, of_fixed, _BRASS)
    bolt_ids = _add_geometry(plant, bolt, moved, of_moved, _STEEL)
    del bolt_ids["grip"]
    names, ids = tuple(groove_ids), tuple(groove_ids.values())
    return Lock(part, contact, groove, bolt, frame, names, ids, bolt_ids)


def reshape_groove(
    lock: Lock, environment: Environment, scene_graph: SceneGraph, context: Context
) -> None:
    """Gives the groove an environment's dimensions in a scene graph's Context.

    Only the size of the shapes changes; call `set_environment` next, which rebuilds
    the proximity representation with the material.

    Args:
        lock: whose groove.
        environment: which may have reshaped it.
        scene_graph: that the groove is registered with.
        context: of the scene graph.
    """
    source = lock.groove.GetParentPlant().get_source_id()
    solids = lock.part.fixed_solids(environment).values()
    for geometry_id, (X_GP, shape) in zip(lock.groove_ids, solids, strict=True):
        scene_graph.ChangeShape(context, source, geometry_id, shape, X_GP)
    # A changed shape is as if new: it would meet the others of its own body.
    filters = scene_graph.collision_filter_manager(context)
    own = CollisionFilterDeclaration().ExcludeWithin(GeometrySet(lock.groove_ids))
    filters.Apply(own)


def set_environment(
    lock: Lock,
    environment: Environment,
    plant_context: Context,
    scene_graph: SceneGraph,
    scene_graph_context: Context,
) -> None:
    """Writes the environment into plant's and scene graph's Contexts.

    All but its clearance, which `reshape_groove` writes.
    """
    set_pose(lock, environment, plant_context)
    source, part = lock.groove.GetParentPlant().get_source_id(), lock.part
    moved = part.moved_materials(environment, lock.contact.resolution)
    materials = [
        (geometry_id, part.fixed_material(name, environment))
        for name, geometry_id in zip(lock.groove_names, lock.groove_ids, strict=True)
    ]
    materials += [
        (geometry_id, moved[name]) for name, geometry_id in lock.bolt_ids.items()
    ]
    for geometry_id, material in materials:
        scene_graph.AssignRole(
            scene_graph_context, source, geometry_id, material, RoleAssign.kReplace
        )


def set_pose(lock: Lock, environment: Environment, plant_context: Context) -> None:
    """Writes the environment's pose alone into a plant's Context."""
    lock.frame.SetPoseInParentFrame(plant_context, environment.X_GnG)


def _add_geometry(
    plant: MultibodyPlant,
    body: RigidBody,
    solids: Mapping[str, Solid],
    materials: Mapping[str, ProximityProperties],
    colour: np.ndarray,
) -> dict[str, GeometryId]:
    """Returns the collision geometries of a body's solids, by name."""
    ids = {}
    for name, (X_BP, shape) in solids.items():
        plant.RegisterVisualGeometry(body, X_BP, shape, f"{name}_visual", colour)
        ids[name] = plant.RegisterCollisionGeometry(
            body, X_BP, shape, name, materials[name]
        )
    return ids

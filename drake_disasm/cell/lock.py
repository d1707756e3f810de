"""The door-chain lock: groove and bolt, built into a plant from dimensions."""

import dataclasses

import numpy as np
from pydrake.geometry import Box, GeometryId, RoleAssign, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, Frame, RigidBody
from pydrake.systems.framework import Context

from drake_disasm.cell.lock_dimensions import (
    bolt_inertia,
    bolt_parts,
    groove_boxes,
    groove_inertia,
)
from drake_disasm.cell.lock_materials import (
    bolt_materials,
    grip_material,
    groove_material,
)
from drake_disasm.effects import Environment
from drake_disasm.scenario import ContactConfig, LockConfig

_BRASS = np.array([0.80, 0.65, 0.30, 1.0])
_STEEL = np.array([0.55, 0.58, 0.62, 1.0])


@dataclasses.dataclass(frozen=True)
class Lock:
    """Handles of the lock in a plant.

    Attributes:
        config: its dimensions.
        groove, bolt: bodies whose frames are G and B.
        frame: the frame that the groove is welded to; its pose in Gn is a
            parameter of the plant's Context.
        groove_ids: collision geometries of the groove.
        bolt_ids: collision geometries of the bolt's "neck" and "head".
        resolution: edge length on the bolt's mesh [m].
        nominal: the environment that the scenario denotes before effects.
    """

    config: LockConfig
    groove: RigidBody
    bolt: RigidBody
    frame: FixedOffsetFrame
    groove_ids: tuple[GeometryId, ...]
    bolt_ids: dict[str, GeometryId]
    resolution: float
    nominal: Environment


def add_lock(
    plant: MultibodyPlant,
    frame_Gn: Frame,
    lock: LockConfig,
    contact: ContactConfig,
    environment: Environment | None = None,
) -> Lock:
    """Adds groove (welded to a movable frame in Gn) and bolt (free) to the plant.

    Args:
        plant: not yet finalized.
        frame_Gn: the groove's nominal frame.
        lock: dimensions.
        contact: what bolt and groove are made of.
        environment: of the default Context; None is the nominal one.
    """
    nominal = nominal_environment(lock, contact)
    actual = environment or nominal
    frame = plant.AddFrame(FixedOffsetFrame("groove_pose", frame_Gn, actual.X_GnG))
    groove = plant.AddRigidBody(
        "groove", plant.AddModelInstance("lock"), groove_inertia(lock)
    )
    plant.WeldFrames(frame, groove.body_frame())
    bolt = plant.AddRigidBody(
        "bolt", plant.AddModelInstance("bolt"), bolt_inertia(lock)
    )
    shape = dataclasses.replace(lock, clearance=actual.clearance)
    groove_ids = _add_groove_geometry(plant, groove, shape, actual)
    bolt_ids = _add_bolt_geometry(plant, bolt, lock, contact, actual)
    return Lock(
        lock, groove, bolt, frame, groove_ids, bolt_ids, contact.resolution, nominal
    )


def nominal_environment(lock: LockConfig, contact: ContactConfig) -> Environment:
    """Returns the environment that a scenario denotes before effects."""
    return Environment(
        X_GnG=RigidTransform(),
        friction=contact.friction,
        modulus=contact.modulus,
        head_modulus=contact.head_modulus,
        dissipation=contact.dissipation,
        clearance=lock.clearance,
        impact_stiffness=contact.impact.stiffness,
        impact_exponent=contact.impact.exponent,
    )


def reshape_groove(
    lock: Lock, config: LockConfig, scene_graph: SceneGraph, context: Context
) -> None:
    """Gives the groove other dimensions in a scene graph's Context, in place.

    Only the size of the shapes changes; call `set_environment` next, which rebuilds
    the proximity representation with the material.

    Args:
        lock: whose groove.
        config: may differ from the lock's in GROOVE_FIELDS alone.
        scene_graph: that the groove is registered with.
        context: of the scene graph.
    """
    source = lock.groove.GetParentPlant().get_source_id()
    for geometry_id, (low, high) in zip(
        lock.groove_ids, groove_boxes(config).values(), strict=True
    ):
        X_GP = RigidTransform((low + high) / 2)
        shape = Box(*(high - low))
        scene_graph.ChangeShape(context, source, geometry_id, shape, X_GP)


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
    source = lock.groove.GetParentPlant().get_source_id()
    materials = bolt_materials(environment, lock.config, lock.resolution)
    groove = groove_material(environment)
    changes = [(geometry_id, groove) for geometry_id in lock.groove_ids]
    changes += [(lock.bolt_ids[name], materials[name]) for name in materials]
    for geometry_id, properties in changes:
        scene_graph.AssignRole(
            scene_graph_context, source, geometry_id, properties, RoleAssign.kReplace
        )


def set_pose(lock: Lock, environment: Environment, plant_context: Context) -> None:
    """Writes the environment's pose alone into a plant's Context."""
    lock.frame.SetPoseInParentFrame(plant_context, environment.X_GnG)


def _add_groove_geometry(
    plant: MultibodyPlant, body: RigidBody, lock: LockConfig, environment: Environment
) -> tuple[GeometryId, ...]:
    properties = groove_material(environment)
    ids = []
    for name, (low, high) in groove_boxes(lock).items():
        X_GP, shape = RigidTransform((low + high) / 2), Box(*(high - low))
        ids.append(plant.RegisterCollisionGeometry(body, X_GP, shape, name, properties))
        plant.RegisterVisualGeometry(body, X_GP, shape, f"{name}_visual", _BRASS)
    return tuple(ids)


def _add_bolt_geometry(
    plant: MultibodyPlant,
    body: RigidBody,
    lock: LockConfig,
    contact: ContactConfig,
    environment: Environment,
) -> dict[str, GeometryId]:
    """Returns the collision geometries of neck and head by name."""
    materials = bolt_materials(environment, lock, contact.resolution)
    materials["grip"] = grip_material(contact.dissipation)
    ids = {}
    for name, X_BP, shape in bolt_parts(lock):
        plant.RegisterVisualGeometry(body, X_BP, shape, f"{name}_visual", _STEEL)
        ids[name] = plant.RegisterCollisionGeometry(
            body, X_BP, shape, name, materials[name]
        )
    del ids["grip"]
    return ids

"""The door-chain lock: groove and bolt, built into a plant from dimensions.

Frames: G has its origin at A, in the middle of the lips' thickness, x along the
groove, y out of the plate, z across. B is fixed to the bolt, its origin in the
middle of the neck; at the start of an episode B coincides with G.

The groove is rigid and the bolt's neck and head are compliant. Drake takes the
contact's normals from the rigid side: from the groove they are those of its flat
faces, while a rigid round neck would offer its facets' normals, and the discrete
solver then resists sliding by a tenth of the normal force at the shipped time step
even without friction (docs/physics.md).
"""

import dataclasses

import numpy as np
from pydrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    Box,
    Cylinder,
    GeometryId,
    ProximityProperties,
    RoleAssign,
    SceneGraph,
    Shape,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    RigidBody,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.framework import Context

from drake_disasm.effects import Environment
from drake_disasm.scenario import ContactConfig, LockConfig

#: Dimensions that shape the groove alone, not the bolt.
GROOVE_FIELDS = ("clearance", "channel_clearance", "keyhole_clearance", "travel")

_BORDER = 0.010  # m, solid rim around the channel
_FLOOR = 0.003  # m, plate under the channel
_FRICTION_STEP = 1e-4  # below the scatter of any measurement
_PAD_FRICTION = 0.8  # steel on rubber, as on the gripper's pads
_BRASS = np.array([0.80, 0.65, 0.30, 1.0])
_STEEL = np.array([0.55, 0.58, 0.62, 1.0])
_R_Y_AXIS = RotationMatrix.MakeXRotation(-np.pi / 2)  # a cylinder along y


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


def lip_height(config: LockConfig) -> float:
    """Returns y of the plate's upper face in G [m]."""
    return config.lip_thickness / 2


def head_top(config: LockConfig) -> float:
    """Returns y of the head's upper face in B [m]: half the axial play below."""
    return -config.lip_thickness / 2 - config.axial_clearance / 2


def grip_height(config: LockConfig) -> float:
    """Returns y of the grip's middle in B [m]."""
    return lip_height(config) + config.grip_standoff + config.grip_size[1] / 2


def plate_bottom(config: LockConfig) -> float:
    """Returns y of the plate's lower face in G [m]."""
    channel = config.head_thickness + config.axial_clearance
    return -lip_height(config) - channel - _FLOOR


def lift_needed(config: LockConfig, margin: float) -> float:
    """Returns the rise of B [m] at which the head's underside clears the plate.

    Args:
        margin: height of the underside above the plate's upper face [m].
    """
    underside = head_top(config) - config.head_thickness
    return lip_height(config) + margin - underside


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
        "groove", plant.AddModelInstance("lock"), _groove_inertia(lock)
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

    The shapes lose nothing but their size; `set_environment` is to follow, since
    the proximity representation is made anew with the material.

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
    materials = _bolt_materials(environment, lock.config, lock.resolution)
    groove = _groove_material(environment)
    changes = [(geometry_id, groove) for geometry_id in lock.groove_ids]
    changes += [(lock.bolt_ids[name], materials[name]) for name in materials]
    for geometry_id, properties in changes:
        scene_graph.AssignRole(
            scene_graph_context, source, geometry_id, properties, RoleAssign.kReplace
        )


def set_pose(lock: Lock, environment: Environment, plant_context: Context) -> None:
    """Writes the environment's pose alone into a plant's Context."""
    lock.frame.SetPoseInParentFrame(plant_context, environment.X_GnG)


def has_same_material(one: Environment, other: Environment) -> bool:
    """Returns whether environments differ in pose and pull alone, or not noticeably.

    Other materials are made anew in the scene graph, which takes milliseconds.
    """
    same = dataclasses.replace(
        other, X_GnG=one.X_GnG, force_Gn=one.force_Gn, friction=one.friction
    )
    return one == same and abs(one.friction - other.friction) < _FRICTION_STEP


def _surface(environment: Environment) -> ProximityProperties:
    """Returns what the surfaces of groove, neck and head have in common."""
    properties = ProximityProperties()
    AddContactMaterial(
        dissipation=environment.dissipation,
        friction=CoulombFriction(environment.friction, environment.friction),
        properties=properties,
    )
    # Speculative contact within a margin would be a quarter of the play here, and it
    # changes nothing but the speed (docs/physics.md).
    properties.AddProperty("hydroelastic", "margin", 0.0)
    return properties


def _groove_material(environment: Environment) -> ProximityProperties:
    properties = _surface(environment)
    AddRigidHydroelasticProperties(resolution_hint=1.0, properties=properties)
    return properties


def _bolt_materials(
    environment: Environment, lock: LockConfig, resolution: float
) -> dict[str, ProximityProperties]:
    """Returns the materials of neck and head by name.

    The head may be much softer and coarser than the neck: it touches with flat faces
    or where there is room, and only the neck's place in the slot asks for precision.
    """
    neck, head = _surface(environment), _surface(environment)
    neck_edge = facet_length(lock.neck_diameter, resolution)
    head_edge = facet_length(lock.head_diameter, 2 * resolution)
    AddCompliantHydroelasticProperties(neck_edge, environment.modulus, neck)
    AddCompliantHydroelasticProperties(head_edge, environment.head_modulus, head)
    return {"neck": neck, "head": head}


def facet_length(diameter: float, resolution: float) -> float:
    """Returns the edge length [m] that gives a cylinder a multiple of four facets.

    So vertices lie on the axis across the slot, where the play is measured: with a
    facet's middle there instead the neck would be thinner. Drake rounds the number
    of facets up, hence an edge slightly longer than the exact one.
    """
    facets = 4 * int(np.ceil(np.pi * diameter / (4 * resolution) - 1e-9))
    return np.pi * diameter / facets * (1 + 1e-6)


def groove_boxes(lock: LockConfig) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Returns the solid parts of the groove by name: two opposite corners in G [m].

    Two lips leave the slot for the neck and end where the keyhole begins; two
    walls and a floor form the channel for the head; stops close both ends.
    """
    slot = (lock.neck_diameter + lock.clearance) / 2
    wall = (lock.head_diameter + lock.channel_clearance) / 2
    rim = wall + _BORDER
    top = lip_height(lock)
    under_lip = -top
    floor = plate_bottom(lock) + _FLOOR
    half_hole = (lock.head_diameter + lock.keyhole_clearance) / 2
    start = -half_hole
    outer = start - _BORDER / 2
    hole, end = lock.travel - half_hole, lock.travel + half_hole
    far = end + _BORDER / 2
    corners = {
        "lip_left": ([outer, under_lip, slot], [hole, top, rim]),
        "lip_right": ([outer, under_lip, -rim], [hole, top, -slot]),
        "wall_left": ([outer, floor, wall], [far, under_lip, rim]),
        "wall_right": ([outer, floor, -rim], [far, under_lip, -wall]),
        "keyhole_left": ([hole, under_lip, wall], [far, top, rim]),
        "keyhole_right": ([hole, under_lip, -rim], [far, top, -wall]),
        "floor": ([outer, floor - _FLOOR, -rim], [far, floor, rim]),
        "stop_a": ([outer, floor, -wall], [start, under_lip, wall]),
        "stop_b": ([end, floor, -wall], [far, top, wall]),
    }
    return {name: (np.array(a), np.array(b)) for name, (a, b) in corners.items()}


def _add_groove_geometry(
    plant: MultibodyPlant, body: RigidBody, lock: LockConfig, environment: Environment
) -> tuple[GeometryId, ...]:
    properties = _groove_material(environment)
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
    materials = _bolt_materials(environment, lock, contact.resolution)
    materials["grip"] = _grip_material(contact.dissipation)
    ids = {}
    for name, X_BP, shape in _bolt_parts(lock):
        plant.RegisterVisualGeometry(body, X_BP, shape, f"{name}_visual", _STEEL)
        ids[name] = plant.RegisterCollisionGeometry(
            body, X_BP, shape, name, materials[name]
        )
    del ids["grip"]
    return ids


def _bolt_parts(lock: LockConfig) -> list[tuple[str, RigidTransform, Shape]]:
    head, grip = head_top(lock), grip_height(lock)
    neck_end = grip - lock.grip_size[1] / 2
    return [
        (
            "neck",
            RigidTransform(_R_Y_AXIS, [0, (head + neck_end) / 2, 0]),
            Cylinder(lock.neck_diameter / 2, neck_end - head),
        ),
        (
            "head",
            RigidTransform(_R_Y_AXIS, [0, head - lock.head_thickness / 2, 0]),
            Cylinder(lock.head_diameter / 2, lock.head_thickness),
        ),
        ("grip", RigidTransform([0, grip, 0]), Box(*lock.grip_size)),
    ]


def _grip_material(dissipation: float) -> ProximityProperties:
    properties = ProximityProperties()
    AddContactMaterial(
        dissipation=dissipation,
        friction=CoulombFriction(_PAD_FRICTION, _PAD_FRICTION),
        properties=properties,
    )
    AddRigidHydroelasticProperties(resolution_hint=1.0, properties=properties)
    return properties


def _groove_inertia(lock: LockConfig) -> SpatialInertia:
    return SpatialInertia.SolidBoxWithDensity(
        8500.0, lock.travel, lock.lip_thickness, 2 * _BORDER
    )


def bolt_inertia(lock: LockConfig) -> SpatialInertia:
    """Returns the bolt's inertia about Bo: as if all its mass were in the grip."""
    p_BoBcm_B = np.array([0.0, grip_height(lock), 0.0])
    box = UnitInertia.SolidBox(*lock.grip_size)
    return SpatialInertia.MakeFromCentralInertia(
        lock.bolt_mass, p_BoBcm_B, box * lock.bolt_mass
    )

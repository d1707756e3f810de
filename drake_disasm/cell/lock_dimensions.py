"""The door-chain lock's dimensions: where its parts begin and end.

Frames: G has its origin at A, in the middle of the lips' thickness, x along the
groove, y out of the plate, z across. B is fixed to the bolt, its origin in the
middle of the neck; at the start of an episode B coincides with G.
"""

import numpy as np
from pydrake.geometry import Box, Cylinder, Shape
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import SpatialInertia, UnitInertia

from drake_disasm.scenario import LockConfig

#: Dimensions that shape the groove alone, not the bolt.
GROOVE_FIELDS = ("clearance", "channel_clearance", "keyhole_clearance", "travel")

_BORDER = 0.010  # m, solid rim around the channel
_FLOOR = 0.003  # m, plate under the channel
_R_Y_AXIS = RotationMatrix.MakeXRotation(-np.pi / 2)  # a cylinder along y


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


def bolt_parts(lock: LockConfig) -> list[tuple[str, RigidTransform, Shape]]:
    """Returns name, pose X_BP and shape of neck, head and grip."""
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


def facet_length(diameter: float, resolution: float) -> float:
    """Returns the edge length [m] that gives a cylinder a multiple of four facets.

    So vertices lie on the axis across the slot, where the play is measured: with a
    facet's middle there instead the neck would be thinner. Drake rounds the number
    of facets up, hence an edge slightly longer than the exact one.
    """
    facets = 4 * int(np.ceil(np.pi * diameter / (4 * resolution) - 1e-9))
    return np.pi * diameter / facets * (1 + 1e-6)


def groove_inertia(lock: LockConfig) -> SpatialInertia:
    """Returns the inertia of a brass bar of the groove's size; it never moves."""
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

"""What bodies are made of, as a scene graph's proximity properties.

The fixed body is rigid, as a groove, and the moved one compliant. Drake takes the
contact's normals from the rigid side: from the groove they are those of its flat
faces, while a rigid round neck would offer its facets' normals, and the discrete
solver then resists sliding by a tenth of the normal force at the shipped time step
even without friction (docs/explanation/physics.md).
"""

import dataclasses

import numpy as np
from pydrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    ProximityProperties,
)
from pydrake.multibody.plant import CoulombFriction

from drake_disasm.effects import Environment

_FRICTION_STEP = 1e-4  # below the scatter of any measurement
_PAD_FRICTION = 0.8  # steel on rubber, as on the gripper's pads


def has_same_material(one: Environment, other: Environment) -> bool:
    """Returns whether environments differ in pose and pull alone, or not noticeably.

    Reassigning materials in the scene graph takes milliseconds.
    """
    same = dataclasses.replace(
        other, X_GnG=one.X_GnG, force_Gn=one.force_Gn, friction=one.friction
    )
    return one == same and abs(one.friction - other.friction) < _FRICTION_STEP


def _surface(environment: Environment) -> ProximityProperties:
    """Returns what the surfaces of groove, neck and head have in common."""
    return with_surface(ProximityProperties(), environment)


def with_surface(
    properties: ProximityProperties, environment: Environment
) -> ProximityProperties:
    """Returns properties with an environment's friction and dissipation instead."""
    changed = ProximityProperties(properties)
    friction = CoulombFriction(environment.friction, environment.friction)
    # Speculative contact within a margin would be a quarter of the play here, and it
    # changes nothing but the speed (docs/explanation/physics.md).
    for group, name, value in (
        ("material", "coulomb_friction", friction),
        ("material", "hunt_crossley_dissipation", float(environment.dissipation)),
        ("hydroelastic", "margin", 0.0),
    ):
        changed.UpdateProperty(group, name, value)
    return changed


def facet_length(diameter: float, resolution: float) -> float:
    """Returns the edge length [m] that gives a cylinder a multiple of four facets.

    So vertices lie on the axis across the slot, where the play is measured: with a
    facet's middle there instead the neck would be thinner. Drake rounds the number
    of facets up, hence an edge slightly longer than the exact one.
    """
    facets = 4 * int(np.ceil(np.pi * diameter / (4 * resolution) - 1e-9))
    return np.pi * diameter / facets * (1 + 1e-6)


def facet_count(diameter: float, play: float, share: float = 0.05) -> int:
    """Returns how many sides a round hole has, a multiple of four.

    A facet's middle is nearer to the axis than its ends by r (1 - cos(pi / n)), which
    is to be a small share of the play.

    Args:
        diameter: of the hole, or of what is in it [m].
        play: difference of the two [m].
        share: of the play.
    """
    nearer = share * play / (diameter / 2)
    return 4 * int(np.ceil(np.pi / np.arccos(1.0 - nearer) / 4))


def fitting_edge(diameter: float, play: float, resolution: float) -> float:
    """Returns the edge length [m] of a cylinder that fits a round hole.

    Args:
        diameter: of the cylinder [m].
        play: of it in the hole [m].
        resolution: longest edge [m].
    """
    finest = np.pi * diameter / facet_count(diameter, play)
    return facet_length(diameter, min(resolution, finest))


def rigid_material(environment: Environment) -> ProximityProperties:
    """Returns a fixed body's material: rigid, with the environment's friction."""
    properties = _surface(environment)
    AddRigidHydroelasticProperties(resolution_hint=1.0, properties=properties)
    return properties


def bolt_materials(
    environment: Environment,
    neck_diameter: float,
    head_diameter: float,
    resolution: float,
) -> dict[str, ProximityProperties]:
    """Returns the materials of neck and head by name.

    The head may be much softer and coarser than the neck: it touches with flat faces
    or where there is room, and only the neck's place in the slot asks for precision.

    Args:
        environment: friction, moduli and dissipation.
        neck_diameter, head_diameter: of the bolt [m].
        resolution: edge length on the neck's mesh [m].
    """
    neck_edge = facet_length(neck_diameter, resolution)
    head_edge = facet_length(head_diameter, 2 * resolution)
    return {
        "neck": compliant_material(environment, environment.modulus, neck_edge),
        "head": compliant_material(environment, environment.head_modulus, head_edge),
    }


def compliant_material(
    environment: Environment, modulus: float, edge: float
) -> ProximityProperties:
    """Returns the material of a moved body's solid.

    Args:
        environment: its friction and dissipation.
        modulus: hydroelastic [Pa].
        edge: length on its mesh [m].
    """
    properties = _surface(environment)
    AddCompliantHydroelasticProperties(edge, modulus, properties)
    return properties


def grip_material(dissipation: float) -> ProximityProperties:
    """Returns the material of the bolt's grip, with the friction of the pads on it.

    Args:
        dissipation: Hunt-Crossley [s/m].
    """
    properties = ProximityProperties()
    AddContactMaterial(
        dissipation=dissipation,
        friction=CoulombFriction(_PAD_FRICTION, _PAD_FRICTION),
        properties=properties,
    )
    AddRigidHydroelasticProperties(resolution_hint=1.0, properties=properties)
    return properties

"""The lock of a door chain: a bolt whose head slides in a groove, up to a keyhole.

Frames: G has its origin at A, in the middle of the lips' thickness, x along the
groove, y out of the plate, z across. B is fixed to the bolt, its origin in the
middle of the neck; at the start of an episode B coincides with G.
"""

import dataclasses
import functools

import numpy as np
from pydrake.geometry import Box, Cylinder, ProximityProperties
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import SpatialInertia, UnitInertia

from drake_disasm.cell.lock_materials import (
    bolt_materials,
    grip_material,
    groove_material,
)
from drake_disasm.cell.lock_shape import LockShape
from drake_disasm.cell.part import Part, Solid
from drake_disasm.effects import Environment
from drake_disasm.scenario import ContactConfig, LockConfig, Scenario

#: Dimensions that shape the groove alone, not the bolt.
GROOVE_FIELDS = ("clearance", "channel_clearance", "keyhole_clearance", "travel")

_BORDER = 0.010  # m, solid rim around the channel
_FLOOR = 0.003  # m, plate under the channel
_R_Y_AXIS = RotationMatrix.MakeXRotation(-np.pi / 2)  # a cylinder along y


@dataclasses.dataclass(frozen=True)
class DoorChain(Part):
    """The lock of a door chain; see `Part`.

    Attributes:
        lock: its dimensions.
        contact: what bolt and groove are made of.
    """

    lock: LockConfig
    contact: ContactConfig

    @functools.cached_property
    def shape(self) -> LockShape:
        """Its dimensions, nominal."""
        return LockShape.of(self.lock)

    @property
    def environment(self) -> Environment:
        """See Part."""
        contact = self.contact
        return Environment(
            X_GnG=RigidTransform(),
            friction=contact.friction,
            modulus=contact.modulus,
            head_modulus=contact.head_modulus,
            dissipation=contact.dissipation,
            clearance=self.lock.clearance,
            impact_stiffness=contact.impact.stiffness,
            impact_exponent=contact.impact.exponent,
        )

    @property
    def surface(self) -> float:
        """See Part: the plate's upper face."""
        return float(self.shape.lip)

    @property
    def bottom(self) -> float:
        """See Part: the plate's lower face."""
        return float(self.shape.floor) - _FLOOR

    @property
    def grip_height(self) -> float:
        """y of the grip's middle in B [m]."""
        lock = self.lock
        return self.surface + lock.grip_standoff + lock.grip_size[1] / 2

    def fixed_solids(self, environment: Environment) -> dict[str, Solid]:
        """See Part.

        Two lips leave the slot for the neck and end where the keyhole begins; two
        walls and a floor form the channel for the head; stops close both ends.
        """
        corners = self.groove_boxes(float(environment.clearance))
        return {
            name: (RigidTransform((low + high) / 2), Box(*(high - low)))
            for name, (low, high) in corners.items()
        }

    def groove_boxes(
        self, clearance: float
    ) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Returns two opposite corners (3,) of each solid of the groove, in G [m].

        Args:
            clearance: the slot's width less the neck's diameter [m].
        """
        s = self.shape.with_clearance(clearance)
        rim, outer, far = s.wall + _BORDER, s.start - _BORDER / 2, s.end + _BORDER / 2
        corners = {
            "lip_left": ([outer, s.under_lip, s.slot], [s.lips_end, s.lip, rim]),
            "lip_right": ([outer, s.under_lip, -rim], [s.lips_end, s.lip, -s.slot]),
            "wall_left": ([outer, s.floor, s.wall], [far, s.under_lip, rim]),
            "wall_right": ([outer, s.floor, -rim], [far, s.under_lip, -s.wall]),
            "keyhole_left": ([s.lips_end, s.under_lip, s.wall], [far, s.lip, rim]),
            "keyhole_right": ([s.lips_end, s.under_lip, -rim], [far, s.lip, -s.wall]),
            "floor": ([outer, s.floor - _FLOOR, -rim], [far, s.floor, rim]),
            "stop_a": ([outer, s.floor, -s.wall], [s.start, s.under_lip, s.wall]),
            "stop_b": ([s.end, s.floor, -s.wall], [far, s.lip, s.wall]),
        }
        return {name: (np.array(a), np.array(b)) for name, (a, b) in corners.items()}

    @functools.cached_property
    def moved_solids(self) -> dict[str, Solid]:
        """See Part: neck, head and grip of the bolt."""
        lock, top, grip = self.lock, float(self.shape.top), self.grip_height
        neck_end = grip - lock.grip_size[1] / 2
        return {
            "neck": (
                RigidTransform(_R_Y_AXIS, [0, (top + neck_end) / 2, 0]),
                Cylinder(lock.neck_diameter / 2, neck_end - top),
            ),
            "head": (
                RigidTransform(_R_Y_AXIS, [0, top - lock.head_thickness / 2, 0]),
                Cylinder(lock.head_diameter / 2, lock.head_thickness),
            ),
            "grip": (RigidTransform([0, grip, 0]), Box(*lock.grip_size)),
        }

    def materials(self, environment: Environment) -> dict[str, ProximityProperties]:
        """See Part; the grip's has the friction of the pads on it."""
        groove = groove_material(environment)
        materials = dict.fromkeys(self.fixed_solids(environment), groove)
        materials |= bolt_materials(environment, self.lock, self.contact.resolution)
        return materials | {"grip": grip_material(self.contact.dissipation)}

    @property
    def M_fixed_G(self) -> SpatialInertia:
        """See Part: a brass bar of the groove's size; it never moves."""
        return SpatialInertia.SolidBoxWithDensity(
            8500.0, self.lock.travel, self.lock.lip_thickness, 2 * _BORDER
        )

    @property
    def M_moved_B(self) -> SpatialInertia:
        """See Part: as if all the bolt's mass were in its grip."""
        p_BoBcm_B = np.array([0.0, self.grip_height, 0.0])
        box = UnitInertia.SolidBox(*self.lock.grip_size)
        mass = self.lock.bolt_mass
        return SpatialInertia.MakeFromCentralInertia(mass, p_BoBcm_B, box * mass)


def part_of(scenario: Scenario) -> DoorChain:
    """Returns the part that a scenario is about."""
    return DoorChain(scenario.lock, scenario.contact)

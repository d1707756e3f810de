"""The lock of a door chain: a bolt whose head slides in a groove, up to a keyhole.

G has its origin at A, in the middle of the lips' thickness, x along the groove, y out
of the plate, z across. B has its origin in the middle of the bolt's neck.
"""

import dataclasses
from typing import ClassVar

import numpy as np
from pydrake.geometry import Box, Cylinder, ProximityProperties
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import SpatialInertia, UnitInertia

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import quantity
from drake_disasm.effects import Environment
from drake_disasm.parts.base import Part, Solid, Stage
from drake_disasm.parts.lock_shape import LockShape
from drake_disasm.parts.materials import (
    bolt_materials,
    grip_material,
    groove_material,
)
from drake_disasm.parts.registry import register_part

_BORDER = 0.010  # m, solid rim around the channel
_FLOOR = 0.003  # m, plate under the channel
_R_Y_AXIS = RotationMatrix.MakeXRotation(-np.pi / 2)  # a cylinder along y
_PUSH, _LIFT = 12.0, 8.0  # N, of a scripted policy


@register_part
@dataclasses.dataclass
class DoorChain(Part):
    """The lock of a door chain (own design, see models/SOURCES.md).

    The bolt slides along x until its head is in the keyhole, then it is lifted.
    """

    neck_diameter: float = quantity(0.005, "m", "bolt's neck", low=0.002, high=0.02)
    head_diameter: float = quantity(0.010, "m", "bolt's head", low=0.003, high=0.04)
    head_thickness: float = quantity(0.002, "m", "bolt's head", low=0.001, high=0.01)
    clearance: float = quantity(
        0.0004, "m", "slot width minus neck diameter", low=1e-4, high=1e-3
    )
    channel_clearance: float = quantity(
        0.001, "m", "channel width minus head diameter", low=1e-4, high=5e-3
    )
    axial_clearance: float = quantity(
        0.0004, "m", "channel height minus head thickness", low=1e-4, high=5e-3
    )
    lip_thickness: float = quantity(
        0.0025, "m", "of the lips that form the slot", low=1e-3, high=0.01
    )
    travel: float = quantity(0.060, "m", "from A to B", low=0.02, high=0.15)
    keyhole_clearance: float = quantity(
        0.001, "m", "keyhole width minus head diameter", low=2e-4, high=5e-3
    )
    grip_size: list[float] = quantity(
        [0.024, 0.030, 0.012], "m", "bolt's grip along x, y, z", low=0.004, high=0.05
    )
    grip_standoff: float = quantity(
        0.003, "m", "gap between plate and grip", low=0.001, high=0.05
    )
    bolt_mass: float = quantity(
        0.2, "kg", "of the bolt and its chain", low=0.001, high=1.0
    )

    fixed_fields: ClassVar[tuple[str, ...]] = (
        "clearance",
        "channel_clearance",
        "keyhole_clearance",
        "travel",
    )

    @property
    def stages(self) -> tuple[Stage, ...]:
        """See Part: to the stop in the keyhole, and up until the head is level."""
        head = self.axial_clearance / 2 + self.head_thickness
        return (
            Stage(0, self.travel + self.keyhole_clearance / 2, _PUSH),
            Stage(1, self.lip_thickness + head, _LIFT),
        )

    @property
    def gaps(self) -> LockShape:
        """See Part."""
        lip = self.lip_thickness / 2
        half_hole = (self.head_diameter + self.keyhole_clearance) / 2
        top = -lip - self.axial_clearance / 2  # half the axial play below the lips
        return LockShape(
            slot=(self.neck_diameter + self.clearance) / 2,
            wall=(self.head_diameter + self.channel_clearance) / 2,
            lips_end=self.travel - half_hole,
            lip=lip,
            under_lip=-lip,
            floor=-lip - self.head_thickness - self.axial_clearance,
            start=-half_hole,
            end=self.travel + half_hole,
            neck=self.neck_diameter / 2,
            head=self.head_diameter / 2,
            top=top,
            bottom=top - self.head_thickness,
        )

    @property
    def play(self) -> float:
        """See Part: of the neck in the slot."""
        return self.clearance

    @property
    def touch_radius(self) -> float:
        """See Part: the head's."""
        return self.head_diameter / 2.0

    @property
    def touch_depth(self) -> float:
        """See Part: the head's."""
        return self.head_thickness

    @property
    def grip_width(self) -> float:
        """See Part."""
        return self.grip_size[2]

    @property
    def surface(self) -> float:
        """See Part: the plate's upper face."""
        return float(self.gaps.lip)

    @property
    def bottom(self) -> float:
        """See Part: the plate's lower face."""
        return float(self.gaps.floor) - _FLOOR

    @property
    def grip_height(self) -> float:
        """y of the grip's middle in B [m]."""
        return self.surface + self.grip_standoff + self.grip_size[1] / 2

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
        s = self.gaps.with_clearance(clearance)
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

    @property
    def moved_solids(self) -> dict[str, Solid]:
        """See Part: neck, head and grip of the bolt."""
        top, grip = float(self.gaps.top), self.grip_height
        neck_end = grip - self.grip_size[1] / 2
        return {
            "neck": (
                RigidTransform(_R_Y_AXIS, [0, (top + neck_end) / 2, 0]),
                Cylinder(self.neck_diameter / 2, neck_end - top),
            ),
            "head": (
                RigidTransform(_R_Y_AXIS, [0, top - self.head_thickness / 2, 0]),
                Cylinder(self.head_diameter / 2, self.head_thickness),
            ),
            "grip": (RigidTransform([0, grip, 0]), Box(*self.grip_size)),
        }

    def materials(
        self, environment: Environment, resolution: float
    ) -> dict[str, ProximityProperties]:
        """See Part; the grip's has the friction of the pads on it."""
        groove = groove_material(environment)
        materials = dict.fromkeys(self.fixed_solids(environment), groove)
        diameters = self.neck_diameter, self.head_diameter
        materials |= bolt_materials(environment, *diameters, resolution)
        return materials | {"grip": grip_material(environment.dissipation)}

    @property
    def M_fixed_G(self) -> SpatialInertia:
        """See Part: a brass bar of the groove's size; it never moves."""
        return SpatialInertia.SolidBoxWithDensity(
            8500.0, self.travel, self.lip_thickness, 2 * _BORDER
        )

    @property
    def M_moved_B(self) -> SpatialInertia:
        """See Part: as if all the bolt's mass were in its grip."""
        p_BoBcm_B = np.array([0.0, self.grip_height, 0.0])
        box = UnitInertia.SolidBox(*self.grip_size)
        mass = self.bolt_mass
        return SpatialInertia.MakeFromCentralInertia(mass, p_BoBcm_B, box * mass)

    def refuse_impossible(self) -> None:
        """See Part: the lips must hold the head, the keyhole must let it through."""
        slot = self.neck_diameter + self.clearance
        if self.head_diameter <= slot:
            raise DisasmError(
                f"part.head_diameter: a head of {self.head_diameter:g} m slips through "
                f"the slot of {slot:g} m (part.neck_diameter + part.clearance); make "
                "it wider"
            )
        hole = self.head_diameter + self.keyhole_clearance
        if self.travel <= hole:
            raise DisasmError(
                f"part.travel: {self.travel:g} m leave no lips between A and a keyhole "
                f"of {hole:g} m; give more than that"
            )

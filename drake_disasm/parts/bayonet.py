"""A bayonet: two lugs under a plate, which is turned out of a detent, then pulled.

G has its origin on the shaft's axis in the plate's upper face, y out of the plate. B
has its origin on the axis. As an episode begins the lugs lie along x; the notches
through which they leave are turned from there by `turn` about y.
"""

import dataclasses
from typing import ClassVar

import numpy as np
from pydrake.geometry import Box, ProximityProperties
from pydrake.math import RigidTransform, RotationMatrix

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import quantity
from drake_disasm.common.spatial import rotation_vector
from drake_disasm.effects import Environment
from drake_disasm.parts.base import Solid, Stage, Wrench, cylinder_along_y
from drake_disasm.parts.contact import ContactConfig
from drake_disasm.parts.gaps import BayonetGaps
from drake_disasm.parts.gripped_block import GrippedBlock
from drake_disasm.parts.materials import (
    compliant_material,
    facet_count,
    fitting_edge,
)
from drake_disasm.parts.meshes import circle, tube
from drake_disasm.parts.registry import register_part

_BORDER = 0.008  # m, of the socket around the lugs
_FLOOR = 0.003  # m, of the socket under the lugs
_STOP = 0.003  # m, thickness of what stops the lugs
_LIFT = 12.0  # N, of a scripted policy
_MOST_OF_EFFORT = 0.6  # of the effort with which it turns, that the detent may take
_NOTCH_POINTS = 3  # corners along each side of a notch


@register_part
@dataclasses.dataclass
class Bayonet(GrippedBlock):
    """A bayonet joint with a detent.

    The shaft turns about y until its lugs are stopped under the notches, then it is
    pulled out. The detent's spring holds it where it begins by a torque about y,
    -T sin(pi theta / w) for |theta| < w: `detent_torque`, `detent_width`.
    """

    shaft_diameter: float = quantity(0.008, "m", "of the shaft", low=0.004, high=0.02)
    lug_length: float = quantity(0.004, "m", "beyond the shaft", low=0.002, high=0.01)
    lug_width: float = quantity(0.004, "m", "across a lug", low=0.002, high=0.01)
    lug_height: float = quantity(0.003, "m", "along the axis", low=0.001, high=0.01)
    clearance: float = quantity(
        0.0003, "m", "hole's diameter minus the shaft's", low=5e-5, high=1e-3
    )
    notch_clearance: float = quantity(
        0.0008, "m", "notch's width minus a lug's", low=2e-4, high=2e-3
    )
    axial_clearance: float = quantity(
        0.0006, "m", "of the lugs between plate and floor", low=1e-4, high=5e-3
    )
    plate_thickness: float = quantity(0.003, "m", "of the plate", low=0.001, high=0.01)
    turn: float = quantity(1.0, "rad", "from start to notches", low=0.4, high=1.5)
    detent_torque: float = quantity(0.15, "N m", "greatest", low=0.0, high=0.5)
    detent_width: float = quantity(
        0.2, "rad", "turn at which the detent lets go", low=0.05, high=0.5
    )

    fixed_fields: ClassVar[tuple[str, ...]] = ("clearance", "notch_clearance")
    has_spring: ClassVar[bool] = True

    @property
    def stages(self) -> tuple[Stage, ...]:
        """See Part: a turn to the stop, then up until the lugs are out."""
        effort = max(0.15, self.detent_torque / _MOST_OF_EFFORT)
        out = self.plate_thickness + self.axial_clearance / 2 + self.lug_height
        return (
            Stage(4, self.turn, effort, radius=self.touch_radius),
            Stage(1, out, _LIFT),
        )

    @property
    def gaps(self) -> BayonetGaps:
        """See Part."""
        radius = self.shaft_diameter / 2
        return BayonetGaps(
            shaft=radius,
            hole=radius + self.clearance / 2,
            plate=self.plate_thickness,
            floor=self._floor,
            end=self.touch_radius,
            half=self.lug_width / 2,
            top=self._lug_middle + self.lug_height / 2,
            bottom=self._lug_middle - self.lug_height / 2,
            cosine=float(np.cos(self.turn)),
            sine=float(np.sin(self.turn)),
            half_notch=self._half_notch,
            notch_end=self._notch_end,
            stop=self._stop,
            detent=self.detent_torque,
            detent_width=self.detent_width,
        )

    def impact_stiffness(self, contact: ContactConfig) -> float:
        """See Part: of a quarter of a lug's face, as deep as half the lug."""
        area = self.lug_length * self.lug_width / 4.0
        return contact.head_modulus * area / (self.lug_height / 2.0)

    @property
    def _half_notch(self) -> float:
        """Half width of a notch [m]."""
        return (self.lug_width + self.notch_clearance) / 2

    @property
    def _notch_end(self) -> float:
        """Radius of the notches' ends [m]."""
        return self.touch_radius + self.notch_clearance / 2

    @property
    def _stop(self) -> float:
        """From the notches' middle to the stops, a quarter of the play before [m]."""
        return self.lug_width / 2 + self.notch_clearance / 4

    @property
    def touch_radius(self) -> float:
        """See Part: of the lugs' ends."""
        return self.shaft_diameter / 2 + self.lug_length

    @property
    def surface(self) -> float:
        """See Part: the plate's upper face."""
        return 0.0

    @property
    def bottom(self) -> float:
        """See Part: the socket's lower face."""
        return self._floor - _FLOOR

    @property
    def _floor(self) -> float:
        """y of the floor under the lugs [m]."""
        return -self.plate_thickness - self.lug_height - self.axial_clearance

    @property
    def detent(self) -> float:
        """See Part."""
        return self.detent_torque

    def spring_wrench(self, X_GB: RigidTransform, environment: Environment) -> Wrench:
        """See Part: the detent's torque about y."""
        wrench, angle = np.zeros(6), float(rotation_vector(X_GB.rotation())[1])
        if abs(angle) < self.detent_width:
            share = np.sin(np.pi * angle / self.detent_width)
            wrench[4] = -float(environment.detent) * share
        return wrench

    def fixed_solids(self, environment: Environment) -> dict[str, Solid]:
        """See Part: plate with notches, chamber under it, stops, floor."""
        outer = self.touch_radius + _BORDER
        under, chamber = -self.plate_thickness, self.touch_radius + 0.001
        outline = self._outline(float(environment.clearance))
        side = 2 * outer
        floor = RigidTransform([0.0, self._floor - _FLOOR / 2, 0.0])
        walls = tube(circle(chamber, 32), outer, self._floor, under)
        solids: dict[str, Solid] = {
            "plate": (RigidTransform(), tube(outline, outer, under, 0.0)),
            "chamber": (RigidTransform(), walls),
            "floor": (floor, Box(side, _FLOOR, side)),
        }
        return solids | self._stops()

    def _stops(self) -> dict[str, Solid]:
        """Returns what stops each lug under its notch."""
        solids: dict[str, Solid] = {}
        beyond = self._stop + _STOP / 2
        height, middle = -self._floor - self.plate_thickness, self._lug_middle
        inner = self.shaft_diameter / 2 + 0.001  # the shaft goes by
        length = self.touch_radius - inner
        for number in (0, 1):
            # A positive turn about y takes a lug along x towards -z.
            R = RotationMatrix.MakeYRotation(self.turn + number * np.pi)
            p = R @ np.array([inner + length / 2, middle, -beyond])
            solids[f"stop_{number}"] = RigidTransform(R, p), Box(length, height, _STOP)
        return solids

    def _outline(self, clearance: float) -> np.ndarray:
        """Returns the corners (n, 2) of the plate's hole in x and z [m].

        A circle for the shaft, with a notch on either side for a lug.
        """
        radius = (self.shaft_diameter + clearance) / 2
        half, end = self._half_notch, self._notch_end
        facets = facet_count(2 * radius, clearance)
        ring = circle(radius, facets)
        across, along = ring[:, 1], np.abs(ring[:, 0])
        quarter = ring[(along < np.sqrt(radius**2 - half**2) - 1e-6) & (across > 0)]
        out = np.linspace(np.sqrt(radius**2 - half**2), end, _NOTCH_POINTS)
        side = np.stack([out, np.full(_NOTCH_POINTS, half)], axis=1)
        # By angle: notch along +x (its upper side inwards), the arc, notch along -x.
        upper = np.concatenate([side[::-1], quarter, side * [-1, 1]])
        outline = np.concatenate([upper, -upper])
        c, s = np.cos(self.turn), np.sin(self.turn)
        return outline @ np.array([[c, -s], [s, c]])

    @property
    def _lug_middle(self) -> float:
        """y of the lugs' middle in B: half of the axial play above them [m]."""
        top = -self.plate_thickness - self.axial_clearance / 2
        return top - self.lug_height / 2

    @property
    def touching_solids(self) -> dict[str, Solid]:
        """See GrippedBlock: shaft and lugs."""
        radius, middle = self.shaft_diameter / 2, self._lug_middle
        low, top = middle - self.lug_height / 2, self.surface + self.grip_standoff
        lug = Box(self.lug_length, self.lug_height, self.lug_width)
        x = radius + self.lug_length / 2
        return {
            "shaft": cylinder_along_y((top + low) / 2, radius, top - low),
            "lug_0": (RigidTransform([x, middle, 0.0]), lug),
            "lug_1": (RigidTransform([-x, middle, 0.0]), lug),
        }

    def touching_materials(
        self, environment: Environment, resolution: float
    ) -> dict[str, ProximityProperties]:
        """See GrippedBlock: the lugs, flat on flat, are softer."""
        edge = fitting_edge(self.shaft_diameter, self.clearance, resolution)
        shaft = compliant_material(environment, environment.modulus, edge)
        lug = compliant_material(environment, environment.head_modulus, resolution)
        return {"shaft": shaft, "lug_0": lug, "lug_1": lug}

    def refuse_impossible(self) -> None:
        """See Part: the lugs must be wholly under the plate."""
        half = self._half_notch
        if half >= self.shaft_diameter / 2:
            raise DisasmError(
                f"part.lug_width: {self.lug_width:g} m and part.notch_clearance are "
                f"wider than the shaft ({self.shaft_diameter:g} m); give less"
            )
        least = 2 * np.arcsin(half / (self.shaft_diameter / 2)) / 2
        if self.turn < least:
            raise DisasmError(
                f"part.turn: lugs that turn by {self.turn:g} rad lie partly under "
                f"their notches from the start; give {least:.2g} rad or more"
            )

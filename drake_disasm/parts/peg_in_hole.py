"""A peg in a hole, round or square, which is pulled out.

G has its origin in the middle of the hole's mouth, y out of the block. B has its origin
on the peg's axis, at the mouth.
"""

import dataclasses
from typing import ClassVar

from pydrake.geometry import Box, ProximityProperties
from pydrake.math import RigidTransform

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import quantity
from drake_disasm.effects import Environment
from drake_disasm.parts.base import Solid, Stage, cylinder_along_y
from drake_disasm.parts.contact import ContactConfig
from drake_disasm.parts.gaps import HoleGaps
from drake_disasm.parts.gripped_block import GrippedBlock
from drake_disasm.parts.materials import (
    compliant_material,
    facet_count,
    fitting_edge,
)
from drake_disasm.parts.meshes import circle, tube
from drake_disasm.parts.registry import register_part

_RIM = 0.010  # m, of the block around the hole
_BELOW = 0.001  # m, from the peg's tip to the hole's bottom
_FLOOR = 0.003  # m, of the block under the hole
_PULL = 20.0  # N, of a scripted policy


@register_part
@dataclasses.dataclass
class PegInHole(GrippedBlock):
    """A peg in a hole, round or square.

    It is pulled out along y, without turning. A hole that is tilted is the effect
    GroovePose.
    """

    cross_section: str = quantity(
        "round", "", "of peg and hole", choices=("round", "square")
    )
    width: float = quantity(
        0.010, "m", "diameter or side of the peg", low=0.003, high=0.03
    )
    clearance: float = quantity(
        0.0002, "m", "hole's width minus the peg's", low=2e-5, high=1e-3
    )
    depth: float = quantity(0.020, "m", "of the peg in the hole", low=0.002, high=0.08)

    fixed_fields: ClassVar[tuple[str, ...]] = ("clearance",)

    @property
    def stages(self) -> tuple[Stage, ...]:
        """See Part: up, until the tip is level with the block's face."""
        return (Stage(1, self.depth, _PULL),)

    @property
    def gaps(self) -> HoleGaps:
        """See Part."""
        return HoleGaps(
            is_square=float(self.cross_section == "square"),
            half=self.width / 2,
            hole=(self.width + self.clearance) / 2,
            tip=-self.depth,
            floor=-self.depth - _BELOW,
        )

    def impact_stiffness(self, contact: ContactConfig) -> float:
        """See Part: of half the depth at the tip, and half at the mouth.

        A square has two corners at each.
        """
        if self.cross_section == "round":
            return contact.modulus * self.depth
        return contact.head_modulus * self.depth / 2.0

    @property
    def touch_radius(self) -> float:
        """See Part: half the width."""
        return self.width / 2.0

    @property
    def surface(self) -> float:
        """See Part: the block's upper face."""
        return 0.0

    @property
    def bottom(self) -> float:
        """See Part: the block's lower face."""
        return -self.depth - _BELOW - _FLOOR

    def fixed_solids(self, environment: Environment) -> dict[str, Solid]:
        """See Part: the block's floor, and walls around the hole."""
        width = self.width + float(environment.clearance)
        outer = width + 2 * _RIM
        low = -self.depth - _BELOW
        floor = RigidTransform([0.0, low - _FLOOR / 2, 0.0]), Box(outer, _FLOOR, outer)
        if self.cross_section == "round":
            facets = facet_count(self.width, self.clearance)
            wall = tube(circle(width / 2, facets), outer / 2, low, 0.0)
            return {"wall": (RigidTransform(), wall), "floor": floor}
        at, long = (width + _RIM) / 2, width + _RIM
        walls = {
            "wall_0": ([at, low / 2, _RIM / 2], Box(_RIM, -low, long)),
            "wall_1": ([_RIM / 2, low / 2, -at], Box(long, -low, _RIM)),
            "wall_2": ([-at, low / 2, -_RIM / 2], Box(_RIM, -low, long)),
            "wall_3": ([-_RIM / 2, low / 2, at], Box(long, -low, _RIM)),
        }
        return {n: (RigidTransform(p), box) for n, (p, box) in walls.items()} | {
            "floor": floor
        }

    @property
    def touching_solids(self) -> dict[str, Solid]:
        """See GrippedBlock: the peg."""
        top = self.surface + self.grip_standoff
        length, middle = top + self.depth, (top - self.depth) / 2
        if self.cross_section == "round":
            return {"peg": cylinder_along_y(middle, self.width / 2, length)}
        box = Box(self.width, length, self.width)
        return {"peg": (RigidTransform([0.0, middle, 0.0]), box)}

    def touching_materials(
        self, environment: Environment, resolution: float
    ) -> dict[str, ProximityProperties]:
        """See GrippedBlock: flat on flat is softer, or it chatters."""
        edge, modulus = resolution, environment.head_modulus
        if self.cross_section == "round":
            edge = fitting_edge(self.width, self.clearance, resolution)
            modulus = environment.modulus
        return {"peg": compliant_material(environment, modulus, edge)}

    def refuse_impossible(self) -> None:
        """See Part: a short peg of a large play would tip over."""
        if self.clearance > self.depth / 4:
            raise DisasmError(
                f"part.clearance: {self.clearance:g} m let a peg that is "
                f"{self.depth:g} m deep (part.depth) tip over; give less than a quarter"
            )

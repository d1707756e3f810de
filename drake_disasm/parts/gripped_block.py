"""A part whose moved body ends in a block between the fingers."""

import abc
import dataclasses

import numpy as np
from pydrake.geometry import Box, ProximityProperties
from pydrake.math import RigidTransform
from pydrake.multibody.tree import SpatialInertia, UnitInertia

from drake_disasm.common.quantity import quantity
from drake_disasm.effects import Environment
from drake_disasm.parts.base import Part, Solid
from drake_disasm.parts.materials import grip_material


@dataclasses.dataclass
class GrippedBlock(Part):
    """A part whose moved body ends in a block, above the fixed one's surface."""

    grip_size: list[float] = quantity(
        [0.024, 0.030, 0.012], "m", "grip along x, y, z", low=0.004, high=0.05
    )
    grip_standoff: float = quantity(
        0.003, "m", "gap between the fixed body and the grip", low=0.001, high=0.05
    )
    mass: float = quantity(
        0.2, "kg", "of what is moved, and what hangs on it", low=0.001, high=1.0
    )

    @property
    def grip_height(self) -> float:
        """y of the grip's middle in B [m]."""
        return self.surface + self.grip_standoff + self.grip_size[1] / 2

    @property
    def grip_width(self) -> float:
        """See Part."""
        return self.grip_size[2]

    @property
    def M_moved_B(self) -> SpatialInertia:
        """See Part: as if all mass were in the grip."""
        p_BoBcm_B = np.array([0.0, self.grip_height, 0.0])
        box = UnitInertia.SolidBox(*self.grip_size)
        return SpatialInertia.MakeFromCentralInertia(
            self.mass, p_BoBcm_B, box * self.mass
        )

    @property
    @abc.abstractmethod
    def touching_solids(self) -> dict[str, Solid]:
        """The moved body's solids that touch the fixed one."""

    @property
    def moved_solids(self) -> dict[str, Solid]:
        """See Part."""
        grip = RigidTransform([0.0, self.grip_height, 0.0]), Box(*self.grip_size)
        return self.touching_solids | {"grip": grip}

    @abc.abstractmethod
    def touching_materials(
        self, environment: Environment, resolution: float
    ) -> dict[str, ProximityProperties]:
        """Returns the materials of `touching_solids`; see Part."""

    def moved_materials(
        self, environment: Environment, resolution: float
    ) -> dict[str, ProximityProperties]:
        """See Part; the grip's has the friction of the pads on it."""
        touching = self.touching_materials(environment, resolution)
        return touching | {"grip": grip_material(environment.dissipation)}

"""What a part to be taken apart says of itself, for every user of its shapes."""

import abc
from collections.abc import Mapping

from pydrake.geometry import ProximityProperties, Shape
from pydrake.math import RigidTransform
from pydrake.multibody.tree import SpatialInertia

from drake_disasm.cell.lock_shape import LockShape
from drake_disasm.effects import Environment
from drake_disasm.scenario import ContactConfig

#: A solid: its pose in the body's frame, and its shape.
Solid = tuple[RigidTransform, Shape]


class Part(abc.ABC):
    """A body that is gripped and moved, in another that stays where it is.

    Both are made of solids by name. The fixed body's frame is G, the moved one's is B;
    as an episode begins they coincide.

    Attributes:
        contact: what the bodies are made of.
    """

    contact: ContactConfig

    @property
    @abc.abstractmethod
    def shape(self) -> LockShape:
        """The gaps between the bodies, nominal, for the law IMPACT."""

    @property
    @abc.abstractmethod
    def environment(self) -> Environment:
        """Of the moved body, before effects."""

    @property
    @abc.abstractmethod
    def M_fixed_G(self) -> SpatialInertia:
        """Inertia of the fixed body about Go."""

    @property
    @abc.abstractmethod
    def M_moved_B(self) -> SpatialInertia:
        """Inertia of the moved body about Bo."""

    @property
    @abc.abstractmethod
    def bottom(self) -> float:
        """y of the lowest face of the fixed body in G, which lies on the bench [m]."""

    @property
    @abc.abstractmethod
    def surface(self) -> float:
        """y of the face in G above which the moved body can be gripped [m]."""

    @property
    @abc.abstractmethod
    def moved_solids(self) -> Mapping[str, Solid]:
        """The solids of the moved body."""

    @abc.abstractmethod
    def fixed_solids(self, environment: Environment) -> Mapping[str, Solid]:
        """Returns the solids of the fixed body, which effects may have reshaped."""

    @abc.abstractmethod
    def materials(self, environment: Environment) -> Mapping[str, ProximityProperties]:
        """Returns the hydroelastic properties of all solids, by name."""

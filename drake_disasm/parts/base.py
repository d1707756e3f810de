"""What a part to be taken apart says of itself, for every user of its shapes.

A part is a dataclass, so that a scenario can state it (`part: !PegInHole {...}`) and
identification can fit its fields. To write one: derive from `Part`, give it fields by
`drake_disasm.common.quantity`, and put `@register_part` above it.

Frames: G is fixed to the body that stays, B to the one that is moved; as an episode
begins they coincide. y points out of the fixed body, back at the robot; the fingers
close along z.
"""

import abc
import dataclasses
import itertools
import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from pydrake.geometry import Cylinder, ProximityProperties, Shape
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import SpatialInertia

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import Environment
from drake_disasm.parts.contact import ContactConfig
from drake_disasm.parts.gaps import Gaps
from drake_disasm.parts.materials import rigid_material

#: Forces and torques (6,), [f; tau].
Wrench = np.ndarray

#: A solid: its pose in the body's frame, and its shape.
Solid = tuple[RigidTransform, Shape]

#: The coordinates of the moved body in G, in the order of the task's state.
AXES = ("x", "y", "z", "u", "v", "w")

#: All ways out, of one or two stages.
WAYS = (*AXES, *("".join(two) for two in itertools.permutations(AXES, 2)))


_R_Y_AXIS = RotationMatrix.MakeXRotation(-np.pi / 2)


def cylinder_along_y(middle: float, radius: float, length: float) -> Solid:
    """Returns a cylinder about the body's y axis.

    Args:
        middle: its y [m].
        radius, length: [m].
    """
    X = RigidTransform(_R_Y_AXIS, [0.0, middle, 0.0])
    return X, Cylinder(radius, length)


@dataclasses.dataclass(frozen=True)
class Stage:
    """A part of the way by which the moved body leaves: along or about one axis of G.

    Attributes:
        axis: number in AXES.
        end: where it ends [m, rad].
        effort: with which a scripted policy pushes along it [N, N m].
        radius: of a turn, at which its way is counted [m].
    """

    axis: int
    end: float
    effort: float
    radius: float = 1.0

    @property
    def is_turn(self) -> bool:
        """Whether it is about the axis."""
        return self.axis >= 3


@dataclasses.dataclass
class Part(abc.ABC):
    """A body that is gripped and moved, in another that stays where it is.

    Both are made of solids by name.

    Attributes:
        clearance: of the moved body in the fixed one: difference of their widths [m].
        fixed_fields: names of the fields that shape the fixed body alone.
        has_spring: whether `spring_wrench` is ever more than zero.
        file_fields: names of the fields that name files, beside the scenario's.
    """

    clearance: float

    fixed_fields: ClassVar[tuple[str, ...]] = ()
    has_spring: ClassVar[bool] = False
    file_fields: ClassVar[tuple[str, ...]] = ()

    @property
    @abc.abstractmethod
    def stages(self) -> tuple[Stage, ...]:
        """The way out, one or two stages; the last is no turn, and ends in the open."""

    @property
    def way(self) -> str:
        """The coordinates along and about which the moved body leaves."""
        return "".join(AXES[stage.axis] for stage in self.stages)

    @property
    def gaps(self) -> Gaps | None:
        """The gaps between the bodies, nominal, for IMPACT; None has no such form."""
        return None

    def impact_stiffness(self, contact: ContactConfig) -> float:
        """Returns how stiff a place of `gaps` is, as hydroelastic contact has it [N/m].

        An elastic foundation: modulus times area by half the body's width.

        Args:
            contact: what the bodies are made of.
        """
        return 1e3 * contact.impact.stiffness  # N/mm, for a part of one's own

    def environment(self, contact: ContactConfig) -> Environment:
        """Returns the moved body's environment before effects.

        Args:
            contact: what the bodies are made of.
        """
        return Environment(
            X_GnG=RigidTransform(),
            friction=contact.friction,
            modulus=contact.modulus,
            head_modulus=contact.head_modulus,
            dissipation=contact.dissipation,
            clearance=self.clearance,
            impact_stiffness=contact.impact.stiffness,
            impact_exponent=contact.impact.exponent,
            detent=self.detent,
        )

    @property
    def detent(self) -> float:
        """Greatest torque of a detent, nominal [N m]."""
        return 0.0

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
    def grip_width(self) -> float:
        """Width of the moved body between the fingers, along z [m]."""

    @property
    @abc.abstractmethod
    def touch_radius(self) -> float:
        """Greatest distance of contact from the moved body's y axis [m]."""

    @property
    @abc.abstractmethod
    def moved_solids(self) -> Mapping[str, Solid]:
        """The solids of the moved body; the one named `grip` touches the fingers."""

    @abc.abstractmethod
    def fixed_solids(self, environment: Environment) -> Mapping[str, Solid]:
        """Returns the solids of the fixed body, which effects may have reshaped."""

    def fixed_material(
        self, name: str, environment: Environment
    ) -> ProximityProperties:
        """Returns the hydroelastic properties of a solid of the fixed body.

        Args:
            name: of the solid.
            environment: of the moved body.
        """
        return rigid_material(environment)

    @abc.abstractmethod
    def moved_materials(
        self, environment: Environment, resolution: float
    ) -> Mapping[str, ProximityProperties]:
        """Returns the hydroelastic properties of the moved body's solids, by name.

        Args:
            environment: of the moved body.
            resolution: edge length on the compliant body's mesh [m].
        """

    def spring_wrench(self, X_GB: RigidTransform, environment: Environment) -> Wrench:
        """Returns what a spring of the part does to the moved body, in each step.

        Args:
            X_GB: where the moved body is.
            environment: its own, effects included.

        Returns:
            (6,) [f; tau] at Bo in G [N, N m].
        """
        return np.zeros(6)

    def refuse_impossible(self) -> None:  # noqa: B027, most parts have none
        """Raises DisasmError for dimensions that don't go together."""

    @property
    def reach(self) -> float:
        """Longest way of a stage that is no turn [m]."""
        return max((s.end for s in self.stages if not s.is_turn), default=math.inf)

    def required_gaps(self) -> Gaps:
        """Returns `gaps`.

        Raises:
            DisasmError: the part has none; says what to use instead.
        """
        gaps = self.gaps
        if gaps is None:
            raise DisasmError(
                f"contact.model: 'impact' is a law for simple gaps, and "
                f"{type(self).__name__} has none; set it to hydroelastic, and leave "
                "out what needs a batch (--envs, --lockstep)"
            )
        return gaps

"""What the contact depends on, except the state."""

import dataclasses
import functools
from collections.abc import Sequence
from typing import Self

from pydrake.math import RigidTransform

from drake_disasm.common.arrays import Array, array_like, namespace, side_by_side
from drake_disasm.common.rotations import Pose
from drake_disasm.effects import Environment
from drake_disasm.parts.gaps import Gaps
from drake_disasm.twin.law import ImpactLaw


@dataclasses.dataclass(frozen=True)
class Surroundings:
    """What may differ from state to state; m is their number, or 1 for one for all.

    Attributes:
        friction: (m,) Coulomb coefficient.
        R_GnG, p_GnG: (m, 3, 3), (m, 3) the true groove in the nominal frame.
        f_Gn: (m, 3) force on the bolt at Bo other than the contact's, in Gn [N].
    """

    friction: Array
    R_GnG: Array
    p_GnG: Array
    f_Gn: Array

    @classmethod
    def of(cls, environment: Environment, like: Array) -> Self:
        """Returns those of an environment, or of n.

        Args:
            environment: in which bolts are.
            like: (n, ...) as many rows, of the kind that is wanted.
        """
        xp, count, X_GnG = namespace(like), len(like), environment.X_GnG
        if isinstance(X_GnG, RigidTransform):
            X_GnG = Pose.of(X_GnG)
        friction, *force = (
            xp.broadcast_to(array_like(number, like), (count,))
            for number in (environment.friction, *environment.force_Gn)
        )
        return cls(
            friction,
            xp.broadcast_to(array_like(X_GnG.R, like), (count, 3, 3)),
            xp.broadcast_to(array_like(X_GnG.p, like), (count, 3)),
            side_by_side(force),
        )


@dataclasses.dataclass(frozen=True)
class ImpactConditions:
    """All that the contact depends on except the state.

    Of one twin, or with n as an axis before the shapes below, of one for each state.

    Attributes:
        law: of the normal force.
        gaps: of the part.
        around: what may differ from state to state.
        M: (6, 6) mass matrix of the twin's joints, at their zero.
        K, D: (6,) their stiffness and damping.
        p_BoTo_B: (3,) the point of the bolt that the joints move [m].
    """

    law: ImpactLaw
    gaps: Gaps
    around: Surroundings
    M: Array
    K: Array
    D: Array
    p_BoTo_B: Array

    @classmethod
    def of(
        cls,
        law: ImpactLaw,
        gaps: Gaps,
        environment: Environment,
        like: Array,
        **joints: Array,
    ) -> Self:
        """Returns the conditions in an environment, or in n.

        Args:
            law, gaps: nominal.
            environment: in which bolts are.
            like: see `Surroundings.of`.
            joints: M, K, D and p_BoTo_B.
        """
        law = dataclasses.replace(
            law,
            stiffness=environment.impact_stiffness,
            exponent=environment.impact_exponent,
        )
        gaps = gaps.changed_by(environment)
        return cls(law, gaps, Surroundings.of(environment, like), **joints)

    @functools.cached_property
    def table(self) -> Array:
        """All of it, a row for each state or one for all (m, 87); see `equations`."""
        around = self.around
        columns = [
            *((value, ()) for value in (*self.law.row, *self.gaps.row)),
            (around.friction, ()),
            (around.R_GnG, (3, 3)),
            (around.p_GnG, (3,)),
            (around.f_Gn, (3,)),
            (self.M, (6, 6)),
            (self.K, (6,)),
            (self.D, (6,)),
            (self.p_BoTo_B, (3,)),
        ]
        return joined_columns(columns, around.friction)


def joined_columns(
    columns: Sequence[tuple[float | Array, tuple[int, ...]]], like: Array
) -> Array:
    """Returns quantities side by side, a row for each twin or one for all (m, k).

    Args:
        columns: each a quantity of m twins, or of all, and its shape of one.
        like: an array of the kind that is wanted.
    """
    xp = namespace(like)
    arrays = [(array_like(value, like), shape) for value, shape in columns]
    rows = max((len(v) for v, shape in arrays if v.ndim > len(shape)), default=1)
    flat = [
        xp.reshape(xp.broadcast_to(v, (rows, *shape)), (rows, -1))
        for v, shape in arrays
    ]
    return xp.concat(flat, axis=1)

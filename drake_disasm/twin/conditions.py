"""What the contact depends on, except the state."""

import dataclasses
import functools
from collections.abc import Sequence
from typing import Self

import numpy as np

from drake_disasm.cell.lock_shape import LockShape
from drake_disasm.common.arrays import Array, array_like, namespace
from drake_disasm.effects import Environment
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
    def of(cls, environments: Sequence[Environment]) -> Self:
        """Returns those of environments, one for each state or one for all."""
        return cls(
            np.array([e.friction for e in environments]),
            np.array([e.X_GnG.rotation().matrix() for e in environments]),
            np.array([e.X_GnG.translation() for e in environments]),
            np.array([e.force_Gn for e in environments]),
        )


@dataclasses.dataclass(frozen=True)
class ImpactConditions:
    """All that the contact depends on except the state.

    Of one twin, or with n as an axis before the shapes below, of one for each state.

    Attributes:
        law: of the normal force.
        shape: of the lock.
        around: what may differ from state to state.
        M: (6, 6) mass matrix of the twin's joints, at their zero.
        K, D: (6,) their stiffness and damping.
        p_BoTo_B: (3,) the point of the bolt that the joints move [m].
    """

    law: ImpactLaw
    shape: LockShape
    around: Surroundings
    M: Array
    K: Array
    D: Array
    p_BoTo_B: Array

    @functools.cached_property
    def table(self) -> Array:
        """All of it, a row for each state or one for all (m, 83); see `equations`."""
        around = self.around
        columns = [
            *((value, ()) for value in (*self.law.row, *self.shape.row)),
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

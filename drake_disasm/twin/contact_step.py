"""One step of the twin with IMPACT contact, for many states at once."""

import dataclasses
import functools
from collections.abc import Sequence
from typing import Self

import numpy as np

from drake_disasm.common.arrays import (
    Array,
    array_like,
    matrix_of,
    namespace,
    to_numpy,
)
from drake_disasm.common.rotations import matrices_of_rpy
from drake_disasm.effects import Environment
from drake_disasm.twin.contact import solve_rows
from drake_disasm.twin.law import ImpactLaw
from drake_disasm.twin.shape import LockShape

#: What an error says.
NO_BALANCE = "IMPACT contact: no force balances this step"


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
        """All of it, a row for each state or one for all (m, 83); see `contact`."""
        around = self.around
        parts = [
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
        xp = namespace(around.friction)
        arrays = [(array_like(v, around.friction), shape) for v, shape in parts]
        rows = max(len(v) for v, shape in arrays if v.ndim > len(shape))
        columns = [
            xp.reshape(xp.broadcast_to(v, (rows, *shape)), (rows, -1))
            for v, shape in arrays
        ]
        return xp.concat(columns, axis=1)


@dataclasses.dataclass(frozen=True)
class ImpactStep:
    """What a step of the plant with contact comes to, for n states.

    The law is stiff: taken at the start of a step it explodes long before the upper
    bounds of the thesis. The plant's step without contact is linear in the twin's six
    joints, so the velocities v+ after it solve

        (M + h D + h^2 K) v+ = M v + h K (qd - q) + h D vd + h J^T f(q + h v+, v+)

    by Newton's method; f is IMPACT's at the end of the step, with Coulomb friction,
    regularised. The unknown is the bolt's twist [velocity of To; angular velocity] in
    G, T v+, where the groove's normals are the axes. Vectors are in Gn unless a name
    says G. States don't see each other: what one gives does not depend on its company.

    Arrays are NumPy's or torch's; what a GPU holds is computed there.

    Attributes:
        v: (n, 6) v+.
        wrench: (n, 6) of the contact on the bolt at Bo, [f; tau].
        is_solved: (n,) whether there is a balance.
    """

    v: Array
    wrench: Array
    is_solved: Array

    @classmethod
    def of(
        cls,
        conditions: ImpactConditions,
        h: float,
        q: Array,
        v: Array,
        qd: Array,
        vd: Array,
    ) -> Self:
        """Finds the step.

        Args:
            conditions: of the contact.
            h: the step [s].
            q, v: (n, 6) the twin's coordinates and their rates.
            qd, vd: (n, 6) commanded ones.
        """
        E, R_GnB = turning(q[:, 3:])
        state = (q, v, qd, vd, E, _rates_by_turning(q[:, 3:]), R_GnB)
        table = array_like(conditions.table, q)
        if not isinstance(q, np.ndarray) and q.device.type == "cuda":
            from drake_disasm.twin import on_gpu

            return cls(*on_gpu.solve_rows(table, h, state))
        rows = tuple(np.ascontiguousarray(to_numpy(each)) for each in state)
        after, wrench = np.empty(q.shape), np.empty(q.shape)
        is_solved = np.zeros(len(q), np.bool_)
        solve_rows(to_numpy(table), h, rows, after, wrench, is_solved)
        if isinstance(q, np.ndarray):
            return cls(after, wrench, is_solved)
        found = namespace(q).asarray(is_solved)
        return cls(array_like(after, q), array_like(wrench, q), found)


def turning(angles: Array) -> tuple[Array, Array]:
    """Returns E (n, 3, 3), w = E [yaw', pitch', roll'], and R_GnB of angles (n, 3)."""
    xp = namespace(angles)
    R_GnB = matrices_of_rpy(xp.flip(angles, axis=-1))
    s, c = xp.sin(angles[:, 0]), xp.cos(angles[:, 0])
    zero, one = xp.zeros_like(s), xp.ones_like(s)
    axes = [xp.stack(axis, axis=1) for axis in ([zero, zero, one], [-s, c, zero])]
    return xp.stack([*axes, R_GnB[:, :, 0]], axis=2), R_GnB


def _rates_by_turning(angles: Array) -> Array:
    """Returns the inverse (n, 3, 3) of `turning`'s E."""
    xp = namespace(angles)
    s, c = xp.sin(angles[:, 0]), xp.cos(angles[:, 0])
    sp, cp = xp.sin(angles[:, 1]), xp.cos(angles[:, 1])
    zero, one = xp.zeros_like(s), xp.ones_like(s)
    return matrix_of(
        [[c * sp / cp, s * sp / cp, one], [-s, c, zero], [c / cp, s / cp, zero]]
    )

"""One step of the twin with IMPACT contact, for many states at once."""

import dataclasses
from collections.abc import Sequence
from typing import Self

import numpy as np
from scipy.spatial.transform import Rotation

from drake_disasm.cell.grip import AXIS_ORDER, Springs
from drake_disasm.effects import Environment
from drake_disasm.impact.law import ImpactLaw
from drake_disasm.impact.shape import LockShape

_ITERATIONS = 60
_HALVINGS = 12
_TOLERANCE = 1e-8  # m/s, of the velocities after the step
_STICTION = 1e-4  # m/s: creep at which friction is three quarters


@dataclasses.dataclass(frozen=True)
class Surroundings:
    """What may differ from state to state; m is their number, or 1 for one for all.

    Attributes:
        friction: (m,) Coulomb coefficient.
        R_GnG, p_GnG: (m, 3, 3), (m, 3) the true groove in the nominal frame.
        f_Gn: (m, 3) force on the bolt at Bo other than the contact's, in Gn [N].
    """

    friction: np.ndarray
    R_GnG: np.ndarray
    p_GnG: np.ndarray
    f_Gn: np.ndarray

    @classmethod
    def of(cls, environments: Sequence[Environment]) -> Self:
        """Returns those of environments, one for each state or one for all."""
        return cls(
            np.array([e.friction for e in environments]),
            np.array([e.X_GnG.rotation().matrix() for e in environments]),
            np.array([e.X_GnG.translation() for e in environments]),
            np.array([e.force_Gn for e in environments]),
        )

    def spread(self, count: int) -> Self:
        """Returns the same for each of `count` states."""
        return type(self)(
            *(
                np.broadcast_to(value, (count, *value.shape[1:]))
                for value in (self.friction, self.R_GnG, self.p_GnG, self.f_Gn)
            )
        )


@dataclasses.dataclass(frozen=True)
class ImpactConditions:
    """All that the contact depends on except the state.

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
    M: np.ndarray
    K: np.ndarray
    D: np.ndarray
    p_BoTo_B: np.ndarray

    def sprung(self, springs: Springs) -> Self:
        """Returns the same with other springs in the twin's joints."""
        order = list(AXIS_ORDER)
        K, D = springs.stiffness[order], springs.damping[order]
        return dataclasses.replace(self, K=K, D=D)


@dataclasses.dataclass(frozen=True)
class _Balance:
    """How contact balances the rest at some velocities, for m states.

    Attributes:
        Q: (m, 6) generalised contact force J^T f.
        r: (m, 6) what is out of balance.
        slope: (m, 6, 6) dr/dv.
    """

    Q: np.ndarray
    r: np.ndarray
    slope: np.ndarray

    def select(self, which: np.ndarray) -> "_Balance":
        """Returns some of the states, by mask or index."""
        return _Balance(self.Q[which], self.r[which], self.slope[which])

    def put(self, where: np.ndarray, other: "_Balance") -> None:
        """Overwrites some of the states."""
        self.Q[where], self.r[where] = other.Q, other.r
        self.slope[where] = other.slope


class ImpactStep:
    """The velocities at which contact, springs and inertia balance after a step.

    The law is stiff: taken at the start of a step it explodes long before the upper
    bounds of the thesis. The plant's step without contact is linear in the twin's six
    joints, so the velocities v+ after it solve

        (M + h D + h^2 K) v+ = M v + h K (qd - q) + h D vd + h J^T f(q + h v+, v+)

    by Newton's method; f is IMPACT's at the end of the step, with Coulomb friction,
    regularised. Vectors are in Gn unless a name says G. States don't see each other:
    what one gives does not depend on its company.

    Args:
        conditions: of the contact.
        h: the step [s].
        q, v: (n, 6) the twin's coordinates and their rates.
        qd, vd: (n, 6) commanded ones.
    """

    def __init__(
        self,
        conditions: ImpactConditions,
        h: float,
        q: np.ndarray,
        v: np.ndarray,
        qd: np.ndarray,
        vd: np.ndarray,
    ) -> None:
        c = self._c = conditions
        self._h = h
        self._A = c.M + np.diag(h * c.D + h**2 * c.K)
        self._around = c.around.spread(len(q))
        self.E, R_GnB = turning(q[:, 3:])
        self._p_ToBo = -R_GnB @ c.p_BoTo_B
        pull = c.K * (qd - q) + c.D * vd
        pull[:, :3] += self._around.f_Gn
        turn = np.cross(self._p_ToBo, self._around.f_Gn)
        pull[:, 3:] += np.einsum("nji,nj->ni", self.E, turn)
        self._b = _times(c.M, v) + h * pull
        self._place(R_GnB, q[:, :3] + c.p_BoTo_B + self._p_ToBo)

    def solve(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns v+ (n, 6) and the wrench on the bolt at Bo, [f; tau] (n, 6).

        Raises:
            RuntimeError: no force balances the step of some state.
        """
        v = np.linalg.solve(self._A, self._b[..., None])[..., 0]
        todo = np.arange(len(v))
        balance = self._balance(todo, v)
        for _ in range(_ITERATIONS):
            now = balance.select(todo)
            step = np.linalg.solve(now.slope, -now.r[..., None])[..., 0]
            moves = np.abs(step).max(axis=1) >= _TOLERANCE
            todo = todo[moves]
            todo = self._descend(todo, v, step[moves], balance)
            if not len(todo):
                break
        else:
            raise RuntimeError("IMPACT contact: no force balances this step")
        f = balance.Q[:, :3]
        turn = np.linalg.solve(self.E.swapaxes(1, 2), balance.Q[:, 3:, None])
        return v, np.hstack([f, turn[..., 0] - np.cross(self._p_ToBo, f)])

    def _descend(
        self, todo: np.ndarray, v: np.ndarray, step: np.ndarray, balance: _Balance
    ) -> np.ndarray:
        """Goes to the first point along each Newton step whose error is lower.

        Where the law jumps (an exponent below 1, full damping at once) there may be
        none: then the jump is where the bolt stays.

        Args:
            todo: (m,) which states.
            v, balance: of all states; changed in place.
            step: (m, 6).

        Returns:
            those of `todo` that have moved.
        """
        moved = np.zeros(len(todo), bool)
        for scale in 0.5 ** np.arange(_HALVINGS):
            left = np.flatnonzero(~moved)
            if not len(left):
                break
            rows = todo[left]
            there = v[rows] + scale * step[left]
            found = self._balance(rows, there)
            lower = _squares(found.r) < _squares(balance.r[rows])
            v[rows[lower]] = there[lower]
            balance.put(rows[lower], found.select(lower))
            moved[left[lower]] = True
        return todo[moved]

    def _place(self, R_GnB: np.ndarray, p_GnBo: np.ndarray) -> None:
        """Finds the places that could touch, and their Jacobians."""
        R_GnG = self._around.R_GnG
        p_GBo = np.einsum("nji,nj->ni", R_GnG, p_GnBo - self._around.p_GnG)
        found = self._c.shape.contacts(np.einsum("nji,njk->nik", R_GnG, R_GnB), p_GBo)
        self._p = found.penetration
        self._n = np.einsum("nij,kj->nki", R_GnG, found.normal)
        self._arm = np.einsum("nij,nkj->nki", R_GnG, found.arm)
        self._arm = self._arm + self._p_ToBo[:, None]  # from To, which the joints move
        lever = np.cross(self._arm, self._n)
        turn = np.einsum("nki,nij->nkj", lever, self.E)
        self._Jn = np.concatenate([self._n, turn], axis=2)

    def _balance(self, rows: np.ndarray, v: np.ndarray) -> _Balance:
        """Returns the balance of some states, at v+ = v (m, 6)."""
        h = self._h
        rate = -np.einsum("nkj,nj->nk", self._Jn[rows], v)
        depth = self._p[rows] + h * rate
        state, place = np.nonzero(depth > 0.0)  # a pair is a touching place
        F, kp, kd = self._c.law.force_and_slopes(
            depth[state, place], rate[state, place]
        )
        mu = self._around.friction[rows[state]]
        Jn = self._Jn[rows[state], place]
        Jt = self._tangent(rows[state], place, Jn)
        slip = np.einsum("nij,nj->ni", Jt, v[state])
        speed = np.sqrt(_squares(slip) + _STICTION**2)
        drag, along = mu * F / speed, slip / speed[:, None]
        Q = F[:, None] * Jn - np.einsum("n,ni,nij->nj", drag, slip, Jt)
        dF = -(h * kp + kd)[:, None] * Jn
        turning = np.einsum("ni,nij->nj", along, Jt)
        d_slip = Jt - along[:, :, None] * turning[:, None, :]
        rubbing = drag[:, None, None] * d_slip
        rubbing += (mu[:, None] * along)[:, :, None] * dF[:, None, :]
        dQ = Jn[:, :, None] * dF[:, None, :] - Jt.swapaxes(1, 2) @ rubbing
        total, slope = (_sums(part, state, len(rows)) for part in (Q, dQ))
        r = _times(self._A, v) - self._b[rows] - h * total
        return _Balance(total, r, self._A - h * slope)

    def _tangent(
        self, row: np.ndarray, place: np.ndarray, Jn: np.ndarray
    ) -> np.ndarray:
        """Returns the Jacobians (c, 3, 6) of sliding at pairs (c,)."""
        J = np.empty((len(row), 3, 6))
        J[:, :, :3] = np.eye(3)
        J[:, :, 3:] = -_skew(self._arm[row, place]) @ self.E[row]
        return J - self._n[row, place][:, :, None] * Jn[:, None, :]


def turning(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns E (n, 3, 3), w = E [yaw', pitch', roll'], and R_GnB of angles (n, 3)."""
    R_GnB = Rotation.from_euler("ZYX", angles).as_matrix()
    s, c, zero = np.sin(angles[:, 0]), np.cos(angles[:, 0]), 0.0 * angles[:, 0]
    axes = [[zero, zero, 1.0 + zero], [-s, c, zero], list(R_GnB[:, :, 0].T)]
    return np.moveaxis(np.array(axes), 2, 0).swapaxes(1, 2), R_GnB


def _times(matrix: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Returns a matrix times each of vectors (..., n)."""
    return np.einsum("ij,...j->...i", matrix, vectors)


def _squares(vectors: np.ndarray) -> np.ndarray:
    """Returns the squared length of each of vectors (n, d)."""
    return np.einsum("ni,ni->n", vectors, vectors)


def _sums(parts: np.ndarray, state: np.ndarray, count: int) -> np.ndarray:
    """Returns for each of `count` states the sum of its parts; `state` ascends."""
    total = np.zeros((count, *parts.shape[1:]))
    present, first = np.unique(state, return_index=True)
    if len(present):
        total[present] = np.add.reduceat(parts, first, axis=0)
    return total


def _skew(a: np.ndarray) -> np.ndarray:
    """Returns [a]x (n, 3, 3) of vectors (n, 3)."""
    x, y, z = a.T
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.moveaxis(np.array(rows), 2, 0)

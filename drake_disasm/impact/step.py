"""One step of the twin with IMPACT contact, for many states at once."""

import dataclasses
from collections.abc import Sequence
from typing import Self

import numpy as np

from drake_disasm.common.arrays import (
    Array,
    apply_matrix,
    array_device,
    array_like,
    cross,
    matrix_of,
    namespace,
    segment_sums,
    transposed,
)
from drake_disasm.common.rotations import matrices_of_rpy
from drake_disasm.effects import Environment
from drake_disasm.impact.law import ImpactLaw
from drake_disasm.impact.shape import NORMALS, LockShape

#: What an error says.
NO_BALANCE = "IMPACT contact: no force balances this step"

_ITERATIONS = 60
#: Parts of a Newton step that are tried where the whole one does not help: the larger
#: ones, which mostly do, before the others.
_SHORTER = 0.5 ** np.arange(1, 4), 0.5 ** np.arange(4, 12)
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

    def spread(self, count: int) -> Self:
        """Returns the same for each of `count` states."""
        xp = namespace(self.friction)
        return type(self)(
            *(
                xp.broadcast_to(value, (count, *value.shape[1:]))
                for value in (self.friction, self.R_GnG, self.p_GnG, self.f_Gn)
            )
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


@dataclasses.dataclass(frozen=True)
class _Balance:
    """How contact balances the rest at some twists, for m states.

    Attributes:
        W: (m, 6) the contact's wrench on the bolt [f; tau] at To in G.
        r: (m, 6) what is out of balance, likewise.
        slope: (m, 6, 6) dr by the twist.
    """

    W: Array
    r: Array
    slope: Array

    def select(self, which: Array) -> "_Balance":
        """Returns some of the states, by mask or index."""
        return _Balance(self.W[which], self.r[which], self.slope[which])

    def put(self, where: Array, other: "_Balance") -> None:
        """Overwrites some of the states."""
        self.W[where], self.r[where] = other.W, other.r
        self.slope[where] = other.slope


class ImpactStep:
    """The velocities at which contact, springs and inertia balance after a step.

    The law is stiff: taken at the start of a step it explodes long before the upper
    bounds of the thesis. The plant's step without contact is linear in the twin's six
    joints, so the velocities v+ after it solve

        (M + h D + h^2 K) v+ = M v + h K (qd - q) + h D vd + h J^T f(q + h v+, v+)

    by Newton's method; f is IMPACT's at the end of the step, with Coulomb friction,
    regularised. The unknown is the bolt's twist [velocity of To; angular velocity] in
    G, T v+, where the groove's normals are the axes. Vectors are in Gn unless a name
    says G. States don't see each other: what one gives does not depend on its company.
    Arrays are NumPy's or torch's.

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
        q: Array,
        v: Array,
        qd: Array,
        vd: Array,
    ) -> None:
        c = self._c = conditions
        self._h, self._xp = h, namespace(q)
        around = self._around = c.around.spread(len(q))
        E, R_GnB = turning(q[:, 3:])
        self._p_ToBo = -apply_matrix(R_GnB, c.p_BoTo_B)
        self._T, self._T_inverse = self._twist_by_rates(E, q[:, 3:])
        one = array_like(np.eye(6), q)
        A = c.M + one * (h * c.D + h**2 * c.K)[..., None, :]
        pull = c.K * (qd - q) + c.D * vd
        pull[:, :3] += around.f_Gn
        turn = cross(self._p_ToBo, around.f_Gn)
        pull[:, 3:] += apply_matrix(transposed(E), turn)
        back = transposed(self._T_inverse)
        self._A = self._xp.matmul(back, self._xp.matmul(A, self._T_inverse))
        self._b = apply_matrix(back, apply_matrix(c.M, v) + h * pull)
        self._before = apply_matrix(self._T, v)
        self._place(R_GnB, q[:, :3] + c.p_BoTo_B + self._p_ToBo)

    def solve(self) -> tuple[Array, Array]:
        """Returns v+ (n, 6) and the wrench on the bolt at Bo, [f; tau] (n, 6).

        Raises:
            RuntimeError: no force balances the step of some state.
        """
        v, wrench, is_solved = self.attempt()
        if not bool(self._xp.all(is_solved)):
            raise RuntimeError(NO_BALANCE)
        return v, wrench

    def attempt(self) -> tuple[Array, Array, Array]:
        """Returns what `solve` does, and for which states it found a balance (n,)."""
        xp = self._xp
        alone = xp.linalg.solve(self._A, self._b[..., None])[..., 0]
        every = xp.arange(len(alone), device=array_device(alone))
        twist, balance = xp.asarray(alone, copy=True), self._balance(every, alone)
        is_finite = xp.isfinite(xp.sum(balance.r, axis=1))
        touching = is_finite & xp.any(balance.W != 0.0, axis=1)
        # A bolt that leans on a wall mostly goes on doing so.
        rows = every[touching]
        guessed = xp.zeros_like(touching)
        guessed[rows] = self._take_better(rows, self._before[rows], twist, balance)
        stuck, unfinished = self._newton(rows, twist, balance)
        again = xp.concat([stuck, unfinished])
        again = again[guessed[again]]
        if len(again):
            twist[again] = alone[again]
            balance.put(again, self._balance(again, alone[again]))
            is_finite[unfinished] = guessed[unfinished]
            _, unfinished = self._newton(again, twist, balance)
        is_finite[unfinished] = False
        f, t_To = (self._in_Gn(part) for part in (balance.W[:, :3], balance.W[:, 3:]))
        wrench = xp.concat([f, t_To - cross(self._p_ToBo, f)], axis=1)
        return apply_matrix(self._T_inverse, twist), wrench, is_finite

    def _newton(
        self, todo: Array, twist: Array, balance: _Balance
    ) -> tuple[Array, Array]:
        """Solves some states, by index (m,), from their twists on.

        Returns:
            those that stay where no step leads to less error, and those that were not
            done after the last iteration.
        """
        xp, stuck = self._xp, [todo[:0]]
        for _ in range(_ITERATIONS):
            now = balance.select(todo)
            step = xp.linalg.solve(now.slope, -now.r[..., None])[..., 0]
            moves = xp.max(xp.abs(step), axis=1) >= _TOLERANCE
            todo = todo[moves]
            todo, stays = self._descend(todo, twist, step[moves], balance)
            stuck.append(stays)
            if not len(todo):
                break
        return xp.concat(stuck), todo

    def _take_better(
        self, rows: Array, there: Array, twist: Array, balance: _Balance
    ) -> Array:
        """Takes other twists (m, 6) for some rows (m,) where their error is lower.

        Args:
            rows: (m,) which states.
            there: (m, 6).
            twist, balance: of all states; changed in place.

        Returns:
            for which of the rows (m,) it did.
        """
        found = self._balance(rows, there)
        lower = _squares(found.r) < _squares(balance.r[rows])
        twist[rows[lower]] = there[lower]
        balance.put(rows[lower], found.select(lower))
        return lower

    def _descend(
        self, todo: Array, twist: Array, step: Array, balance: _Balance
    ) -> tuple[Array, Array]:
        """Goes to the first point along each Newton step whose error is lower.

        Where the law jumps (an exponent below 1, full damping at once) there may be
        none: then the jump is where the bolt stays.

        Args:
            todo: (m,) which states.
            twist, balance: of all states; changed in place.
            step: (m, 6).

        Returns:
            those of `todo` that have moved, and those that have not.
        """
        xp = self._xp
        moved = self._take_better(todo, twist[todo] + step, twist, balance)
        for scales in _SHORTER:
            left = xp.nonzero(~moved)[0]
            if len(left):
                parts = step[left], array_like(scales, step)
                moved[left] = self._take_part(todo[left], twist, *parts, balance)
        return todo[moved], todo[~moved]

    def _take_part(
        self, rows: Array, twist: Array, step: Array, scales: Array, balance: _Balance
    ) -> Array:
        """Goes to the first of some parts of a step whose error is lower.

        All parts are tried at once. See `_descend`.

        Returns:
            for which of the rows (m,) there is one.
        """
        xp, count = self._xp, len(rows)
        there = twist[rows][:, None] + scales[:, None] * step[:, None]
        every = xp.repeat(rows, len(scales))
        found = self._balance(every, xp.reshape(there, (-1, 6)))
        error = xp.reshape(_squares(found.r), (count, -1))
        lower = error < _squares(balance.r[rows])[:, None]
        first = xp.argmax(xp.astype(lower, xp.int8), axis=1)
        has_one = xp.any(lower, axis=1)
        which = xp.arange(count, device=array_device(step))[has_one]
        chosen = first[has_one]
        twist[rows[has_one]] = there[which, chosen]
        balance.put(rows[has_one], found.select(which * len(scales) + chosen))
        return has_one

    def _twist_by_rates(self, E: Array, angles: Array) -> tuple[Array, Array]:
        """Returns T (n, 6, 6), the twist in G by the coordinates' rates, and T^-1."""
        xp, R_GnG = self._xp, self._around.R_GnG
        R_GGn, zero = transposed(R_GnG), xp.zeros_like(E)
        E_inverse = _rates_by_turning(angles)
        T = _blocks(R_GGn, zero, xp.matmul(R_GGn, E))
        return T, _blocks(R_GnG, zero, xp.matmul(E_inverse, R_GnG))

    def _in_Gn(self, vectors: Array) -> Array:
        """Returns vectors (n, 3) of G in Gn."""
        return apply_matrix(self._around.R_GnG, vectors)

    def _place(self, R_GnB: Array, p_GnBo: Array) -> None:
        """Finds the places that could touch, about To in G."""
        xp, around = self._xp, self._around
        R_GGn = transposed(around.R_GnG)
        p_GBo = apply_matrix(R_GGn, p_GnBo - around.p_GnG)
        found = self._c.shape.contacts(xp.matmul(R_GGn, R_GnB), p_GBo)
        self._p = found.penetration
        p_ToBo_G = apply_matrix(R_GGn, self._p_ToBo)
        arm = found.arm + p_ToBo_G[:, None]  # from To, which the joints move
        self._arm = xp.asarray(xp.permute_dims(arm, (2, 0, 1)), copy=True)
        self._normals = array_like(NORMALS.T, p_GBo)
        self._lever = _cross(self._arm, self._normals[:, None])

    def _balance(self, rows: Array, twist: Array) -> _Balance:
        """Returns the balance of some states, at twists (m, 6) after the step."""
        xp, h, places = self._xp, self._h, self._normals.shape[1]
        rate = -xp.matmul(twist[:, :3], self._normals)
        for axis in range(3):
            rate -= self._lever[axis][rows] * twist[:, 3 + axis, None]
        depth = self._p[rows] + h * rate
        pair = xp.nonzero(xp.reshape(depth > 0.0, (-1,)))[0]  # a touching place
        state, place = pair // places, pair % places
        F, kp, kd = self._c.law.select(rows[state]).force_and_slopes(
            xp.reshape(depth, (-1,))[pair], xp.reshape(rate, (-1,))[pair]
        )
        arm = xp.reshape(self._arm, (3, -1))[:, rows[state] * places + place]
        n = self._normals[:, place]
        mu = self._around.friction[rows[state]]
        moves = xp.matrix_transpose(twist)[:, state]
        velocity = moves[:3] + _cross(moves[3:], arm)
        force, slope = _force_and_slope(n, velocity, F, h * kp + kd, mu)
        W, dW = _wrench_and_slope(arm, force, slope)
        parts = xp.concat([W, xp.reshape(dW, (36, -1))])
        sums = segment_sums(parts, state, len(rows))
        W, dW = sums[:, :6], xp.reshape(sums[:, 6:], (-1, 6, 6))
        A = self._A[rows]
        r = apply_matrix(A, twist) - self._b[rows] - h * W
        return _Balance(W, r, A - h * dW)


# For touching places, components come first: an operation then runs along the places.


def _force_and_slope(
    n: Array, velocity: Array, F: Array, dF: Array, mu: Array
) -> tuple[Array, Array]:
    """Returns forces (3, c) at touching places, and their slopes (3, 3, c).

    Coulomb friction, regularised: mu F s / sqrt(s^2 + stiction^2) against the slip s.

    Args:
        n: (3, c) normals, along the axes.
        velocity: (3, c) of the bolt there.
        F: (c,) normal force [N].
        dF: (c,) by which it falls with the velocity along the normal [N s/m].
        mu: (c,) coefficient of friction.
    """
    xp = namespace(velocity)
    across = 1.0 - n * n  # the two axes along which it slips
    slip = velocity * across
    speed = xp.sqrt(xp.sum(slip * slip, axis=0) + _STICTION**2)
    along, drag = slip / speed, mu * F / speed
    force = F * n - drag * slip
    by_normal = dF * (mu * along - n)
    slope = by_normal[:, None] * n[None] + (drag * along)[:, None] * along[None]
    for axis in range(3):
        slope[axis, axis] -= drag * across[axis]
    return force, slope


def _wrench_and_slope(arm: Array, force: Array, slope: Array) -> tuple[Array, Array]:
    """Returns wrenches (6, c) about a point, and their slopes (6, 6, c) by the twist.

    Args:
        arm: (3, c) from the point to the place.
        force, slope: (3, c), (3, 3, c) there, by the place's velocity.
    """
    xp = namespace(arm)
    wrench = xp.concat([force, _cross(arm, force)])
    turned = xp.permute_dims(slope, (1, 0, 2))
    by_turn = xp.permute_dims(_cross(arm[:, None], turned), (1, 0, 2))
    top = xp.concat([slope, by_turn], axis=1)
    return wrench, xp.concat([top, _cross(arm[:, None], top)])


def _cross(a: Array, b: Array) -> Array:
    """Returns the cross product of vectors (3, ...)."""
    (a1, a2, a3), (b1, b2, b3) = a, b
    parts = [a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1]
    return namespace(a).stack(parts)


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


def _blocks(one: Array, zero: Array, other: Array) -> Array:
    """Returns matrices (n, 6, 6) of two blocks (n, 3, 3) on the diagonal."""
    xp = namespace(one)
    rows = xp.concat([one, zero], axis=2), xp.concat([zero, other], axis=2)
    return xp.concat(rows, axis=1)


def _squares(vectors: Array) -> Array:
    """Returns the squared length of each of vectors (n, d)."""
    return namespace(vectors).sum(vectors * vectors, axis=1)

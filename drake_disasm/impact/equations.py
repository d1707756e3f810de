"""The contact's equations for one state after the other, compiled.

Of a step of `ImpactStep`: twists are [velocity of To; angular velocity] in G, and
wrenches [f; tau] at To in G, (6,) each.
"""

import math
from typing import NamedTuple

import numpy as np

from drake_disasm.common.compiled import compiled

_MM = 1000.0
_LEAST = 1e-12  # mm: a power of zero has no slope
_STICTION = 1e-4  # m/s: creep at which friction is three quarters
_ITERATIONS = 60
_SHORTEST = 11  # times that a step is halved before it is given up
_TOLERANCE = 1e-8  # m/s, of the velocities after the step
#: How Newton's method ends: solved; where no step leads to less error; not done.
_SOLVED, _STUCK, _UNFINISHED = 0, 1, 2

_RIM_POINTS = 8
_ANGLES = 2.0 * np.pi * np.arange(_RIM_POINTS) / _RIM_POINTS
_RIM = np.column_stack([np.cos(_ANGLES), 0.0 * _ANGLES, np.sin(_ANGLES)])


def _normals() -> np.ndarray:
    """Returns the normals (k, 3) of all places, out of the groove."""
    across = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    stops = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    up = np.array([[0.0, 1.0, 0.0]])
    planes = np.repeat(np.concatenate([-up, up]), _RIM_POINTS, axis=0)
    return np.concatenate([across, across, across, stops, planes])


#: (k, 3) of all places, out of the groove, towards the bolt, in G: along its axes.
NORMALS = _normals()
_PLACES = len(NORMALS)
# Along which axis, and to which side.
_AXES = np.argmax(np.abs(NORMALS), axis=1)
_SIDES = np.sum(NORMALS, axis=1)
#: Where a row of `ImpactConditions.table` has what.
_LAW, _LOCK = slice(0, 4), slice(4, 16)
_FRICTION, _R_GNG, _P_GNG, _F_GN = 16, slice(17, 26), slice(26, 29), slice(29, 32)
_M, _K, _D, _P_BOTO = slice(32, 68), slice(68, 74), slice(74, 80), slice(80, 83)


class Known(NamedTuple):
    """What a step's balance depends on, but for the twist.

    Attributes:
        A, b: (6, 6), (6,) of the step without contact, A twist = b.
        h: the step [s].
        friction: Coulomb coefficient.
        law: (4,) of the normal force.
        depth, arm: (k,), (k, 3) of the places before the step, from To in G.
    """

    A: np.ndarray
    b: np.ndarray
    h: float
    friction: float
    law: np.ndarray
    depth: np.ndarray
    arm: np.ndarray


@compiled
def solve_rows(
    table: np.ndarray,
    h: float,
    q: np.ndarray,
    v: np.ndarray,
    qd: np.ndarray,
    vd: np.ndarray,
    E: np.ndarray,
    E_inverse: np.ndarray,
    R_GnB: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns what `ImpactStep` has, of one state after the other.

    Args:
        table: (m, 83) of `ImpactConditions`.
        h: the step [s].
        q, v, qd, vd: (n, 6).
        E, E_inverse, R_GnB: (n, 3, 3), see `turning`.
    """
    depth, arm = np.empty(_PLACES), np.empty((_PLACES, 3))
    W, turn = np.empty(6), np.empty(3)
    after, wrench = np.empty(q.shape), np.empty(q.shape)
    is_solved = np.zeros(len(q), np.bool_)
    for i in range(len(q)):
        c = table[i] if len(table) > 1 else table[0]
        R_GnG = c[_R_GNG].reshape(3, 3)
        p_ToBo = -(R_GnB[i] @ c[_P_BOTO])
        T, T_inverse = np.zeros((6, 6)), np.zeros((6, 6))
        T[:3, :3], T[3:, 3:] = R_GnG.T, R_GnG.T @ E[i]
        T_inverse[:3, :3], T_inverse[3:, 3:] = R_GnG, E_inverse[i] @ R_GnG
        A, b = _without_contact(c, h, q[i], v[i], qd[i], vd[i], E[i], p_ToBo)
        A, b = T_inverse.T @ A @ T_inverse, T_inverse.T @ b
        p_GnBo = q[i, :3] + c[_P_BOTO] + p_ToBo
        p_GBo = R_GnG.T @ (p_GnBo - c[_P_GNG])
        find_places(R_GnG.T @ R_GnB[i], p_GBo, c[_LOCK], depth, arm)
        arm += R_GnG.T @ p_ToBo  # from To, which the joints move
        known = Known(A, b, h, c[_FRICTION], c[_LAW], depth, arm)
        twist, is_solved[i] = _solve(known, T @ v[i], W)
        after[i] = T_inverse @ twist
        wrench[i, :3], wrench[i, 3:] = R_GnG @ W[:3], R_GnG @ W[3:]
        _cross(p_ToBo, wrench[i, :3], turn)
        wrench[i, 3:] -= turn
    return after, wrench, is_solved


@compiled
def _without_contact(
    c: np.ndarray,
    h: float,
    q: np.ndarray,
    v: np.ndarray,
    qd: np.ndarray,
    vd: np.ndarray,
    E: np.ndarray,
    p_ToBo: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns A (6, 6) and b (6,) of the step without contact, A v+ = b."""
    M, K, D, f = c[_M].reshape(6, 6), c[_K], c[_D], c[_F_GN]
    pull, turn = K * (qd - q) + D * vd, np.empty(3)
    _cross(p_ToBo, f, turn)
    pull[:3] += f
    pull[3:] += E.T @ turn
    return M + np.diag(h * D + h * h * K), M @ v + h * pull


@compiled
def _solve(
    known: Known, before: np.ndarray, wrench: np.ndarray
) -> tuple[np.ndarray, bool]:
    """Returns the twist (6,) of the balance, and whether there is one.

    Args:
        known: of the step.
        before: (6,) the twist before it.
        wrench: (6,) is set, the contact's on the bolt.
    """
    r, held, slope, alone = np.empty(6), np.empty(6), known.A.copy(), known.b.copy()
    solve_in_place(slope, alone)
    balance(known, alone, wrench, r, slope)
    if not np.isfinite(np.sum(r)) or not np.any(wrench != 0.0):
        return alone, np.isfinite(np.sum(r))
    # A bolt that leans on a wall mostly goes on doing so.
    balance(known, before, wrench, held, slope)
    if squared(held) < squared(r):
        twist = before.copy()
        if newton(known, twist, wrench) == _SOLVED:
            return twist, True
    ending = newton(known, alone, wrench)
    return alone, ending != _UNFINISHED


@compiled
def balance(
    known: Known,
    twist: np.ndarray,
    wrench: np.ndarray,
    r: np.ndarray,
    slope: np.ndarray,
) -> None:
    """Finds what is out of balance at a twist after the step: A twist - b - h W.

    Args:
        known: of the step.
        twist: (6,).
        wrench: (6,) is set, the contact's on the bolt, W.
        r: (6,) is set.
        slope: (6, 6) is set, dr by the twist.
    """
    A, h, arm = known.A, known.h, known.arm
    wrench[:], slope[:] = 0.0, 0.0
    velocity, force = np.empty(3), np.empty(3)
    by_twist = np.empty((3, 6))
    for k in range(_PLACES):
        _cross(twist[3:], arm[k], velocity)
        for i in range(3):
            velocity[i] += twist[i]
        rate = -_SIDES[k] * velocity[_AXES[k]]
        after = known.depth[k] + h * rate
        if after <= 0.0:
            continue
        F, by_depth, by_rate = normal_force(after, rate, known.law)
        dF, mu = h * by_depth + by_rate, known.friction
        _push(_AXES[k], _SIDES[k], velocity, F, dF, mu, force, by_twist)
        _add_wrench(arm[k], force, by_twist, wrench, slope)
    for i in range(6):
        r[i] = -known.b[i] - h * wrench[i]
        for j in range(6):
            r[i] += A[i, j] * twist[j]
            slope[i, j] = A[i, j] - h * slope[i, j]


@compiled
def _push(
    axis: int,
    side: float,
    velocity: np.ndarray,
    F: float,
    dF: float,
    mu: float,
    force: np.ndarray,
    slope: np.ndarray,
) -> None:
    """Finds the force at a touching place, and its slope by the place's velocity.

    Coulomb friction, regularised: mu F s / sqrt(s^2 + stiction^2) against the slip s.

    Args:
        axis, side: of the normal.
        velocity: (3,) of the bolt there.
        F: normal force [N].
        dF: by which it falls with the velocity along the normal [N s/m].
        mu: coefficient of friction.
        force: (3,) is set.
        slope: (3, 6), of which [:, :3] is set.
    """
    one, other = (axis + 1) % 3, (axis + 2) % 3
    speed = math.sqrt(velocity[one] ** 2 + velocity[other] ** 2 + _STICTION**2)
    drag = mu * F / speed
    force[axis], slope[axis, axis] = side * F, -dF
    for i, j in ((one, other), (other, one)):
        along = velocity[i] / speed
        force[i] = -drag * velocity[i]
        slope[i, axis], slope[axis, i] = side * dF * mu * along, 0.0
        slope[i, i] = drag * (along * along - 1.0)
        slope[i, j] = drag * along * velocity[j] / speed


@compiled
def _add_wrench(
    arm: np.ndarray,
    force: np.ndarray,
    by_twist: np.ndarray,
    wrench: np.ndarray,
    slope: np.ndarray,
) -> None:
    """Adds a force to the wrench, and what it changes by the twist to the slope.

    Args:
        arm: (3,) from To to the place.
        force: (3,) there.
        by_twist: (3, 6), its slope by the place's velocity in [:, :3].
        wrench, slope: (6,), (6, 6), to which is added.
    """
    torque = np.empty(3)
    _cross(arm, force, torque)
    for i in range(3):
        wrench[i] += force[i]
        wrench[3 + i] += torque[i]
        _cross(arm, by_twist[i, :3], by_twist[i, 3:])
    for j in range(6):
        _cross(arm, by_twist[:, j], torque)
        for i in range(3):
            slope[i, j] += by_twist[i, j]
            slope[3 + i, j] += torque[i]


@compiled
def newton(known: Known, twist: np.ndarray, wrench: np.ndarray) -> int:
    """Goes from a twist to the balance; returns how it ended.

    A Newton step is halved until the error is lower. Where the law jumps (an exponent
    below 1, full damping at once) there may be no such step: then the jump is where
    the bolt stays.

    Args:
        known: of the step.
        twist: (6,) is changed in place.
        wrench: (6,) is set, the contact's on the bolt.
    """
    r, slope, step, there = np.empty(6), np.empty((6, 6)), np.empty(6), np.empty(6)
    trial, trial_slope, W = np.empty(6), np.empty((6, 6)), np.empty(6)
    balance(known, twist, wrench, r, slope)
    for _ in range(_ITERATIONS):
        error = squared(r)
        for i in range(6):
            step[i] = -r[i]
        solve_in_place(slope, step)
        if np.max(np.abs(step)) < _TOLERANCE:
            return _SOLVED
        for _ in range(1 + _SHORTEST):
            for i in range(6):
                there[i] = twist[i] + step[i]
            balance(known, there, W, trial, trial_slope)
            if squared(trial) < error:
                break
            step *= 0.5
        else:
            return _STUCK
        twist[:], wrench[:], r[:], slope[:] = there, W, trial, trial_slope
    return _UNFINISHED


@compiled
def squared(vector: np.ndarray) -> float:
    """Returns the squared length of a vector (n,)."""
    total = 0.0
    for value in vector:
        total += value * value
    return total


@compiled
def solve_in_place(A: np.ndarray, x: np.ndarray) -> None:
    """Solves A x = b by Gauss's elimination with pivots.

    Numba's own solver raises where A is singular; here x is then not finite.

    Args:
        A: (n, n); is changed.
        x: (n,) b; is replaced by the solution.
    """
    n = len(x)
    for k in range(n):
        pivot = k + np.argmax(np.abs(A[k:, k]))
        if pivot != k:
            for j in range(k, n):
                A[k, j], A[pivot, j] = A[pivot, j], A[k, j]
            x[k], x[pivot] = x[pivot], x[k]
        for i in range(k + 1, n):
            factor = A[i, k] / A[k, k]
            for j in range(k + 1, n):
                A[i, j] -= factor * A[k, j]
            x[i] -= factor * x[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            x[k] -= A[k, j] * x[j]
        x[k] /= A[k, k]


@compiled
def _cross(a: np.ndarray, b: np.ndarray, out: np.ndarray) -> None:
    """Sets the cross product of vectors (3,)."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@compiled
def normal_force(
    penetration: float, rate: float, law: np.ndarray
) -> tuple[float, float, float]:
    """Returns F [N], dF/dp [N/m] and dF/d(dp/dt) [N s/m]; see `ImpactLaw`.

    Args:
        penetration: [m].
        rate: of the penetration [m/s].
        law: (4,) its parameters (`ImpactLaw.row`).
    """
    stiffness, exponent, damping, depth = law
    if penetration <= 0.0:
        return 0.0, 0.0, 0.0
    p, depth = max(_LEAST, penetration * _MM), max(_LEAST, depth)
    x = min(1.0, p / depth)
    elastic, full = stiffness * p**exponent, damping * x * x * (3.0 - 2.0 * x)
    force = elastic + full * rate * _MM
    if force <= 0.0:
        return 0.0, 0.0, 0.0
    ramp = damping * 6.0 * x * (1.0 - x) / depth
    slope = elastic * exponent / p + ramp * rate * _MM
    return force, slope * _MM, full * _MM


@compiled
def find_places(
    R_GB: np.ndarray,
    p_GBo: np.ndarray,
    lock: np.ndarray,
    depth: np.ndarray,
    arm: np.ndarray,
) -> None:
    """Finds the places where bolt and groove could touch.

    Args:
        R_GB: (3, 3) rotation matrix.
        p_GBo: (3,) [m].
        lock: (12,) its dimensions (`LockShape.row`).
        depth: (k,) is set: penetration [m], negative where there is a gap.
        arm: (k, 3) is set: from Bo to the place in G [m].
    """
    slot, wall, lips_end, lip, under_lip, floor = lock[:6]
    start, end, neck, head, top, bottom = lock[6:]
    up = R_GB[:, 1]
    for first, height in ((0, lip), (2, -lip)):
        _circle_between(height * up, p_GBo, 2, neck, slot, first, depth, arm)
        if p_GBo[0] + height * up[0] >= lips_end:
            depth[first : first + 2] = -1.0
    middle = (top + bottom) / 2.0 * up
    _circle_between(middle, p_GBo, 2, head, wall, 4, depth, arm)
    _circle_between(middle, p_GBo, 0, head, end, 6, depth, arm)
    depth[7] = start - (p_GBo[0] + middle[0] - head)
    for i in range(_RIM_POINTS):
        above, below = 8 + i, 8 + _RIM_POINTS + i
        for axis in range(3):
            rim = head * (R_GB[axis, 0] * _RIM[i, 0] + R_GB[axis, 2] * _RIM[i, 2])
            arm[above, axis] = rim + top * up[axis]
            arm[below, axis] = rim + bottom * up[axis]
        x, y, z = p_GBo + arm[above]
        is_covered = x < lips_end and abs(z) > slot
        is_inside = y < under_lip + head  # not yet lifted out
        depth[above] = y - under_lip if is_covered and is_inside else -1.0
        depth[below] = floor - (p_GBo[1] + arm[below, 1])


@compiled
def _circle_between(
    centre: np.ndarray,
    p_GBo: np.ndarray,
    along: int,
    radius: float,
    wall: float,
    first: int,
    depth: np.ndarray,
    arm: np.ndarray,
) -> None:
    """Sets two places, of a circle between two walls.

    Args:
        centre: (3,) of the circle, from Bo.
        p_GBo: (3,) [m].
        along: number of the axis across the walls, at -wall and wall.
        radius, wall: [m].
        first: number of the first of the two places.
        depth, arm: see `find_places`.
    """
    place = p_GBo[along] + centre[along]
    for i, side in ((first, 1.0), (first + 1, -1.0)):
        depth[i] = radius - wall + side * place
        arm[i] = centre
        arm[i, along] += side * radius

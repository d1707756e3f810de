"""The contact's equations for one state after the other, compiled.

Of a step of `ImpactStep`: twists are [velocity of To; angular velocity] in G, and
wrenches [f; tau] at To in G, (6,) each.

`on_gpu` has the same functions compiled for a GPU, whose threads can neither allocate
arrays nor compute with whole ones: what is computed stands in a `Workspace`.
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
_ROUNDS = 64  # of a step by `_by_rounds`
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
PLACES = len(NORMALS)
# Along which axis, and to which side.
_AXES = np.argmax(np.abs(NORMALS), axis=1)
_SIDES = np.sum(NORMALS, axis=1)
#: Where a row of `ImpactConditions.table` has what.
_LAW, _LOCK, _FRICTION, _R_GNG, _P_GNG, _F_GN = 0, 4, 16, 17, 26, 29
_M, _K, _D, _P_BOTO, _END = 32, 68, 74, 80, 83


class Workspace(NamedTuple):
    """What a step of one state is computed in; the next one overwrites it.

    Attributes:
        depth, pressed, arm: (k,), (k,), (k, 3) of the places: see `find_places`; normal
            forces that friction is of, where it is lagged [N]; arms from To in G.
        R_GnG, R_GB: (3, 3).
        T, T_inverse: (6, 6), twist = T v of the joints' rates v.
        A, slope, trial_slope: (6, 6), see `Known`, `balance`, `newton`.
        b, before, twist, W, r, step, there, trial_W, trial, last_W: (6,), see there.
        p_ToBo, p_GBo, one, other: (3,).
        by_twist: (3, 6), see `_push`.
    """

    depth: np.ndarray
    pressed: np.ndarray
    arm: np.ndarray
    R_GnG: np.ndarray
    R_GB: np.ndarray
    T: np.ndarray
    T_inverse: np.ndarray
    A: np.ndarray
    slope: np.ndarray
    trial_slope: np.ndarray
    b: np.ndarray
    before: np.ndarray
    twist: np.ndarray
    W: np.ndarray
    r: np.ndarray
    step: np.ndarray
    there: np.ndarray
    trial_W: np.ndarray
    trial: np.ndarray
    last_W: np.ndarray
    p_ToBo: np.ndarray
    p_GBo: np.ndarray
    one: np.ndarray
    other: np.ndarray
    by_twist: np.ndarray


#: Of the arrays that `arranged` takes.
SHAPES = ((2, PLACES), (PLACES, 3), (2, 3, 3), (5, 6, 6), (10, 6), (4, 3), (3, 6))


@compiled
def arranged(
    places: np.ndarray,
    arm: np.ndarray,
    rotations: np.ndarray,
    maps: np.ndarray,
    vectors: np.ndarray,
    points: np.ndarray,
    by_twist: np.ndarray,
) -> Workspace:
    """Returns a workspace in some arrays, of `SHAPES`."""
    m, v, p = maps, vectors, points
    return Workspace(
        *(places[0], places[1], arm, rotations[0], rotations[1]),
        *(m[0], m[1], m[2], m[3], m[4]),
        *(v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8], v[9]),
        *(p[0], p[1], p[2], p[3], by_twist),
    )


@compiled
def workspace() -> Workspace:
    """Returns a workspace on the host."""
    places, arm, rotations, maps, vectors, points, by_twist = SHAPES
    return arranged(
        np.empty(places),
        np.empty(arm),
        np.empty(rotations),
        np.empty(maps),
        np.empty(vectors),
        np.empty(points),
        np.empty(by_twist),
    )


class Known(NamedTuple):
    """What a step's balance depends on, but for the twist.

    Attributes:
        A, b: (6, 6), (6,) of the step without contact, A twist = b.
        h: the step [s].
        friction: Coulomb coefficient.
        law: (4,) of the normal force.
        space: its `depth` and `arm` are of the places before the step, from To in G.
        is_lagged: whether friction is of the forces `space.pressed`, not of those at
            the twist.
    """

    A: np.ndarray
    b: np.ndarray
    h: float
    friction: float
    law: np.ndarray
    space: Workspace
    is_lagged: bool


#: q, v, qd, vd (6,) of a state, and E, its inverse and R_GnB (3, 3), see `turning`; of
#: n states (n, ...).
State = tuple[np.ndarray, ...]


@compiled
def solve_rows(
    table: np.ndarray,
    h: float,
    states: State,
    after: np.ndarray,
    wrench: np.ndarray,
    is_solved: np.ndarray,
) -> None:
    """Finds what `ImpactStep` has, of one state after the other.

    Args:
        table: (m, 83) of `ImpactConditions`.
        h: the step [s].
        states: of n.
        after, wrench, is_solved: (n, 6), (n, 6), (n,) are set.
    """
    space = workspace()
    for i in range(len(after)):
        solve_row(table, h, states, i, after, wrench, is_solved, space)


@compiled
def solve_row(
    table: np.ndarray,
    h: float,
    states: State,
    i: int,
    after: np.ndarray,
    wrench: np.ndarray,
    is_solved: np.ndarray,
    space: Workspace,
) -> None:
    """Finds what `ImpactStep` has of one state; see `solve_rows`.

    Args:
        i: number of the state.
        space: to compute in.
    """
    q, v, qd, vd, E, E_inverse, R_GnB = states
    c = table[i] if len(table) > 1 else table[0]
    _set_places(c, q[i], R_GnB[i], space)
    _set_without_contact(c, h, q[i], v[i], qd[i], vd[i], E[i], space)
    _set_maps(E[i], E_inverse[i], space)
    _to_twists(space)
    known = Known(space.A, space.b, h, c[_FRICTION], c[_LAW:_LOCK], space, False)
    _apply(space.T, v[i], space.before)
    is_solved[i] = _solve(known)
    _apply(space.T_inverse, space.twist, after[i])
    _turn(space.R_GnG, space.W[:3], wrench[i, :3])
    _turn(space.R_GnG, space.W[3:], wrench[i, 3:])
    _add_cross(-1.0, space.p_ToBo, wrench[i, :3], wrench[i, 3:])


@compiled
def _set_places(
    c: np.ndarray, q: np.ndarray, R_GnB: np.ndarray, space: Workspace
) -> None:
    """Sets R_GnG, R_GB, p_ToBo in Gn, p_GBo in G, and the places, from To in G.

    Args:
        c: (83,) conditions.
        q: (6,).
        R_GnB: (3, 3).
        space: is set.
    """
    R_GnG, R_GB, p_ToBo = space.R_GnG, space.R_GB, space.p_ToBo
    for i in range(9):
        R_GnG[i // 3, i % 3] = c[_R_GNG + i]
    _turn(R_GnB, c[_P_BOTO:_END], p_ToBo)
    for i in range(3):
        p_ToBo[i] = -p_ToBo[i]
        space.one[i] = q[i] + c[_P_BOTO + i] + p_ToBo[i] - c[_P_GNG + i]
    _turn_back(R_GnG, space.one, space.p_GBo)
    for i in range(3):
        for j in range(3):
            R_GB[i, j] = 0.0
            for k in range(3):
                R_GB[i, j] += R_GnG[k, i] * R_GnB[k, j]
    find_places(R_GB, space.p_GBo, c[_LOCK:_FRICTION], space.depth, space.arm)
    _turn_back(R_GnG, p_ToBo, space.other)
    for k in range(PLACES):
        for i in range(3):
            space.arm[k, i] += space.other[i]


@compiled
def _set_without_contact(
    c: np.ndarray,
    h: float,
    q: np.ndarray,
    v: np.ndarray,
    qd: np.ndarray,
    vd: np.ndarray,
    E: np.ndarray,
    space: Workspace,
) -> None:
    """Sets A and b of the step without contact, still of joints: A v+ = b."""
    A, b, p_ToBo = space.A, space.b, space.p_ToBo
    for i in range(6):
        K, D = c[_K + i], c[_D + i]
        pull = K * (qd[i] - q[i]) + D * vd[i]
        if i < 3:
            pull += c[_F_GN + i]
        else:
            for j in range(3):
                one, other = (j + 1) % 3, (j + 2) % 3
                turn = p_ToBo[one] * c[_F_GN + other] - p_ToBo[other] * c[_F_GN + one]
                pull += E[j, i - 3] * turn
        b[i] = h * pull
        for j in range(6):
            A[i, j] = c[_M + 6 * i + j]
            b[i] += A[i, j] * v[j]
        A[i, i] += h * D + h * h * K


@compiled
def _set_maps(E: np.ndarray, E_inverse: np.ndarray, space: Workspace) -> None:
    """Sets T and its inverse."""
    R_GnG, T, T_inverse = space.R_GnG, space.T, space.T_inverse
    for i in range(3):
        for j in range(3):
            T[i, j], T_inverse[i, j] = R_GnG[j, i], R_GnG[i, j]
            T[i, 3 + j] = T[3 + i, j] = T_inverse[i, 3 + j] = T_inverse[3 + i, j] = 0.0
            T[3 + i, 3 + j] = T_inverse[3 + i, 3 + j] = 0.0
            for k in range(3):
                T[3 + i, 3 + j] += R_GnG[k, i] * E[k, j]
                T_inverse[3 + i, 3 + j] += E_inverse[i, k] * R_GnG[k, j]


@compiled
def _to_twists(space: Workspace) -> None:
    """Makes A, b of joints those of twists, T^-T A T^-1 and T^-T b."""
    A, b, T_inverse = space.A, space.b, space.T_inverse
    product, sums = space.slope, space.r
    for i in range(6):
        sums[i] = 0.0
        for j in range(6):
            sums[i] += T_inverse[j, i] * b[j]
            product[i, j] = 0.0
            for k in range(6):
                product[i, j] += A[i, k] * T_inverse[k, j]
    for i in range(6):
        b[i] = sums[i]
        for j in range(6):
            A[i, j] = 0.0
            for k in range(6):
                A[i, j] += T_inverse[k, i] * product[k, j]


@compiled
def _solve(known: Known) -> bool:
    """Sets twist and wrench W of the balance in `known.space`; is there one?"""
    space = known.space
    before, twist, wrench = space.before, space.twist, space.W
    slope, r = space.slope, space.r
    _copy(known.A, slope)
    _copy_vector(known.b, twist)
    solve_in_place(slope, twist)
    balance(known, twist, wrench, r, slope)
    alone = squared(r)
    if not math.isfinite(alone) or squared(wrench) == 0.0:
        return math.isfinite(alone)
    # A bolt that leans on a wall mostly goes on doing so.
    balance(known, before, wrench, r, slope)
    if squared(r) < alone and newton(known, before, wrench) == _SOLVED:
        _copy_vector(before, twist)
        return True
    ended = newton(known, twist, wrench)
    if ended == _SOLVED:
        return True
    return _by_rounds(known) or ended == _STUCK


@compiled
def _by_rounds(known: Known) -> bool:
    """Sets twist and wrench W where Newton's method finds no balance; is there one?

    It stops short where friction is large: the normal forces then depend on the
    friction that depends on them. Friction of given normal forces leaves a convex
    problem with one solution, where the normal force falls with the way out. It has
    new normal forces, which in the mean with the given ones are those of the next
    round. Friction of given forces can only brake, so they are bounded, and some of
    them are their own (Brouwer's fixed point theorem): a balance. Without one after
    the last round, friction is of the forces of the round before.

    Without a solution for given forces, twist and wrench are left as they are.
    """
    space = known.space
    twist, wrench, last, last_W = space.twist, space.W, space.before, space.last_W
    lagged = Known(known.A, known.b, known.h, known.friction, known.law, space, True)
    _copy_vector(twist, last)
    _copy_vector(wrench, last_W)
    is_solved = False
    for k in range(PLACES):
        space.pressed[k] = 0.0
    for n in range(_ROUNDS):
        if newton(lagged, twist, wrench) != _SOLVED:
            break
        _copy_vector(twist, last)
        _copy_vector(wrench, last_W)
        is_tried = n & (n + 1) == 0  # as often again as before: most tries are in vain
        if is_tried and newton(known, twist, wrench) == _SOLVED:
            return True
        for k in range(PLACES):
            rate = _rate_at(k, space.arm[k], last, space.one)
            F, _, _ = normal_force(space.depth[k] + known.h * rate, rate, known.law)
            space.pressed[k] = 0.5 * (space.pressed[k] + F) if is_solved else F
        _copy_vector(last, twist)
        is_solved = True
    _copy_vector(last, twist)
    _copy_vector(last_W, wrench)
    return is_solved


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
    A, h, space = known.A, known.h, known.space
    velocity, force = space.one, space.other
    for i in range(6):
        wrench[i] = 0.0
        for j in range(6):
            slope[i, j] = 0.0
    for k in range(PLACES):
        rate = _rate_at(k, space.arm[k], twist, velocity)
        after = space.depth[k] + h * rate
        if after <= 0.0 and not (known.is_lagged and space.pressed[k] > 0.0):
            continue
        F, by_depth, by_rate = normal_force(after, rate, known.law)
        dF, mu = h * by_depth + by_rate, known.friction
        limit, limit_by_rate = mu * F, mu * dF
        if known.is_lagged:
            limit, limit_by_rate = mu * space.pressed[k], 0.0
        _push(_AXES[k], _SIDES[k], F, dF, force, space.by_twist)
        _rub(_AXES[k], _SIDES[k], velocity, limit, limit_by_rate, force, space.by_twist)
        _add_wrench(space.arm[k], force, space.by_twist, wrench, slope)
    for i in range(6):
        r[i] = -known.b[i] - h * wrench[i]
        for j in range(6):
            r[i] += A[i, j] * twist[j]
            slope[i, j] = A[i, j] - h * slope[i, j]


@compiled
def _rate_at(k: int, arm: np.ndarray, twist: np.ndarray, velocity: np.ndarray) -> float:
    """Returns at what rate a place goes into the groove [m/s].

    Args:
        k: number of the place.
        arm: (3,) from To to it.
        twist: (6,) of the bolt.
        velocity: (3,) is set, the bolt's there.
    """
    for i in range(3):
        velocity[i] = twist[i]
    _add_cross(1.0, twist[3:], arm, velocity)
    return float(-_SIDES[k] * velocity[_AXES[k]])


@compiled
def _push(
    axis: int, side: float, F: float, dF: float, force: np.ndarray, slope: np.ndarray
) -> None:
    """Finds the normal force at a place, and its slope by the place's velocity.

    Args:
        axis, side: of the normal.
        F: normal force [N].
        dF: by which it falls with the velocity along the normal [N s/m].
        force: (3,) of which [axis] is set.
        slope: (3, 6), of which [axis, :3] is set.
    """
    force[axis] = side * F
    for j in range(3):
        slope[axis, j] = 0.0
    slope[axis, axis] = -dF


@compiled
def _rub(
    axis: int,
    side: float,
    velocity: np.ndarray,
    limit: float,
    by_rate: float,
    force: np.ndarray,
    slope: np.ndarray,
) -> None:
    """Finds the friction at a place, and its slope by the place's velocity.

    Coulomb's, regularised: limit s / sqrt(s^2 + stiction^2) against the slip s.

    Args:
        axis, side: of the normal.
        velocity: (3,) of the bolt there.
        limit: coefficient of friction times normal force [N].
        by_rate: by which that falls with the velocity along the normal [N s/m].
        force: (3,) of which all but [axis] is set.
        slope: (3, 6), of which all but [axis] of [:, :3] is set.
    """
    one, other = (axis + 1) % 3, (axis + 2) % 3
    speed = math.sqrt(velocity[one] ** 2 + velocity[other] ** 2 + _STICTION**2)
    drag = limit / speed
    for i, j in ((one, other), (other, one)):
        along = velocity[i] / speed
        force[i] = -drag * velocity[i]
        slope[i, axis] = side * by_rate * along
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
    _add_cross(1.0, arm, force, wrench[3:])
    for i in range(3):
        wrench[i] += force[i]
        for j in range(3):
            by_twist[i, 3 + j] = 0.0
        _add_cross(1.0, arm, by_twist[i, :3], by_twist[i, 3:])
    for j in range(6):
        for i in range(3):
            slope[i, j] += by_twist[i, j]
        _add_cross(1.0, arm, by_twist[:, j], slope[3:, j])


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
    space = known.space
    slope, trial_slope, r, trial = space.slope, space.trial_slope, space.r, space.trial
    step, there, W = space.step, space.there, space.trial_W
    balance(known, twist, wrench, r, slope)
    for _ in range(_ITERATIONS):
        error, largest = squared(r), 0.0
        for i in range(6):
            step[i] = -r[i]
        solve_in_place(slope, step)
        for i in range(6):
            largest = max(largest, abs(step[i]))
        if largest < _TOLERANCE:
            return _SOLVED
        for _ in range(1 + _SHORTEST):
            for i in range(6):
                there[i] = twist[i] + step[i]
            balance(known, there, W, trial, trial_slope)
            if squared(trial) < error:
                break
            for i in range(6):
                step[i] *= 0.5
        else:
            return _STUCK
        _copy_vector(there, twist)
        _copy_vector(W, wrench)
        _copy_vector(trial, r)
        _copy(trial_slope, slope)
    return _UNFINISHED


@compiled
def squared(vector: np.ndarray) -> float:
    """Returns the squared length of a vector (n,)."""
    total = 0.0
    for i in range(len(vector)):
        total += vector[i] * vector[i]
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
        pivot = k
        for i in range(k + 1, n):
            if abs(A[i, k]) > abs(A[pivot, k]):
                pivot = i
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
def _add_cross(sign: float, a: np.ndarray, b: np.ndarray, out: np.ndarray) -> None:
    """Adds the cross product of vectors (3,), times a sign."""
    out[0] += sign * (a[1] * b[2] - a[2] * b[1])
    out[1] += sign * (a[2] * b[0] - a[0] * b[2])
    out[2] += sign * (a[0] * b[1] - a[1] * b[0])


@compiled
def _turn(R: np.ndarray, x: np.ndarray, out: np.ndarray) -> None:
    """Sets R x, of vectors (3,)."""
    for i in range(3):
        out[i] = R[i, 0] * x[0] + R[i, 1] * x[1] + R[i, 2] * x[2]


@compiled
def _turn_back(R: np.ndarray, x: np.ndarray, out: np.ndarray) -> None:
    """Sets R^T x, of vectors (3,)."""
    for i in range(3):
        out[i] = R[0, i] * x[0] + R[1, i] * x[1] + R[2, i] * x[2]


@compiled
def _apply(A: np.ndarray, x: np.ndarray, out: np.ndarray) -> None:
    """Sets A x, of (6, 6) and (6,)."""
    for i in range(6):
        out[i] = 0.0
        for j in range(6):
            out[i] += A[i, j] * x[j]


@compiled
def _copy(matrix: np.ndarray, to: np.ndarray) -> None:
    """Copies (6, 6)."""
    for i in range(6):
        for j in range(6):
            to[i, j] = matrix[i, j]


@compiled
def _copy_vector(vector: np.ndarray, to: np.ndarray) -> None:
    """Copies (6,)."""
    for i in range(6):
        to[i] = vector[i]


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
    up, middle = R_GB[:, 1], (top + bottom) / 2.0
    for first, height in ((0, lip), (2, -lip)):
        _circle_between(height, up, p_GBo, 2, neck, slot, first, depth, arm)
        if p_GBo[0] + height * up[0] >= lips_end:
            depth[first] = depth[first + 1] = -1.0
    _circle_between(middle, up, p_GBo, 2, head, wall, 4, depth, arm)
    _circle_between(middle, up, p_GBo, 0, head, end, 6, depth, arm)
    depth[7] = start - (p_GBo[0] + middle * up[0] - head)
    for i in range(_RIM_POINTS):
        above, below = 8 + i, 8 + _RIM_POINTS + i
        for axis in range(3):
            rim = head * (R_GB[axis, 0] * _RIM[i, 0] + R_GB[axis, 2] * _RIM[i, 2])
            arm[above, axis] = rim + top * up[axis]
            arm[below, axis] = rim + bottom * up[axis]
        y = p_GBo[1] + arm[above, 1]
        x, z = p_GBo[0] + arm[above, 0], p_GBo[2] + arm[above, 2]
        is_covered = x < lips_end and abs(z) > slot
        is_inside = y < under_lip + head  # not yet lifted out
        depth[above] = y - under_lip if is_covered and is_inside else -1.0
        depth[below] = floor - (p_GBo[1] + arm[below, 1])


@compiled
def _circle_between(
    height: float,
    up: np.ndarray,
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
        height, up: of the circle's centre from Bo; a unit vector (3,) in G.
        p_GBo: (3,) [m].
        along: number of the axis across the walls, at -wall and wall.
        radius, wall: [m].
        first: number of the first of the two places.
        depth, arm: see `find_places`.
    """
    place = p_GBo[along] + height * up[along]
    for i, side in ((first, 1.0), (first + 1, -1.0)):
        depth[i] = radius - wall + side * place
        for axis in range(3):
            arm[i, axis] = height * up[axis]
        arm[i, along] += side * radius

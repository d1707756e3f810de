"""The twin's equations for one row after the other, compiled.

A row is one twin: its constants, and the state of its plant. All that is known of it,
and all that is computed, stands side by side in one array, the workspace `w`, at the
places that the capital letters below name; a function that is given a place reads or
sets what begins there. So the same functions compile for a GPU (`on_gpu`), whose
threads can't allocate arrays, and none copies an array or a part of one.

Wrenches are [f; tau]. Of the contact: twists are [velocity of To; angular velocity] in
G, and wrenches at To in G, (6,) each.
"""

import itertools
import math

import numpy as np

from drake_disasm.common.compiled import compiled

_MM = 1000.0
_LEAST = 1e-12  # mm: a power of zero has no slope
_DEEP = 1e-6  # m: what touches by less is looked at as if it were as deep
_STICTION = 1e-4  # m/s: creep at which friction is three quarters
_ITERATIONS = 60
_SHORTEST = 11  # times that a step is halved before it is given up
_TOLERANCE = 1e-8  # m/s, of the velocities after the step
_ROUNDS = 64  # of a step by `_by_rounds`
#: How Newton's method ends: solved; where no step leads to less error; not done.
_SOLVED, _STUCK, _UNFINISHED = 0, 1, 2

_RIM_POINTS = 8
_ANGLES = 2.0 * np.pi * np.arange(_RIM_POINTS) / _RIM_POINTS
_RIM = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])

#: Kinds of `parts.gaps`, and how many numbers a row of them has.
SLOT, HOLE, BAYONET, GAPS_SIZE = 0.0, 1.0, 2.0, 16
#: How many places of a part can touch, at most.
PLACES = 24
_STOPS, _PLANES = 6, 8  # a slot's first places at the stops, and at lips and floor


def _slot_normals() -> np.ndarray:
    """Returns the normals (24, 3) of a slot's places: along the groove's axes."""
    across = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    stops = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    up = np.array([[0.0, 1.0, 0.0]])
    planes = np.repeat(np.concatenate([-up, up]), _RIM_POINTS, axis=0)
    return np.concatenate([across, across, across, stops, planes])


_SLOT_NORMALS = _slot_normals()


def _begins(*sizes: int) -> tuple[int, ...]:
    """Returns where quantities begin that stand side by side, and where they end."""
    return tuple(itertools.accumulate(sizes, initial=0))


#: A row of `ImpactConditions.table`: the law, the gaps, the surroundings ...
(LAW, GAPS, FRICTION, _R_GNG, _P_GNG, _F_GN, _M0, _K, _D, _P_BOTO, _BODY) = _begins(
    *(4, GAPS_SIZE, 1, 9, 3, 3, 36, 6, 6, 3)
)
#: ... one of `Body.table`: mass, p_ToBcm_B, inertia about To in B, weight in Gn ...
(_MASS, _P_TOBCM, _I_TO, _WEIGHT, _STATE) = (
    _BODY + place for place in _begins(1, 3, 9, 3)
)
#: ... the state: of the arm, of the bolt (q, v), of the command (qd and its rate) ...
(_X, _Q, _V, _QD, _RATE, _NEWEST) = (
    _STATE + place for place in _begins(12, 6, 6, 6, 6)
)
#: ... what the newest step was: before it, q'', wrench of the surroundings on the bolt
#: at Bo in Gn; and what the arm would do without springs ...
(_X_BEFORE, _Q_BEFORE, _VDOT, _WRENCH, _AHEAD, _MATRICES) = (
    _NEWEST + place for place in _begins(12, 6, 6, 6, 12)
)
#: ... w = E turns', rotations, the inertia about To in Gn; twist = T v;
#: A and b of the step without contact; the slopes of what is out of balance; M ...
(_E, _E_BACK, _R_GNB, R_GB, _I, _T, _T_BACK, A, SLOPE, _TRIAL_SLOPE, _M, _SIX) = (
    _MATRICES + place for place in _begins(*[9] * 5, *[36] * 6)
)
#: ... (6,) of Newton's method; the terms that act on the joints besides M ...
(B, _BEFORE, TWIST, W, REST, _STEP, _THERE, _TRIAL_W, _TRIAL, _LAST_W) = (
    _SIX + place for place in range(0, 60, 6)
)
_ACTING, _THREE = _SIX + 60, _SIX + 66
#: ... (3,): p_ToBo in Gn, p_GBo, the torque of a part's spring in G and in Gn, what is
#: passed on within a function, a force, its slip, its slope (3, 6) by the twist ...
(_P_TOBO, P_GBO, SPRING, _SPRING_GN, _ONE, _OTHER, _OMEGA, _C, _TURNED, _FORCE) = (
    _THREE + place for place in range(0, 30, 3)
)
(_SLIP, _BY_TWIST, _PLACES) = (_THREE + 30 + place for place in (0, 3, 21))
#: ... of the places (k,): how deep they are, how fast they go in, which normal force
#: lagged friction is of, their law's stiffness and exponent; (k, 3) arms from To,
#: normals out of the fixed body, and arm x normal, in G.
(DEPTH, _INWARD, PRESSED, STIFFNESS, EXPONENT, ARM, NORMAL, MOMENT, SIZE) = (
    _PLACES + PLACES * place for place in (0, 1, 2, 3, 4, 5, 8, 11, 14)
)


@compiled
def advance_rows(
    constants: tuple[np.ndarray, ...],
    h: float,
    steps: int,
    rate: np.ndarray,
    state: np.ndarray,
    newest: np.ndarray,
    is_solved: np.ndarray,
    first: int,
    end: int,
) -> None:
    """Advances some plants by some steps, one plant after the other.

    Args:
        constants: of m twins, 1 for all or n: `ImpactConditions.table` (m, 87),
            `Body.table` (m, 16), F, C, P of `ArmStep` (m, 3, 12, 12).
        h: the step [s].
        steps: how many.
        rate: (n, 6) of the commanded coordinates.
        state: (n, 30) of all plants: arm, q, v, qd; is changed.
        newest: (n, 30) is set to what the newest step was: arm and q before it, q'',
            wrench of the surroundings on the bolt at Bo in Gn.
        is_solved: (n,) is set: whether contact found a balance in all steps.
        first, end: numbers of the plants.
    """
    w = np.empty(SIZE)
    for i in range(first, end):
        is_solved[i] = advance_row(constants, h, steps, rate, state, newest, i, w)


@compiled
def advance_row(
    constants: tuple[np.ndarray, ...],
    h: float,
    steps: int,
    rate: np.ndarray,
    state: np.ndarray,
    newest: np.ndarray,
    i: int,
    w: np.ndarray,
) -> bool:
    """Advances one plant, by its number i; see `advance_rows`."""
    conditions, bodies, arms = constants
    _load(conditions, bodies, i, w)
    for j in range(_RATE - _STATE):
        w[_STATE + j] = state[i, j]
    for j in range(6):
        w[_RATE + j] = rate[i, j]
    arm = i if len(arms) > 1 else 0
    is_solved = True
    for _ in range(steps):
        if not _plant_step(h, arms, arm, w):
            is_solved = False
    for j in range(_RATE - _STATE):
        state[i, j] = w[_STATE + j]
    for j in range(_AHEAD - _NEWEST):
        newest[i, j] = w[_NEWEST + j]
    return is_solved


@compiled
def _load(conditions: np.ndarray, bodies: np.ndarray, i: int, w: np.ndarray) -> None:
    """Takes over the constants of a plant, by its number."""
    row = i if len(conditions) > 1 else 0
    for j in range(_BODY):
        w[j] = conditions[row, j]
    row = i if len(bodies) > 1 else 0
    for j in range(_STATE - _BODY):
        w[_BODY + j] = bodies[row, j]


@compiled
def _plant_step(h: float, arms: np.ndarray, arm: int, w: np.ndarray) -> bool:
    """Advances the plant by a step; returns whether contact found a balance.

    Contact foresees the step with the inertia at the joints' zero; the plant has all.

    Args:
        h: the step [s].
        arms: (m, 3, 12, 12).
        arm: which of them.
        w: workspace.
    """
    for j in range(6):
        w[_QD + j] += h * w[_RATE + j]
        w[_Q_BEFORE + j] = w[_Q + j]
    _set_ahead(arms, arm, w)
    _set_turning(w)
    is_solved = _set_contact(h, w)
    for j in range(3):
        w[_WRENCH + j] += w[_F_GN + j]
        w[_WRENCH + 3 + j] += w[_SPRING_GN + j]
    _set_dynamics(w)
    _set_joint_forces(w)
    for j in range(6):
        K, D = w[_K + j], w[_D + j]
        pull = K * (w[_AHEAD + j] - w[_Q + j]) + D * w[_AHEAD + 6 + j]
        b = h * (pull + w[_ACTING + j] + w[REST + j])
        for k in range(6):
            b += w[_M + 6 * j + k] * w[_V + k]
            w[A + 6 * j + k] = w[_M + 6 * j + k]
        w[A + 7 * j] += h * D + h * h * K
        w[B + j] = b
    solve_in_place(A, B, w)
    for j in range(6):
        w[_VDOT + j] = (w[B + j] - w[_V + j]) / h
        w[_V + j] = w[B + j]
        w[_Q + j] += h * w[B + j]
    _set_arm(arms, arm, w)
    return is_solved


@compiled
def _set_ahead(arms: np.ndarray, arm: int, w: np.ndarray) -> None:
    """Sets x' = F x + C u, where the arm would go without springs; notes x."""
    for j in range(12):
        w[_X_BEFORE + j] = w[_X + j]
    for j in range(12):
        by_state, by_command = 0.0, 0.0
        for k in range(12):
            by_state += arms[arm, 0, j, k] * w[_X + k]
            by_command += arms[arm, 1, j, k] * w[_QD + k]  # qd and its rate
        w[_AHEAD + j] = by_state + by_command


@compiled
def _set_arm(arms: np.ndarray, arm: int, w: np.ndarray) -> None:
    """Sets x+ = x' + P (s+ - x') once the bolt is at s+ = [q, v]."""
    for j in range(12):
        moved = 0.0
        for k in range(12):
            moved += arms[arm, 2, j, k] * (w[_Q + k] - w[_AHEAD + k])
        w[_X + j] = w[_AHEAD + j] + moved


@compiled
def _set_turning(w: np.ndarray) -> None:
    """Sets R_GnB of the turns about z, x and y, E of their rates, and its inverse."""
    sz, cz = math.sin(w[_Q + 3]), math.cos(w[_Q + 3])
    sx, cx = math.sin(w[_Q + 4]), math.cos(w[_Q + 4])
    sy, cy = math.sin(w[_Q + 5]), math.cos(w[_Q + 5])
    xy, yy, zy = -sz * cx, cz * cx, sx
    w[_R_GNB], w[_R_GNB + 2] = cz * cy - sz * sx * sy, cz * sy + sz * sx * cy
    w[_R_GNB + 3], w[_R_GNB + 5] = sz * cy + cz * sx * sy, sz * sy - cz * sx * cy
    w[_R_GNB + 6], w[_R_GNB + 8] = -cx * sy, cx * cy
    w[_R_GNB + 1], w[_R_GNB + 4], w[_R_GNB + 7] = xy, yy, zy
    w[_E], w[_E + 1], w[_E + 2] = 0.0, cz, xy
    w[_E + 3], w[_E + 4], w[_E + 5] = 0.0, sz, yy
    w[_E + 6], w[_E + 7], w[_E + 8] = 1.0, 0.0, zy
    w[_E_BACK], w[_E_BACK + 1], w[_E_BACK + 2] = sx * sz / cx, -sx * cz / cx, 1.0
    w[_E_BACK + 3], w[_E_BACK + 4], w[_E_BACK + 5] = cz, sz, 0.0
    w[_E_BACK + 6], w[_E_BACK + 7], w[_E_BACK + 8] = -sz / cx, cz / cx, 0.0


@compiled
def _cross(a: int, b: int, j: int, w: np.ndarray) -> float:
    """Returns element j of the cross product of vectors at two places."""
    one, other = (j + 1) % 3, (j + 2) % 3
    return float(w[a + one] * w[b + other] - w[a + other] * w[b + one])


@compiled
def _times(matrix: int, vector: int, j: int, w: np.ndarray) -> float:
    """Returns element j of a matrix (3, 3) times a vector (3,)."""
    row = matrix + 3 * j
    total = w[row] * w[vector] + w[row + 1] * w[vector + 1]
    return float(total + w[row + 2] * w[vector + 2])


@compiled
def _back(matrix: int, vector: int, j: int, w: np.ndarray) -> float:
    """Returns element j of a transposed matrix (3, 3) times a vector (3,)."""
    row = matrix + j
    total = w[row] * w[vector] + w[row + 3] * w[vector + 1]
    return float(total + w[row + 6] * w[vector + 2])


@compiled
def _set_dynamics(w: np.ndarray) -> None:
    """Sets the mass matrix M of the joints, and what else acts on them.

    `_ACTING` is the change of the weight with the angles, since the grip carries it as
    it is at their zero, less the terms with products of velocities (Newton's and
    Euler's laws at To, with the derivative of E).
    """
    for j in range(3):
        w[_C + j] = _times(_R_GNB, _P_TOBCM, j, w)
        w[_OMEGA + j] = _times(_E, _V + 3, j, w)
    _set_inertia(w)
    _set_mass_matrix(w)
    _set_derivative_term(w)
    for j in range(3):
        w[_OTHER + j] = _cross(_OMEGA, _C, j, w)
        w[_ONE + j] = _times(_I, _OMEGA, j, w)
    for j in range(3):
        a = _cross(_OMEGA, _OTHER, j, w) + _cross(_TURNED, _C, j, w)
        w[_ACTING + j] = -w[_MASS] * a
    for j in range(3):
        weight = _cross(_C, _WEIGHT, j, w)
        spun = _cross(_OMEGA, _ONE, j, w) + _times(_I, _TURNED, j, w)
        w[_OTHER + j] = weight - spun
    for j in range(3):
        # At the turns' zero E has the axes z, x, y.
        carried = _cross(_P_TOBCM, _WEIGHT, (j + 2) % 3, w)
        w[_ACTING + 3 + j] = _back(_E, _OTHER, j, w) - carried


@compiled
def _set_inertia(w: np.ndarray) -> None:
    """Sets the rotational inertia about To in Gn, R I R^T."""
    for k in range(3):
        for a in range(3):
            w[_ONE + a] = _times(_I_TO, _R_GNB + 3 * k, a, w)
        for j in range(3):
            w[_I + 3 * j + k] = _times(_R_GNB, _ONE, j, w)


@compiled
def _set_mass_matrix(w: np.ndarray) -> None:
    """Sets the joints' mass matrix, T^T S T with the spatial inertia S at To."""
    mass = w[_MASS]
    for k in range(3):
        for a in range(3):
            w[_ONE + a] = w[_E + 3 * a + k]
        for a in range(3):
            w[_OTHER + a] = _times(_I, _ONE, a, w)
        for j in range(3):
            turn = -mass * _cross(_C, _ONE, j, w)
            w[_M + 6 * j + k] = mass if j == k else 0.0
            w[_M + 6 * j + 3 + k] = w[_M + 6 * (3 + k) + j] = turn
            w[_M + 6 * (3 + j) + 3 + k] = _back(_E, _OTHER, j, w)


@compiled
def _set_derivative_term(w: np.ndarray) -> None:
    """Sets `_TURNED`, E' times the turns' rates."""
    about_z, about_x, about_y = w[_V + 3], w[_V + 4], w[_V + 5]
    cosine, sine = w[_E + 1], w[_E + 4]
    w[_ONE], w[_ONE + 1], w[_ONE + 2] = about_x * cosine, about_x * sine, about_z
    for j in range(3):
        w[_OTHER + j] = w[_E + 3 * j + 2]
    for j in range(3):
        w[_TURNED + j] = about_y * _cross(_ONE, _OTHER, j, w)
    w[_TURNED] -= about_z * about_x * sine
    w[_TURNED + 1] += about_z * about_x * cosine


@compiled
def _set_joint_forces(w: np.ndarray) -> None:
    """Sets the joints' forces `REST` of the wrench on the bolt at Bo in Gn."""
    for j in range(3):
        w[REST + j] = w[_WRENCH + j]
        w[_OTHER + j] = w[_WRENCH + 3 + j] + _cross(_P_TOBO, _WRENCH, j, w)
    for j in range(3):
        w[REST + 3 + j] = _back(_E, _OTHER, j, w)


@compiled
def solve_rows(
    conditions: np.ndarray,
    bodies: np.ndarray,
    h: float,
    states: tuple[np.ndarray, ...],
    after: np.ndarray,
    wrench: np.ndarray,
    is_solved: np.ndarray,
) -> None:
    """Finds what `ImpactStep` has, of one state after the other.

    Args:
        conditions: (m, 87) of `ImpactConditions`.
        bodies: (1, 16), which contact does not look at.
        h: the step [s].
        states: q, v, qd, vd (n, 6).
        after, wrench, is_solved: (n, 6), (n, 6), (n,) are set.
    """
    w = np.empty(SIZE)
    q, v, qd, vd = states
    for i in range(len(after)):
        _load(conditions, bodies, i, w)
        for j in range(6):
            w[_Q + j], w[_V + j] = q[i, j], v[i, j]
            w[_AHEAD + j], w[_AHEAD + 6 + j] = qd[i, j], vd[i, j]
        _set_turning(w)
        is_solved[i] = _set_contact(h, w)
        for j in range(6):
            after[i, j] = 0.0
            for k in range(6):
                after[i, j] += w[_T_BACK + 6 * j + k] * w[TWIST + k]
            wrench[i, j] = w[_WRENCH + j]


@compiled
def _set_contact(h: float, w: np.ndarray) -> bool:
    """Sets twist, W and wrench of the contact in a step; is there a balance?"""
    _set_places(w)
    _set_without_contact(h, w)
    _set_maps(w)
    _to_twists(w)
    for j in range(6):
        w[_BEFORE + j] = 0.0
        for k in range(6):
            w[_BEFORE + j] += w[_T + 6 * j + k] * w[_V + k]
    is_solved = _solve(h, w)
    for j in range(3):
        w[_WRENCH + j] = _times(_R_GNG, W, j, w)
        w[_WRENCH + 3 + j] = _times(_R_GNG, W + 3, j, w)
    for j in range(3):
        w[_WRENCH + 3 + j] -= _cross(_P_TOBO, _WRENCH, j, w)
    return is_solved


@compiled
def _set_places(w: np.ndarray) -> None:
    """Sets R_GB, p_ToBo in Gn, p_GBo in G, and the places, from To in G."""
    for j in range(3):
        w[_P_TOBO + j] = -_times(_R_GNB, _P_BOTO, j, w)
        p_GnTo = w[_Q + j] + w[_P_BOTO + j]
        w[_ONE + j] = p_GnTo + w[_P_TOBO + j] - w[_P_GNG + j]
    for j in range(3):
        w[P_GBO + j] = _back(_R_GNG, _ONE, j, w)
        w[_OTHER + j] = _back(_R_GNG, _P_TOBO, j, w)
        for k in range(3):
            total = 0.0
            for a in range(3):
                total += w[_R_GNG + 3 * a + j] * w[_R_GNB + 3 * a + k]
            w[R_GB + 3 * j + k] = total
    find_places(w)
    for j in range(3):
        w[_SPRING_GN + j] = _times(_R_GNG, SPRING, j, w)
    x, y, z = w[_OTHER], w[_OTHER + 1], w[_OTHER + 2]
    for k in range(PLACES):
        w[ARM + 3 * k] += x
        w[ARM + 3 * k + 1] += y
        w[ARM + 3 * k + 2] += z
    set_moments(w)


@compiled
def set_moments(w: np.ndarray) -> None:
    """Sets the moments of unit forces along the places' normals, about To."""
    for k in range(PLACES):
        for axis in range(3):
            w[MOMENT + 3 * k + axis] = _cross(ARM + 3 * k, NORMAL + 3 * k, axis, w)


@compiled
def _set_without_contact(h: float, w: np.ndarray) -> None:
    """Sets A and b of the step without contact, still of joints: A v+ = b."""
    for j in range(3):
        w[_OTHER + j] = _cross(_P_TOBO, _F_GN, j, w) + w[_SPRING_GN + j]
    for j in range(6):
        K, D = w[_K + j], w[_D + j]
        pull = K * (w[_AHEAD + j] - w[_Q + j]) + D * w[_AHEAD + 6 + j]
        pull += w[_F_GN + j] if j < 3 else _back(_E, _OTHER, j - 3, w)
        b = h * pull
        for k in range(6):
            w[A + 6 * j + k] = w[_M0 + 6 * j + k]
            b += w[_M0 + 6 * j + k] * w[_V + k]
        w[A + 7 * j] += h * D + h * h * K
        w[B + j] = b


@compiled
def _set_maps(w: np.ndarray) -> None:
    """Sets T and its inverse."""
    for j in range(36):
        w[_T + j] = w[_T_BACK + j] = 0.0
    for i in range(3):
        for j in range(3):
            w[_T + 6 * i + j] = w[_R_GNG + 3 * j + i]
            w[_T_BACK + 6 * i + j] = w[_R_GNG + 3 * i + j]
            there, back = 0.0, 0.0
            for k in range(3):
                there += w[_R_GNG + 3 * k + i] * w[_E + 3 * k + j]
                back += w[_E_BACK + 3 * i + k] * w[_R_GNG + 3 * k + j]
            w[_T + 6 * (3 + i) + 3 + j] = there
            w[_T_BACK + 6 * (3 + i) + 3 + j] = back


@compiled
def _to_twists(w: np.ndarray) -> None:
    """Makes A, b of joints those of twists, T^-T A T^-1 and T^-T b."""
    product, sums = SLOPE, REST
    for i in range(6):
        total = 0.0
        for j in range(6):
            total += w[_T_BACK + 6 * j + i] * w[B + j]
        w[sums + i] = total
        for j in range(6):
            total = 0.0
            for k in range(6):
                total += w[A + 6 * i + k] * w[_T_BACK + 6 * k + j]
            w[product + 6 * i + j] = total
    for i in range(6):
        w[B + i] = w[sums + i]
        for j in range(6):
            total = 0.0
            for k in range(6):
                total += w[_T_BACK + 6 * k + i] * w[product + 6 * k + j]
            w[A + 6 * i + j] = total


@compiled
def _solve(h: float, w: np.ndarray) -> bool:
    """Sets twist and wrench W of the balance; is there one?"""
    _copy(A, SLOPE, 36, w)
    _copy(B, TWIST, 6, w)
    solve_in_place(SLOPE, TWIST, w)
    alone = _error(h, TWIST, w)
    if not math.isfinite(alone) or squared(W, w) == 0.0:
        return math.isfinite(alone)
    # A bolt that leans on a wall mostly goes on doing so.
    leans = _error(h, _BEFORE, w) < alone and squared(W, w) > 0.0
    ended = _UNFINISHED
    for start in range(0 if leans else 1, 2):
        twist = _BEFORE if start == 0 else TWIST
        ended = newton(h, False, twist, w)
        if ended == _SOLVED:
            _copy(twist, TWIST, 6, w)
            return True
    return _by_rounds(h, w) or ended == _STUCK


@compiled
def _error(h: float, twist: int, w: np.ndarray) -> float:
    """Returns how much is out of balance at a twist, squared; sets W."""
    balance(h, False, twist, W, REST, SLOPE, w)
    return squared(REST, w)


@compiled
def _by_rounds(h: float, w: np.ndarray) -> bool:
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
    last = _BEFORE
    _copy(TWIST, last, 6, w)
    _copy(W, _LAST_W, 6, w)
    is_solved = False
    for k in range(PLACES):
        w[PRESSED + k] = 0.0
    for n in range(_ROUNDS):
        if newton(h, True, TWIST, w) != _SOLVED:
            break
        _copy(TWIST, last, 6, w)
        _copy(W, _LAST_W, 6, w)
        is_tried = n & (n + 1) == 0  # as often again as before: most tries are in vain
        if is_tried and newton(h, False, TWIST, w) == _SOLVED:
            return True
        _copy(last, TWIST, 6, w)
        _set_inward(last, w)
        for k in range(PLACES):
            rate = w[_INWARD + k]
            F, _, _ = normal_force(w[DEPTH + k] + h * rate, rate, _law(k, w))
            w[PRESSED + k] = 0.5 * (w[PRESSED + k] + F) if is_solved else F
        is_solved = True
    _copy(last, TWIST, 6, w)
    _copy(_LAST_W, W, 6, w)
    return is_solved


@compiled
def balance(
    h: float,
    is_lagged: bool,
    twist: int,
    wrench: int,
    rest: int,
    slope: int,
    w: np.ndarray,
) -> None:
    """Finds what is out of balance at a twist after the step: A twist - b - h W.

    Args:
        h: the step [s].
        is_lagged: whether friction is of the forces at `PRESSED`, not of those at the
            twist.
        twist: place of (6,).
        wrench: of (6,) that is set, the contact's on the bolt, W.
        rest: of (6,) that is set.
        slope: of (6, 6) that is set, the rest's by the twist.
        w: workspace, with A, b, and the places before the step.
    """
    for i in range(6):
        w[wrench + i] = 0.0
    for i in range(36):
        w[slope + i] = 0.0
    _add_contacts(h, is_lagged, twist, wrench, slope, w)
    for i in range(6):
        total = -w[B + i] - h * w[wrench + i]
        for j in range(6):
            total += w[A + 6 * i + j] * w[twist + j]
            at = slope + 6 * i + j
            w[at] = w[A + 6 * i + j] - h * w[at]
        w[rest + i] = total


@compiled
def _add_contacts(
    h: float, is_lagged: bool, twist: int, wrench: int, slope: int, w: np.ndarray
) -> None:
    """Adds the forces at all places to the wrench, their changes by the twist to the
    slope; see `balance`."""
    mu = w[FRICTION]
    _set_inward(twist, w)
    for k in range(PLACES):
        rate = w[_INWARD + k]
        after = w[DEPTH + k] + h * rate
        if after <= 0.0 and not (is_lagged and w[PRESSED + k] > 0.0):
            continue
        F, by_depth, by_rate = normal_force(after, rate, _law(k, w))
        dF = h * by_depth + by_rate
        limit, limit_by_rate = mu * F, mu * dF
        if is_lagged:
            limit, limit_by_rate = mu * w[PRESSED + k], 0.0
        _push(k, F, dF, w)
        _rub(k, twist, limit, limit_by_rate, w)
        _add_wrench(k, wrench, slope, w)


@compiled
def _set_inward(twist: int, w: np.ndarray) -> None:
    """Sets at what rate each place goes into the fixed body [m/s]."""
    vx, vy, vz = w[twist], w[twist + 1], w[twist + 2]
    wx, wy, wz = w[twist + 3], w[twist + 4], w[twist + 5]
    for k in range(PLACES):
        n, m = NORMAL + 3 * k, MOMENT + 3 * k
        rate = w[n] * vx + w[n + 1] * vy + w[n + 2] * vz
        rate += w[m] * wx + w[m + 1] * wy + w[m + 2] * wz
        w[_INWARD + k] = -rate


@compiled
def _push(k: int, F: float, dF: float, w: np.ndarray) -> None:
    """Sets the normal force at a place, and its slope by the place's velocity.

    Args:
        k: number of the place.
        F: normal force [N].
        dF: by which it falls with the velocity along the normal [N s/m].
        w: workspace.
    """
    normal = NORMAL + 3 * k
    for i in range(3):
        n = w[normal + i]
        w[_FORCE + i] = n * F
        for j in range(3):
            w[_BY_TWIST + 6 * i + j] = -n * dF * w[normal + j]


@compiled
def _rub(k: int, twist: int, limit: float, by_rate: float, w: np.ndarray) -> None:
    """Adds the friction at a place, and its slope by the place's velocity.

    Coulomb's, regularised: limit s / sqrt(s^2 + stiction^2) against the slip s.

    Args:
        k: number of the place.
        twist: of the bolt.
        limit: coefficient of friction times normal force [N].
        by_rate: by which that falls with the velocity along the normal [N s/m].
        w: workspace.
    """
    arm, normal, along, squares = ARM + 3 * k, NORMAL + 3 * k, 0.0, 0.0
    for i in range(3):
        w[_SLIP + i] = w[twist + i] + _cross(twist + 3, arm, i, w)
        along += w[normal + i] * w[_SLIP + i]
    for i in range(3):
        w[_SLIP + i] -= along * w[normal + i]
        squares += w[_SLIP + i] * w[_SLIP + i]
    speed = math.sqrt(squares + _STICTION**2)
    drag = limit / speed
    for i in range(3):
        share, n, row = w[_SLIP + i] / speed, w[normal + i], _BY_TWIST + 6 * i
        w[_FORCE + i] -= drag * w[_SLIP + i]
        for j in range(3):
            across = n * w[normal + j] + share * w[_SLIP + j] / speed
            if i == j:
                across -= 1.0
            w[row + j] += by_rate * share * w[normal + j] + drag * across


@compiled
def _add_wrench(k: int, wrench: int, slope: int, w: np.ndarray) -> None:
    """Adds a place's force to the wrench, and its change by the twist to the slope.

    Args:
        k: number of the place.
        wrench, slope: of (6,) and (6, 6), to which is added.
        w: workspace, with the force and its slope by the place's velocity.
    """
    arm = ARM + 3 * k
    for i in range(3):
        w[wrench + i] += w[_FORCE + i]
        w[wrench + 3 + i] += _cross(arm, _FORCE, i, w)
        for j in range(3):
            w[_BY_TWIST + 6 * i + 3 + j] = _cross(arm, _BY_TWIST + 6 * i, j, w)
    for j in range(6):
        for i in range(3):
            a, b = _BY_TWIST + 6 * ((i + 1) % 3), _BY_TWIST + 6 * ((i + 2) % 3)
            w[slope + 6 * i + j] += w[_BY_TWIST + 6 * i + j]
            turn = w[arm + (i + 1) % 3] * w[b + j] - w[arm + (i + 2) % 3] * w[a + j]
            w[slope + 6 * (3 + i) + j] += turn


@compiled
def newton(h: float, is_lagged: bool, twist: int, w: np.ndarray) -> int:
    """Goes from a twist to the balance; returns how it ended.

    A Newton step is halved until the error is lower; but the first is taken whole: it
    finds which places touch. Where the law jumps (an exponent below 1, full
    damping at once) there may be no such step: then the jump is where the bolt stays.

    Args:
        h: the step [s].
        is_lagged: see `balance`.
        twist: place of (6,), which is changed.
        w: workspace; W is set.
    """
    _copy(twist, _THERE, 6, w)
    error = math.inf
    for n in range(1 + _ITERATIONS):
        for _ in range(1 + _SHORTEST):
            balance(h, is_lagged, _THERE, _TRIAL_W, _TRIAL, _TRIAL_SLOPE, w)
            trial = squared(_TRIAL, w)
            if trial < error or (n == 1 and math.isfinite(trial)):
                break
            for i in range(6):
                w[_STEP + i] *= 0.5
                w[_THERE + i] = w[twist + i] + w[_STEP + i]
        else:
            return _STUCK
        _copy(_THERE, twist, 6, w)
        _copy(_TRIAL_W, W, 6, w)
        error, largest = trial, 0.0
        for i in range(6):
            w[_STEP + i] = -w[_TRIAL + i]
        solve_in_place(_TRIAL_SLOPE, _STEP, w)
        for i in range(6):
            largest = max(largest, abs(w[_STEP + i]))
            w[_THERE + i] = w[twist + i] + w[_STEP + i]
        if largest < _TOLERANCE:
            return _SOLVED
    return _UNFINISHED


@compiled
def squared(vector: int, w: np.ndarray) -> float:
    """Returns the squared length of a vector (6,)."""
    total = 0.0
    for i in range(6):
        total += w[vector + i] * w[vector + i]
    return total


@compiled
def solve_in_place(matrix: int, x: int, w: np.ndarray) -> None:
    """Solves A x = b by Gauss's elimination with pivots.

    Numba's own solver raises where A is singular; here x is then not finite.

    Args:
        matrix: place of A (6, 6); is changed.
        x: place of b (6,); is replaced by the solution.
        w: workspace.
    """
    for k in range(6):
        pivot = k
        for i in range(k + 1, 6):
            if abs(w[matrix + 6 * i + k]) > abs(w[matrix + 6 * pivot + k]):
                pivot = i
        if pivot != k:
            for j in range(k, 6):
                one, other = matrix + 6 * k + j, matrix + 6 * pivot + j
                w[one], w[other] = w[other], w[one]
            w[x + k], w[x + pivot] = w[x + pivot], w[x + k]
        for i in range(k + 1, 6):
            factor = w[matrix + 6 * i + k] / w[matrix + 7 * k]
            for j in range(k + 1, 6):
                w[matrix + 6 * i + j] -= factor * w[matrix + 6 * k + j]
            w[x + i] -= factor * w[x + k]
    for k in range(5, -1, -1):
        for j in range(k + 1, 6):
            w[x + k] -= w[matrix + 6 * k + j] * w[x + j]
        w[x + k] /= w[matrix + 7 * k]


@compiled
def _copy(one: int, other: int, size: int, w: np.ndarray) -> None:
    """Copies numbers from one place to another."""
    for i in range(size):
        w[other + i] = w[one + i]


@compiled
def _law(k: int, w: np.ndarray) -> tuple[float, float, float, float]:
    """Returns the law at a place, by its number; see `normal_force`."""
    return w[STIFFNESS + k], w[EXPONENT + k], w[LAW + 2], w[LAW + 3]


@compiled
def normal_force(
    penetration: float, rate: float, law: tuple[float, float, float, float]
) -> tuple[float, float, float]:
    """Returns F [N], dF/dp [N/m] and dF/d(dp/dt) [N s/m]; see `ImpactLaw`.

    Args:
        penetration: [m].
        rate: of the penetration [m/s].
        law: its parameters (`ImpactLaw.row`).
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
def find_places(w: np.ndarray) -> None:
    """Finds the places where the moved and the fixed body could touch.

    Sets how deep they are in each other [m], negative where there is a gap, arms from
    Bo to the places, and normals, in G; the law at each; and the torque of the part's
    spring.

    Args:
        w: workspace, with R_GB and p_GBo, and a row of `Gaps`.
    """
    for j in range(3):
        w[SPRING + j] = 0.0
    for k in range(PLACES):
        w[STIFFNESS + k], w[EXPONENT + k] = w[LAW], w[LAW + 1]
    kind = w[GAPS]
    if kind == SLOT:
        _find_slot(w)
        return
    for k in range(PLACES):
        _put(k, -1.0, 0.0, 0.0, 0.0, w)
        _face(k, 0.0, 0.0, 0.0, w)
    if kind == HOLE:
        _find_hole(w)
    elif kind == BAYONET:
        _find_bayonet(w)


@compiled
def _find_slot(w: np.ndarray) -> None:
    """Finds the places of `SlotGaps`."""
    slot, wall, lips_end = w[GAPS + 1], w[GAPS + 2], w[GAPS + 3]
    lip, under_lip, floor = w[GAPS + 4], w[GAPS + 5], w[GAPS + 6]
    start, end, neck = w[GAPS + 7], w[GAPS + 8], w[GAPS + 9]
    head, top, bottom = w[GAPS + 10], w[GAPS + 11], w[GAPS + 12]
    px, py, pz = w[P_GBO], w[P_GBO + 1], w[P_GBO + 2]
    ux, uy, uz = w[R_GB + 1], w[R_GB + 4], w[R_GB + 7]
    for k in range(PLACES):
        _face(k, _SLOT_NORMALS[k, 0], _SLOT_NORMALS[k, 1], _SLOT_NORMALS[k, 2], w)
    middle = (top + bottom) / 2.0
    _circle_between(lip, pz + lip * uz, 2, neck, slot, 0, w)
    _circle_between(-lip, pz - lip * uz, 2, neck, slot, 2, w)
    if px + lip * ux >= lips_end:
        w[DEPTH] = w[DEPTH + 1] = -1.0
    if px - lip * ux >= lips_end:
        w[DEPTH + 2] = w[DEPTH + 3] = -1.0
    _circle_between(middle, pz + middle * uz, 2, head, wall, 4, w)
    _circle_between(middle, px + middle * ux, 0, head, end, _STOPS, w)
    w[DEPTH + _STOPS + 1] = start - (px + middle * ux - head)
    if py + bottom * uy >= lip:  # the head is above the plate
        for k in range(4, _PLANES):
            w[DEPTH + k] = -1.0
    play = (under_lip - floor) - (top - bottom)
    tilt = max(math.sqrt(ux * ux + uz * uz), play / (4.0 * head))
    edge = _edge_stiffness(tilt, w)
    for i in range(_RIM_POINTS):
        below, above = _PLANES + _RIM_POINTS + i, _PLANES + i
        along, across = head * _RIM[i, 0], head * _RIM[i, 1]
        _off_axis(below, along, bottom, across, w)
        w[DEPTH + below] = floor - py - w[ARM + 3 * below + 1]
        _lean_on_edge(below, along, bottom, across, tilt, edge, w)
        is_corner = i % 2 == 1
        if is_corner:  # where a lip's edge cuts the rim
            across = math.copysign(slot, across) - pz
            reach = math.sqrt(max(0.0, head * head - across * across))
            along = math.copysign(reach, along)
        _off_axis(above, along, top, across, w)
        x, y = px + w[ARM + 3 * above], py + w[ARM + 3 * above + 1]
        is_covered = x < lips_end and (is_corner or abs(pz + across) > slot)
        is_inside = y < under_lip + head  # not yet lifted out
        w[DEPTH + above] = y - under_lip if is_covered and is_inside else -1.0
        if is_corner:
            _lean_on_corner(above, along, top, across, tilt, w)
        else:
            _lean_on_edge(above, along, top, across, tilt, edge, w)


@compiled
def _off_axis(
    k: int, along: float, height: float, across: float, w: np.ndarray
) -> None:
    """Sets a place's arm to a point of a round body, however that is turned about y_B.

    Args:
        k: number of the place.
        along, across: from its axis, where it is not tilted along x and z of G [m].
        height: along its axis [m].
        w: workspace.
    """
    ux, uy, uz = w[R_GB + 1], w[R_GB + 4], w[R_GB + 7]
    n, arm = math.sqrt(ux * ux + uy * uy), ARM + 3 * k
    w[arm] = height * ux + (along * uy - across * ux * uz) / n
    w[arm + 1] = height * uy - (along * ux + across * uy * uz) / n
    w[arm + 2] = height * uz + across * n


@compiled
def _edge_stiffness(tilt: float, w: np.ndarray) -> float:
    """Returns the stiffness of the head's edge on a face [N/mm^(e + 3/2)].

    The law's stiffness k is that of a wall as high as the head, t, is thick. A face is
    an elastic foundation: its pressure at depth p is k p^e / t^2. Depth falls from d at
    the edge by the tilt times the way s inwards, and there the head is 2 (2 R s)^(1/2)
    wide, so F = 2 (2 R)^(1/2) B(e + 1, 3/2) k / t^2 d^(e + 3/2) / tilt^(3/2).

    Args:
        tilt: [rad].
        w: workspace, with the law and the gaps.
    """
    e, head = w[LAW + 1], w[GAPS + 10]
    beta = math.gamma(e + 1.0) * math.gamma(1.5) / math.gamma(e + 2.5)
    width = 2.0 * math.sqrt(2.0 * head * _MM)
    return float(_foundation(w) * width * beta / tilt**1.5)


@compiled
def _lean_on_edge(
    k: int,
    along: float,
    height: float,
    across: float,
    tilt: float,
    stiffness: float,
    w: np.ndarray,
) -> None:
    """Sets the law where the head leans on a face with its edge, and where it presses.

    Args:
        k: number of the place.
        along, height, across: of the edge, see `_off_axis` [m].
        tilt: [rad].
        stiffness: see `_edge_stiffness`.
        w: workspace, with the depth.
    """
    e, head = w[LAW + 1], w[GAPS + 10]
    w[STIFFNESS + k], w[EXPONENT + k] = stiffness, e + 1.5
    if w[DEPTH + k] > 0.0:
        inwards = min(1.5 / (e + 2.5) * w[DEPTH + k] / tilt, head)
        share = 1.0 - inwards / head
        w[STIFFNESS + k] *= math.sqrt(0.5 * (1.0 + share))  # of a chord, (2 R - s) s
        _off_axis(k, share * along, height, share * across, w)


@compiled
def _lean_on_corner(
    k: int, along: float, height: float, across: float, tilt: float, w: np.ndarray
) -> None:
    """Sets the same where a lip cuts the rim; see `_lean_on_edge`.

    There the head is m s wide, so F = m B(e + 1, 2) k / t^2 d^(e + 2) / tilt^2, with m
    as it is on the way to the centre of pressure.

    Args:
        k: number of the place.
        along, height, across: of the corner, see `_off_axis` [m].
        tilt: [rad].
        w: workspace, with the depth.
    """
    e, head, far = w[LAW + 1], w[GAPS + 10], abs(along)
    inwards = min(2.0 / (e + 3.0) * max(w[DEPTH + k], _DEEP) / tilt, far)
    width = math.sqrt(head**2 - (far - inwards) ** 2) - abs(across)
    slope = width / inwards if inwards > 0.0 else 0.0
    w[STIFFNESS + k] = _foundation(w) * slope / ((e + 1.0) * (e + 2.0) * tilt**2)
    w[EXPONENT + k] = e + 2.0
    if w[DEPTH + k] > 0.0:
        x = along - math.copysign(inwards, along)
        z = across + math.copysign(0.5 * width, across)
        _off_axis(k, x, height, z, w)


@compiled
def _foundation(w: np.ndarray) -> float:
    """Returns the pressure of the head's faces at a depth of 1 mm [N/mm^2]."""
    thickness = (w[GAPS + 11] - w[GAPS + 12]) * _MM
    return float(w[LAW] / thickness**2)


@compiled
def _circle_between(
    height: float,
    place: float,
    along: int,
    radius: float,
    wall: float,
    first: int,
    w: np.ndarray,
) -> None:
    """Sets two places, of a circle between two walls.

    Args:
        height: of the circle's centre above Bo, along the bolt's axis [m].
        place: of its centre in G along the axis across the walls [m].
        along: number of the axis across the walls, at -wall and wall.
        radius, wall: [m].
        first: number of the first of the two places.
        w: workspace, with R_GB.
    """
    for side in range(2):
        sign = 1.0 - 2.0 * side
        w[DEPTH + first + side] = radius - wall + sign * place
        arm = ARM + 3 * (first + side)
        for axis in range(3):
            w[arm + axis] = height * w[R_GB + 3 * axis + 1]
        w[arm + along] += sign * radius


@compiled
def _put(k: int, depth: float, x: float, y: float, z: float, w: np.ndarray) -> None:
    """Sets a place's depth [m], and its arm from Bo in G [m]."""
    w[DEPTH + k] = depth
    w[ARM + 3 * k], w[ARM + 3 * k + 1], w[ARM + 3 * k + 2] = x, y, z


@compiled
def _face(k: int, x: float, y: float, z: float, w: np.ndarray) -> None:
    """Sets a place's normal in G."""
    w[NORMAL + 3 * k], w[NORMAL + 3 * k + 1], w[NORMAL + 3 * k + 2] = x, y, z


@compiled
def _point(k: int, x: float, y: float, z: float, w: np.ndarray) -> None:
    """Sets a place's arm to a point of the moved body, given in B [m]."""
    for axis in range(3):
        row = R_GB + 3 * axis
        w[ARM + 3 * k + axis] = w[row] * x + w[row + 1] * y + w[row + 2] * z


@compiled
def _height_at(level: float, w: np.ndarray) -> float:
    """Returns y in B of the axis where it is at a level of G [m]."""
    return float((level - w[P_GBO + 1]) / w[R_GB + 4])


@compiled
def _circle_in_hole(
    k: int, height: float, radius: float, hole: float, w: np.ndarray
) -> None:
    """Sets the place where a circle about the axis is nearest to a round hole's wall.

    Args:
        k: number of the place.
        height: of the circle above Bo [m].
        radius, hole: [m].
        w: workspace, with R_GB and p_GBo.
    """
    for axis in range(3):
        w[_ONE + axis] = height * w[R_GB + 3 * axis + 1]
    x, z = w[P_GBO] + w[_ONE], w[P_GBO + 2] + w[_ONE + 2]
    away = math.sqrt(x * x + z * z)
    if away > 0.0:
        x, z = x / away, z / away
    else:
        x, z = 1.0, 0.0
    arm_x, arm_z = w[_ONE] + radius * x, w[_ONE + 2] + radius * z
    _put(k, away + radius - hole, arm_x, w[_ONE + 1], arm_z, w)
    _face(k, -x, 0.0, -z, w)


@compiled
def _square_in_hole(
    first: int, height: float, half: float, hole: float, w: np.ndarray
) -> None:
    """Sets eight places, where the corners of a square meet a square hole's walls.

    Args:
        first: number of the first.
        height: of the square above Bo [m].
        half, hole: half widths [m].
        w: workspace, with R_GB and p_GBo.
    """
    for corner in range(4):
        x, z = 1.0 - 2.0 * (corner % 2), 1.0 - 2.0 * (corner // 2)
        for side in range(2):
            k, axis, sign = first + 2 * corner + side, 2 * side, x if side == 0 else z
            _point(k, half * x, height, half * z, w)
            w[DEPTH + k] = sign * (w[P_GBO + axis] + w[ARM + 3 * k + axis]) - hole
            w[NORMAL + 3 * k + axis] = -sign


@compiled
def _find_hole(w: np.ndarray) -> None:
    """Finds the places of `HoleGaps`: at the peg's tip, at the mouth, on the floor."""
    is_square, half, hole = w[GAPS + 1] > 0.0, w[GAPS + 2], w[GAPS + 3]
    tip, floor = w[GAPS + 4], w[GAPS + 5]
    if w[P_GBO + 1] + tip * w[R_GB + 4] >= 0.0:  # it is out
        return
    mouth = _height_at(0.0, w)
    if is_square:
        _square_in_hole(0, tip, half, hole, w)
        _square_in_hole(8, mouth, half, hole, w)
    else:
        _circle_in_hole(0, tip, half, hole, w)
        _circle_in_hole(1, mouth, half, hole, w)
    first, reach = PLACES - _RIM_POINTS, half
    if is_square:
        reach = half * math.sqrt(2.0)
    for i in range(_RIM_POINTS):
        if is_square and i % 2 == 0:
            continue  # its corners are between
        _point(first + i, reach * _RIM[i, 0], tip, reach * _RIM[i, 1], w)
        _face(first + i, 0.0, 1.0, 0.0, w)
        w[DEPTH + first + i] = floor - w[P_GBO + 1] - w[ARM + 3 * (first + i) + 1]


@compiled
def _find_bayonet(w: np.ndarray) -> None:
    """Finds the places of `BayonetGaps`, and its detent's torque.

    The shaft in the plate's hole; on each lug, by its number, corners under the plate,
    on the floor, at the stop, and in the notch.
    """
    shaft, hole, plate = w[GAPS + 1], w[GAPS + 2], w[GAPS + 3]
    low = w[P_GBO + 1] + w[GAPS + 8]
    detent, width = w[GAPS + 14], w[GAPS + 15]
    angle = math.atan2(w[R_GB + 2] - w[R_GB + 6], w[R_GB] + w[R_GB + 8])
    if abs(angle) < width:
        w[SPRING + 1] = -detent * math.sin(math.pi * angle / width)
    for k in range(2):
        level = -plate * k
        if low < level:
            _circle_in_hole(k, _height_at(level, w), shaft, hole, w)
    for lug in range(2):
        sign = 1.0 - 2.0 * lug
        for corner in range(4):
            _lug_under_plate(2 + 4 * lug + corner, sign, corner, w)
        for corner in range(2):
            _lug_on_floor(10 + 2 * lug + corner, sign, corner, w)
            _lug_at_stop(14 + 2 * lug + corner, sign, corner, w)
            _lug_in_notch(18 + 2 * lug + corner, sign, corner, w)


@compiled
def _across_notch(k: int, w: np.ndarray) -> float:
    """Returns how far a place is from the middle of the notches, signed [m]."""
    x, z = w[P_GBO] + w[ARM + 3 * k], w[P_GBO + 2] + w[ARM + 3 * k + 2]
    cosine, sine = w[GAPS + 9], w[GAPS + 10]
    return float(sine * x + cosine * z)


@compiled
def _along_notch(k: int, w: np.ndarray) -> float:
    """Returns how far out along the notches a place is, signed [m]."""
    x, z = w[P_GBO] + w[ARM + 3 * k], w[P_GBO + 2] + w[ARM + 3 * k + 2]
    cosine, sine = w[GAPS + 9], w[GAPS + 10]
    return float(cosine * x - sine * z)


@compiled
def _face_across(k: int, sign: float, w: np.ndarray) -> None:
    """Sets a place's normal across the notches, to one side or the other."""
    cosine, sine = w[GAPS + 9], w[GAPS + 10]
    _face(k, sign * sine, 0.0, sign * cosine, w)


@compiled
def _lug_under_plate(k: int, sign: float, corner: int, w: np.ndarray) -> None:
    """Sets a place where a lug's upper face, from hole to end, meets the plate."""
    hole, plate, end, half = w[GAPS + 2], w[GAPS + 3], w[GAPS + 5], w[GAPS + 6]
    top, half_notch, notch_end = w[GAPS + 7], w[GAPS + 11], w[GAPS + 12]
    reach = end if corner < 2 else hole
    _point(k, sign * reach, top, half * (1.0 - 2.0 * (corner % 2)), w)
    _face(k, 0.0, -1.0, 0.0, w)
    depth = w[P_GBO + 1] + w[ARM + 3 * k + 1] + plate
    excess = abs(_across_notch(k, w)) - half_notch
    is_in_notch = abs(_along_notch(k, w)) < notch_end and excess < max(0.0, depth)
    w[DEPTH + k] = -1.0 if is_in_notch or depth > plate / 2.0 else depth


@compiled
def _lug_on_floor(k: int, sign: float, corner: int, w: np.ndarray) -> None:
    """Sets a place where the end of a lug's lower face meets the floor."""
    _point(k, sign * w[GAPS + 5], w[GAPS + 8], w[GAPS + 6] * (1.0 - 2.0 * corner), w)
    _face(k, 0.0, 1.0, 0.0, w)
    w[DEPTH + k] = w[GAPS + 4] - w[P_GBO + 1] - w[ARM + 3 * k + 1]


@compiled
def _lug_at_stop(k: int, sign: float, corner: int, w: np.ndarray) -> None:
    """Sets a place where a lug's side meets its stop, under the plate."""
    hole, plate, end, half = w[GAPS + 2], w[GAPS + 3], w[GAPS + 5], w[GAPS + 6]
    middle = (w[GAPS + 7] + w[GAPS + 8]) / 2.0
    reach = end if corner == 0 else hole
    _point(k, sign * reach, middle, -sign * half, w)
    _face_across(k, sign, w)
    if w[P_GBO + 1] + middle < -plate:
        w[DEPTH + k] = -sign * _across_notch(k, w) - w[GAPS + 13]


@compiled
def _lug_in_notch(k: int, sign: float, corner: int, w: np.ndarray) -> None:
    """Sets a place where a lug's end meets a side of its notch, as it is lifted."""
    plate, end, half, top = w[GAPS + 3], w[GAPS + 5], w[GAPS + 6], w[GAPS + 7]
    bottom, half_notch, py = w[GAPS + 8], w[GAPS + 11], w[P_GBO + 1]
    side = 1.0 - 2.0 * corner
    middle = (max(py + bottom, -plate) + min(py + top, 0.0)) / 2.0
    _point(k, sign * end, middle - py, side * half, w)
    _face_across(k, -side, w)
    depth = side * _across_notch(k, w) - half_notch
    is_raised = py + top + plate > max(0.0, depth) and py + bottom < 0.0
    w[DEPTH + k] = depth if is_raised else -1.0

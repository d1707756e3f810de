"""The twin's plant in arrays: steps of many twins at once, and the sensor's load."""

import concurrent.futures
import dataclasses
import functools
import itertools
from typing import Self

import numpy as np

from drake_disasm.common.arrays import (
    Array,
    apply_matrix,
    array_like,
    cross,
    matrix_of,
    namespace,
    to_numpy,
    transposed,
)
from drake_disasm.common.rotations import cross_matrices, matrices_of_turns
from drake_disasm.twin.arm_step import ArmStep
from drake_disasm.twin.conditions import ImpactConditions, joined_columns
from drake_disasm.twin.equations import advance_rows

#: Until a bolt that is gripped at A has come to rest, as an episode begins [s].
SETTLING_TIME = 0.5
_SPLIT_FROM = 32  # plants of a thread, below which starting it takes longer


@dataclasses.dataclass(frozen=True)
class PlantState:
    """Where n twins are, in the twin's coordinates.

    Attributes:
        arm: (n, 12) coordinates of the arm, which encoders see, and their rates.
        q, v: (n, 6) coordinates of the bolt, and their rates.
        qd: (n, 6) commanded coordinates.
    """

    arm: Array
    q: Array
    v: Array
    qd: Array


@dataclasses.dataclass(frozen=True)
class Body:
    """What the sensor carries: the bolt and the fingers.

    Of one, or with n as an axis before the shapes below, of one for each twin.

    Attributes:
        mass: [kg]; (n, 1) of n.
        p_BoBcm_B: (3,) centre of mass [m].
        I_Bo_B: (3, 3) rotational inertia about Bo [kg m^2].
        g_Gn: (3,) gravity in the groove's nominal frame [m/s^2].
        p_BoTo_B: (3,) the point that the joints move [m].
    """

    mass: float | Array
    p_BoBcm_B: Array
    I_Bo_B: Array
    g_Gn: Array
    p_BoTo_B: Array

    @functools.cached_property
    def table(self) -> Array:
        """The numbers that `equations` use, a row for each twin or one for all (m, 16).

        Mass, p_ToBcm_B, the inertia about To in B, and the weight in Gn.
        """
        mass, p, p_ToBcm = self.mass, self.p_BoBcm_B, self.p_BoBcm_B - self.p_BoTo_B
        matmul = namespace(p).matmul
        to_p, to_c = (-matmul(K, K) for K in map(cross_matrices, (p, p_ToBcm)))
        of_matrices = mass if isinstance(mass, float) else mass[..., None]
        I_To = self.I_Bo_B + of_matrices * (to_c - to_p)
        of_all = mass if isinstance(mass, float) else mass[..., 0]
        columns = [
            (of_all, ()),
            (p_ToBcm, (3,)),
            (I_To, (3, 3)),
            (mass * self.g_Gn, (3,)),
        ]
        return joined_columns(columns, p)

    def load(self, q: Array, vdot: Array, outside: Array) -> Array:
        """Returns the load on the sensor, (n, 6) [f; tau] at Bo in Gn.

        Newton's and Euler's laws for the bolt, without products of velocities.

        Args:
            q, vdot: (n, 6) coordinates and their second derivatives.
            outside: (n, 6) wrench of the surroundings on the bolt at Bo in Gn.
        """
        xp = namespace(q)
        E, R = turning(q[:, 3:])
        alpha = apply_matrix(E, vdot[:, 3:])
        p_BoTo, p_BoBcm = (apply_matrix(R, p) for p in (self.p_BoTo_B, self.p_BoBcm_B))
        a_Bo = vdot[:, :3] - cross(alpha, p_BoTo)
        pull = self.mass * (self.g_Gn - a_Bo)
        spin = apply_matrix(self.I_Bo_B, apply_matrix(transposed(R), alpha))
        f = outside[:, :3] + pull - self.mass * cross(alpha, p_BoBcm)
        t = outside[:, 3:] + cross(p_BoBcm, pull) - apply_matrix(R, spin)
        return xp.concat([f, t], axis=1)


@dataclasses.dataclass(frozen=True)
class PlantStep:
    """The newest step of n plants.

    Attributes:
        state: after it.
        arm_before, q_before: (n, 12), (n, 6) of arm and bolt before it.
        vdot: (n, 6) second derivatives of the bolt's coordinates in the step.
        outside: (n, 6) wrench of the surroundings on the bolt at Bo in Gn.
        is_solved: (n,) whether contact found a balance, in all steps of the call.
        f_Gn: (m, 3) of the force in it, what is not the fixed part's; m is n or 1.
    """

    state: PlantState
    arm_before: Array
    q_before: Array
    vdot: Array
    outside: Array
    is_solved: Array
    f_Gn: Array

    @classmethod
    def of(cls, state: Array, newest: Array, is_solved: Array, f_Gn: Array) -> Self:
        """Returns the step of `equations.advance_rows`' arrays."""
        after, before = (
            (a[:, :12], a[:, 12:18], a[:, 18:24], a[:, 24:]) for a in (state, newest)
        )
        return cls(PlantState(*after), *before, is_solved, f_Gn)

    @property
    def on_part(self) -> Array:
        """The wrench on the fixed part (n, 6), [f; tau] in Gn, at Bo before it."""
        xp = namespace(self.outside)
        f = self.f_Gn - self.outside[:, :3]
        return xp.concat([f, -self.outside[:, 3:]], axis=1)

    def load(self, body: Body) -> Array:
        """Returns the load on the sensor (n, 6), [f; tau] at Bo in Gn.

        The plant reports the reaction in the bolt's frame at the step's beginning, and
        the sensor's axes are those at its end: the load turns along.
        """
        xp = namespace(self.vdot)
        load = body.load(self.q_before, self.vdot, self.outside)
        before, after = (turning(q[:, 3:])[1] for q in (self.q_before, self.state.q))
        R = xp.matmul(after, transposed(before))
        parts = (apply_matrix(R, load[:, :3]), apply_matrix(R, load[:, 3:]))
        return xp.concat(parts, axis=1)


@dataclasses.dataclass(frozen=True)
class Plant:
    """The plants of n twins: equations without a state.

    Plants don't see each other: what one does does not depend on its company. Arrays
    are NumPy's or torch's; what a GPU holds is computed there.

    Attributes:
        arm: a step of the controlled arm.
        body: that moves.
        conditions: of the contact, with the arm's springs.
        threads: of the host, which share the plants.
    """

    arm: ArmStep
    body: Body
    conditions: ImpactConditions
    threads: int = 1

    def advance(self, state: PlantState, rate: Array, steps: int) -> PlantStep:
        """Returns the newest of some steps.

        Args:
            state: before them.
            rate: (n, 6) of the commanded coordinates.
            steps: how many.
        """
        xp = namespace(rate)
        tables = (self.conditions.table, self.body.table, self.arm.table)
        before = xp.concat([state.arm, state.q, state.v, state.qd], axis=1)
        if not isinstance(rate, np.ndarray) and rate.device.type == "cuda":
            from drake_disasm.twin import on_gpu

            there = [array_like(table, rate) for table in tables]
            arrays = on_gpu.advance(there, self.arm.h, steps, rate, before)
        else:
            on_host = tuple(np.ascontiguousarray(to_numpy(table)) for table in tables)
            given = (on_host, self.arm.h, steps, to_numpy(rate), to_numpy(before))
            arrays = _advance_on_host(*given, self.threads)
        after, newest, is_solved = map(xp.asarray, arrays)
        return PlantStep.of(after, newest, is_solved, self.conditions.around.f_Gn)

    def settled(self, state: PlantState) -> PlantStep:
        """Returns the newest step once the bolts have come to rest."""
        still = 0.0 * state.q
        return self.advance(state, still, round(SETTLING_TIME / self.arm.h))


def _advance_on_host(
    constants: tuple[np.ndarray, ...],
    h: float,
    steps: int,
    rate: np.ndarray,
    state: np.ndarray,
    threads: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns what `equations.advance_rows` sets; threads share the plants."""
    count, newest = len(state), np.empty_like(state)
    is_solved = np.zeros(count, np.bool_)
    given = (constants, h, steps, rate, state, newest, is_solved)
    threads = max(1, min(threads, count // _SPLIT_FROM))
    ends = [count * i // threads for i in range(threads + 1)]
    if threads == 1:
        advance_rows(*given, 0, count)
        return state, newest, is_solved
    with concurrent.futures.ThreadPoolExecutor(threads) as pool:
        futures = [
            pool.submit(advance_rows, *given, first, end)
            for first, end in itertools.pairwise(ends)
        ]
    for future in futures:
        future.result()
    return state, newest, is_solved


def turning(turns: Array) -> tuple[Array, Array]:
    """Returns E (n, 3, 3), w = E turns', and R_GnB of turns about z, x, y (n, 3)."""
    xp = namespace(turns)
    R_GnB = matrices_of_turns(turns)
    s, c = xp.sin(turns[:, 0]), xp.cos(turns[:, 0])
    zero, one = xp.zeros_like(s), xp.ones_like(s)
    x, y, z = R_GnB[:, 0, 1], R_GnB[:, 1, 1], R_GnB[:, 2, 1]
    return matrix_of([[zero, c, x], [zero, s, y], [one, zero, z]]), R_GnB

"""The twin's plant in arrays: a step of many twins at once, and the sensor's load."""

import dataclasses

import numpy as np

from drake_disasm.common.arrays import (
    Array,
    apply_matrix,
    array_like,
    cross,
    namespace,
    transposed,
)
from drake_disasm.common.rotations import cross_matrices
from drake_disasm.twin import ImpactConditions, ImpactStep, turning
from drake_disasm.twin.arm_step import ArmStep

#: Until a bolt that is gripped at A has come to rest, as an episode begins [s].
SETTLING_TIME = 0.5


@dataclasses.dataclass(frozen=True)
class TwinState:
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

    def dynamics(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Returns the mass matrix (n, 6, 6), and what else acts (n, 6).

        In the twin's joints: the change of the weight with the angles, since the grip
        carries it as it is at their zero, less the terms with products of velocities
        (Newton's and Euler's laws at To, with the derivative of E).

        Args:
            q, v: (n, 6) coordinates and their rates.
        """
        xp, mass, angles = namespace(q), self.mass, q[:, 3:]
        E, R = turning(angles)
        E0, R0 = turning(0.0 * angles)
        omega = apply_matrix(E, v[:, 3:])
        c_B = self.p_BoBcm_B - self.p_BoTo_B
        c = apply_matrix(R, c_B)
        I = xp.matmul(R, xp.matmul(self._inertia_at_To(), transposed(R)))  # noqa: E741
        arm = array_like(mass, q)[..., None] * cross_matrices(c)
        one = array_like(mass, q)[..., None] * (0.0 * I + array_like(np.eye(3), q))
        S = xp.concat(
            [xp.concat([one, -arm], axis=2), xp.concat([arm, I], axis=2)], axis=1
        )
        turned = _derivative_term(angles, v[:, 3:], R)
        inertial = xp.concat(
            [
                mass * (cross(omega, cross(omega, c)) + cross(turned, c)),
                cross(omega, apply_matrix(I, omega)) + apply_matrix(I, turned),
            ],
            axis=1,
        )
        weight = mass * (self.g_Gn + 0.0 * c)
        now, carried = (cross(x, weight) for x in (c, apply_matrix(R0, c_B)))
        f, t = -inertial[:, :3], now - inertial[:, 3:]
        acting = apply_matrix(transposed(E), t) - apply_matrix(transposed(E0), carried)
        T = _joint_blocks(E)
        M = xp.matmul(transposed(T), xp.matmul(S, T))
        return M, xp.concat([f, acting], axis=1)

    def _inertia_at_To(self) -> Array:
        """Returns the rotational inertia about To in B, (..., 3, 3)."""
        mass = self.mass if isinstance(self.mass, float) else self.mass[..., None]
        p, c = self.p_BoBcm_B, self.p_BoBcm_B - self.p_BoTo_B
        matmul = namespace(p).matmul
        to_p, to_c = (-matmul(K, K) for K in map(cross_matrices, (p, c)))
        return self.I_Bo_B + mass * (to_c - to_p)

    def in_joints(self, q: Array, wrench: Array) -> Array:
        """Returns the joints' forces (n, 6) of a wrench (n, 6) on the bolt at Bo."""
        E, R = turning(q[:, 3:])
        f = wrench[:, :3]
        t_To = wrench[:, 3:] - cross(apply_matrix(R, self.p_BoTo_B), f)
        return namespace(q).concat([f, apply_matrix(transposed(E), t_To)], axis=1)

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


def _joint_blocks(E: Array) -> Array:
    """Returns the twist [v; w] at To by the joints' rates, (n, 6, 6)."""
    xp = namespace(E)
    zero = xp.zeros_like(E)
    one = zero + array_like(np.eye(3), E)
    rows = xp.concat([one, zero], axis=2), xp.concat([zero, E], axis=2)
    return xp.concat(rows, axis=1)


def _derivative_term(angles: Array, rates: Array, R: Array) -> Array:
    """Returns E' times the angles' rates, (n, 3): see `turning`."""
    xp = namespace(angles)
    s, c = xp.sin(angles[:, :1]), xp.cos(angles[:, :1])
    yaw, pitch, roll = (rates[:, i : i + 1] for i in range(3))
    zero = xp.zeros_like(s)
    second = xp.concat([-s, c, zero], axis=1)
    turn = xp.concat([zero, zero, yaw], axis=1) + pitch * second
    later = xp.concat([-c, -s, zero], axis=1)
    return pitch * yaw * later + roll * cross(turn, R[:, :, 0])


@dataclasses.dataclass(frozen=True)
class PlantStep:
    """One step of the plant, of n twins.

    Attributes:
        state: after it.
        q_before: (n, 6) of the bolt.
        vdot: (n, 6) second derivatives of the bolt's coordinates in the step.
        outside: (n, 6) wrench of the surroundings on the bolt at Bo in Gn.
        is_solved: (n,) whether contact found a balance.
    """

    state: TwinState
    q_before: Array
    vdot: Array
    outside: Array
    is_solved: Array

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


def plant_step(
    state: TwinState,
    rate: Array,
    arm: ArmStep,
    body: Body,
    conditions: ImpactConditions,
) -> PlantStep:
    """Returns the plant's next step.

    Args:
        state: before it.
        rate: (n, 6) of the commanded coordinates.
        arm: of the step's length.
        body: that moves.
        conditions: of the contact, with the arm's springs.
    """
    h, xp, c = arm.h, namespace(rate), conditions
    qd = state.qd + h * rate
    ahead = arm.ahead(state.arm, xp.concat([qd, rate], axis=1))
    step = ImpactStep.of(conditions, h, state.q, state.v, ahead[:, :6], ahead[:, 6:])
    outside = step.wrench
    outside[:, :3] += c.around.f_Gn
    # The contact foresees the plant's step with the inertia at zero; the plant has all.
    M, acting = body.dynamics(state.q, state.v)
    pull = c.K * (ahead[:, :6] - state.q) + c.D * ahead[:, 6:] + acting
    force = h * (pull + body.in_joints(state.q, outside)) + apply_matrix(M, state.v)
    A = M + array_like(np.eye(6), rate) * (h * c.D + h**2 * c.K)[..., None, :]
    v = xp.linalg.solve(A, force[..., None])[..., 0]
    q = state.q + h * v
    after = TwinState(arm.after(ahead, xp.concat([q, v], axis=1)), q, v, qd)
    return PlantStep(after, state.q, (v - state.v) / h, outside, step.is_solved)

"""The twin's plant in arrays: a step of many twins at once, and the sensor's load.

What it neglects of the diagram's plant (the change of inertia with the angles, Coriolis
forces) is far below the sensor's noise.
"""

import dataclasses

from drake_disasm.common.arrays import (
    Array,
    apply_matrix,
    cross,
    namespace,
    transposed,
)
from drake_disasm.impact import ImpactConditions, ImpactStep, turning
from drake_disasm.stations.arm_node import ArmStep


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
        """Returns the load on the sensor (n, 6), [f; tau] at Bo in Gn."""
        return body.load(self.q_before, self.vdot, self.outside)


def plant_step(
    state: TwinState, rate: Array, arm: ArmStep, conditions: ImpactConditions
) -> PlantStep:
    """Returns the plant's next step.

    Args:
        state: before it.
        rate: (n, 6) of the commanded coordinates.
        arm: of the step's length.
        conditions: of the contact, with the arm's springs.
    """
    h, xp = arm.h, namespace(rate)
    qd = state.qd + h * rate
    ahead = arm.ahead(state.arm, xp.concat([qd, rate], axis=1))
    step = ImpactStep(conditions, h, state.q, state.v, ahead[:, :6], ahead[:, 6:])
    v, outside, is_solved = step.attempt()
    outside[:, :3] += conditions.around.f_Gn
    q = state.q + h * v
    after = TwinState(arm.after(ahead, xp.concat([q, v], axis=1)), q, v, qd)
    return PlantStep(after, state.q, (v - state.v) / h, outside, is_solved)

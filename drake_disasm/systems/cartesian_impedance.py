"""Cartesian impedance control: a spring at the bolt, made by the joints' torques."""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, LeafSystem
from scipy.linalg.lapack import dposv

from drake_disasm.cell.arm_control import cartesian_gains, nullspace_gains
from drake_disasm.cell.arm_dynamics import ArmDynamics
from drake_disasm.common.spatial import rotation_vector
from drake_disasm.scenario import ArmConfig


class CartesianImpedance(LeafSystem):
    """Torques that hold the bolt as a spring and a damper would, without gravity's.

        tau = J^T (K e + D J (v_d - v)) + N (k_n (q_d - q) + d_n (v_d - v))

    at Bo in Gn, after Albu-Schaeffer et al. (ICRA 2003). e is the displacement of the
    commanded bolt from the real one; commands are joint angles, as by FRI in each of
    KUKA's controls. N = 1 - J^T Lambda J M^-1 lets the null space's spring accelerate
    no bolt. The gains are those of the start.

    It acts at the plant's time steps, explicitly, which the rotors' inertia allows:
    at 5000 N/m and 300 N m/rad the fastest mode is of 36 rad/s, 0.09 of a step.

    @system
    name: CartesianImpedance
    input_ports:
    - state
    - desired_state
    output_ports:
    - torque
    @endsystem

    Args:
        arm: with the gains' parameters.
        dynamics: of the arm with its tool, for this system alone.
        start: (n,) joint angles of the gains [rad].
    """

    def __init__(
        self, arm: ArmConfig, dynamics: ArmDynamics, start: np.ndarray
    ) -> None:
        super().__init__()
        self._dynamics = dynamics
        dynamics.set_positions(start)
        self._K, self._D = cartesian_gains(arm, dynamics.bolt_inertia())
        inertia = np.diag(dynamics.mass_matrix())
        self._k, self._d = nullspace_gains(arm, inertia)
        n = start.size
        self._commanded = start, dynamics.pose()
        self._state = self.DeclareVectorInputPort("state", 2 * n)
        self._desired = self.DeclareVectorInputPort("desired_state", 2 * n)
        self.DeclareVectorOutputPort(
            "torque",
            n,
            self._calc,
            prerequisites_of_calc={self._state.ticket(), self._desired.ticket()},
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        state, desired = self._state.Eval(context), self._desired.Eval(context)
        dq, dv = (desired - state).reshape(2, -1)
        X_GD = self._commanded_pose(desired[: dq.size])
        self._dynamics.set_positions(state[: dq.size])
        J, M = self._dynamics.jacobian(), self._dynamics.mass_matrix()
        e = _displacement(self._dynamics.pose(), X_GD)
        wrench = self._K @ e + self._D @ (J @ dv)
        free = self._k * dq + self._d * dv
        _, M_JT, _ = dposv(M, J.T)  # M^-1 J^T; positive definite, and much faster
        _, push, _ = dposv(J @ M_JT, M_JT.T @ free)  # what it would do to the bolt
        wrench -= push
        output.SetFromVector(J.T @ wrench + free)

    def _commanded_pose(self, q_d: np.ndarray) -> RigidTransform:
        """Returns X_GD; from memory while the command is the same."""
        if not np.array_equal(q_d, self._commanded[0]):
            self._dynamics.set_positions(q_d)
            self._commanded = q_d, self._dynamics.pose()
        return self._commanded[1]


def _displacement(X_GB: RigidTransform, X_GD: RigidTransform) -> np.ndarray:
    """Returns how far D is from B, (6,) [translation; rotation vector] in G."""
    turn = X_GD.rotation() @ X_GB.rotation().inverse()
    p = X_GD.translation() - X_GB.translation()
    return np.concatenate([p, rotation_vector(turn)])

"""IMPACT contact in the twin's diagram, implicit as the plant's own is."""

import dataclasses

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import Context, LeafSystem

from drake_disasm.impact import ImpactLaw, LockShape

#: Generalised force, residual and the residual's derivative.
_Evaluation = tuple[np.ndarray, np.ndarray, np.ndarray]

_ITERATIONS = 60
_HALVINGS = 12
_TOLERANCE = 1e-8  # m/s, of the velocities after the step
_NEAR = 1e-3  # m: farther than anything moves in a step
_STICTION = 1e-4  # m/s: creep at which friction is three quarters


@dataclasses.dataclass(frozen=True)
class ImpactConditions:
    """All that the contact depends on beside the state.

    Attributes:
        law: of the normal force.
        shape: of the lock.
        friction: Coulomb coefficient.
        X_GnG: the true groove in the nominal frame.
        M: (6, 6) mass matrix of the twin's joints, at their zero.
        K, D: (6,) their stiffness and damping.
    """

    law: ImpactLaw
    shape: LockShape
    friction: float
    X_GnG: RigidTransform
    M: np.ndarray
    K: np.ndarray
    D: np.ndarray


class ImpactContact(LeafSystem):
    """Pushes on the bolt so that IMPACT holds at the *end* of the plant's step.

    The law is stiff: taken at the start of a step it explodes long before the upper
    bounds of the thesis. The plant's step without contact is linear in the twin's six
    joints, so this system can foresee it, and solves

        (M + h D + h^2 K) v+ = M v + h (K (qd - q) + D vd) + h J^T f(q + h v+, v+)

    by Newton's method for the velocities v+ after the step; f is what it puts out,
    and the plant arrives at v+. Friction is Coulomb's, regularised. Forces from
    outside (an optional port) are passed on; the foresight leaves them out.

    @system
    name: ImpactContact
    input_ports:
    - state
    - desired_state
    - applied_spatial_force
    output_ports:
    - spatial_forces
    @endsystem

    Args:
        bolt: the body that is pushed.
        R_WGn: nominal groove frame in the world.
        time_step: of the plant, h [s].
    """

    def __init__(
        self, bolt: BodyIndex, R_WGn: RotationMatrix, time_step: float
    ) -> None:
        super().__init__()
        self._bolt, self._R_WGn, self._h = bolt, R_WGn.matrix(), time_step
        self._conditions = self.DeclareAbstractParameter(Value[object](None))
        self._state = self.DeclareVectorInputPort("state", 12)
        self._desired = self.DeclareVectorInputPort("desired_state", 12)
        self._outside = self.DeclareAbstractInputPort(
            "applied_spatial_force", Value[list[ExternallyAppliedSpatialForce]]()
        )
        self.DeclareAbstractOutputPort(
            "spatial_forces",
            Value[list[ExternallyAppliedSpatialForce]],
            self._calc,
            prerequisites_of_calc={
                self._state.ticket(),
                self._desired.ticket(),
                self._outside.ticket(),
                self.all_parameters_ticket(),
            },
        )

    def set_conditions(self, context: Context, conditions: ImpactConditions) -> None:
        """Puts law, shape and twin into this system's Context."""
        parameter = context.get_mutable_abstract_parameter(self._conditions)
        parameter.set_value(conditions)

    def _calc(self, context: Context, output: Value) -> None:
        parameter = context.get_abstract_parameter(self._conditions).get_value()
        problem = _Step(
            parameter,
            self._h,
            self._state.Eval(context),
            self._desired.Eval(context),
        )
        f, t = problem.solve()
        force = ExternallyAppliedSpatialForce()
        force.body_index = self._bolt
        force.F_Bq_W = SpatialForce(tau=self._R_WGn @ t, f=self._R_WGn @ f)
        has_more = self._outside.HasValue(context)
        output.set_value([force, *(self._outside.Eval(context) if has_more else [])])


class _Step:
    """One step of the plant with contact; vectors in Gn unless a name says G."""

    def __init__(
        self,
        conditions: ImpactConditions,
        h: float,
        state: np.ndarray,
        desired: np.ndarray,
    ) -> None:
        c = self._c = conditions
        self._h = h
        q, v = state[:6], state[6:]
        self._A = c.M + np.diag(h * c.D + h**2 * c.K)
        pull = c.K * (desired[:6] - q) + c.D * desired[6:]
        self._b = c.M @ v + h * pull
        self._E, R_GnB = _turning(q[3:])
        self._place(R_GnB, q[:3])

    def solve(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns force [N] and torque [N m] on the bolt at Bo, (3,) each."""
        v = np.linalg.solve(self._A, self._b)
        Q, r, jacobian = self._evaluate(v)
        for _ in range(_ITERATIONS):
            step = np.linalg.solve(jacobian, -r)
            if np.abs(step).max() < _TOLERANCE:
                break
            lower = self._lower(v, step, r)
            if lower is None:
                break
            v, (Q, r, jacobian) = lower
        else:
            raise RuntimeError("IMPACT contact: no force balances this step")
        return Q[:3], np.linalg.solve(self._E.T, Q[3:])

    def _place(self, R_GnB: np.ndarray, p_GnBo: np.ndarray) -> None:
        """Finds the places that could touch, and their Jacobians."""
        X_GnG = self._c.X_GnG
        R_GnG = X_GnG.rotation().matrix()
        p_GBo = R_GnG.T @ (p_GnBo - X_GnG.translation())
        found = self._c.shape.contacts(R_GnG.T @ R_GnB, p_GBo)
        near = found.penetration > -_NEAR
        self._p = found.penetration[near]
        self._n = found.normal[near] @ R_GnG.T
        arm = found.arm[near] @ R_GnG.T
        count = len(self._p)
        J = np.zeros((count, 3, 6))
        J[:, :, :3] = np.eye(3)
        J[:, :, 3:] = -_skew(arm) @ self._E
        self._Jn = np.einsum("ni,nij->nj", self._n, J)
        self._Jt = J - self._n[:, :, None] * self._Jn[:, None, :]

    def _evaluate(self, v: np.ndarray) -> _Evaluation:
        """Returns J^T f (6,), the residual (6,) and its derivative, at v+ = v."""
        h, mu, Jn, Jt = self._h, self._c.friction, self._Jn, self._Jt
        rate = -Jn @ v
        F, kp, kd = self._c.law.force_and_slopes(self._p + h * rate, rate)
        slip = Jt @ v
        speed = np.sqrt(np.sum(slip * slip, axis=1) + _STICTION**2)
        drag = (mu * F / speed)[:, None]
        Q = Jn.T @ F - np.tensordot(drag * slip, Jt, 2)
        dF = -(h * kp + kd)[:, None] * Jn
        along = slip / speed[:, None]
        turning = np.einsum("ni,nij->nj", along, Jt)
        d_slip = Jt - along[:, :, None] * turning[:, None, :]
        rubbing = drag[:, :, None] * d_slip + mu * along[:, :, None] * dF[:, None, :]
        dQ = Jn.T @ dF - np.tensordot(Jt, rubbing, ((0, 1), (0, 1)))
        return Q, self._A @ v - self._b - h * Q, self._A - h * dQ

    def _lower(
        self, v: np.ndarray, step: np.ndarray, r: np.ndarray
    ) -> tuple[np.ndarray, _Evaluation] | None:
        """Returns the first point along a Newton step whose error is lower.

        Where the law jumps (an exponent below 1, full damping at once) there may be
        none: then the jump is where the bolt stays.
        """
        for scale in 0.5 ** np.arange(_HALVINGS):
            there = self._evaluate(v + scale * step)
            if there[1] @ there[1] < r @ r:
                return v + scale * step, there
        return None


def _turning(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns E (3, 3) with w = E [yaw', pitch', roll'], and R_GnB."""
    yaw, pitch, roll = angles
    Rz = RotationMatrix.MakeZRotation(yaw)
    Ry = RotationMatrix.MakeYRotation(pitch)
    Rx = RotationMatrix.MakeXRotation(roll)
    first, both = Rz.matrix(), (Rz @ Ry).matrix()
    E = np.column_stack([[0.0, 0.0, 1.0], first[:, 1], both[:, 0]])
    return E, (Rz @ Ry @ Rx).matrix()


def _skew(a: np.ndarray) -> np.ndarray:
    """Returns [a]x (n, 3, 3) of vectors (n, 3)."""
    x, y, z = a.T
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.moveaxis(np.array(rows), 2, 0)

"""What closing the loop identified of an arm, as the numbers that a file can hold."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import (
    ArmEffect,
    Effect,
    FlangePayload,
    JointCoulombFriction,
    JointDahlFriction,
    JointViscousFriction,
    RotorInertia,
)
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.export.consistent_inertia import ConsistentInertia, ball, consistent_inertia
from sysid.fitting.fit import Fit
from sysid.identification.uncertainty import block_length
from sysid.models.base import LogModel
from sysid.models.joint_motion import JointMotionModel
from sysid.models.regressor import INERTIAL, ArmDynamics, BaseSet

Array = NDArray[np.float64]

#: Effects that URDF, SDF and MJCF hold. Of pre-sliding friction they hold what is left
#: when the joint slides.
DRY = (JointCoulombFriction, JointDahlFriction)
HELD = (*DRY, JointViscousFriction, RotorInertia, FlangePayload)

PAYLOAD = "identified_payload"
_LIGHTEST = 1e-3  # kg: a lighter payload is no body, but a correction of the last link


@dataclass(frozen=True)
class JointNumbers:
    """What a file holds of a joint.

    Attributes:
        damping: [N m s/rad], or [N s/m] of one that slides.
        friction: dry, when it slides [N m, or N].
        rotor: inertia reflected to the joint [kg m^2, or kg].
    """

    damping: float = 0.0
    friction: float = 0.0
    rotor: float = 0.0


@dataclass(frozen=True)
class Link:
    """A link's identified body.

    Attributes:
        name: of the link.
        inertial: INERTIAL (10,) about Bo, in B.
    """

    name: str
    inertial: Array


@dataclass(frozen=True)
class IdentifiedArm:
    """An arm as identified.

    Attributes:
        urdf: of the nominal arm, a path or `package://`.
        gravity: (3,) in the base's frame [m/s^2].
        joints: what a file holds of each, by its name, in the log's order.
        arm, base: nominal bodies, and which combinations of them were identified.
        bodies: physical ones with these base parameters.
        payload: on `flange`; None if there is none.
        flange: the name of the last link.
        effects: all of the verdict's, at their values.
        theta: parameters of the verdict's model that go with `bodies`.
    """

    urdf: str
    gravity: tuple[float, float, float]
    joints: dict[str, JointNumbers]
    arm: ArmDynamics
    base: BaseSet
    bodies: ConsistentInertia
    payload: Link | None
    flange: str
    effects: tuple[Effect, ...]
    theta: Array

    @classmethod
    def of(cls, closed: ClosedLoop) -> Self:
        """Returns the arm that closing the loop identified.

        Raises:
            DisasmError: the log is of another kind, the arm has no URDF, its base
                parameters were not all identified, or no physical arm has them.
        """
        model = exportable(closed.last.model)
        arm, base = model.rigid_bodies()
        flange = arm.links[arm.last_link.start // len(INERTIAL)]
        count, theta = len(base.independent), closed.last.theta
        payload, beta = _payload(model.effects_at(theta), arm, base)
        beta = beta + theta[:count]
        covariance = _covariance(closed.last)
        bodies = consistent_inertia(base, arm.inertia, beta, covariance[:count, :count])
        if not bodies.is_exact:
            theta = _moved(closed.last, covariance, bodies.beta - beta)
        effects = model.effects_at(theta)
        link = None if payload is None else Link(PAYLOAD, payload)
        joints = {joint: _numbers(joint, effects) for joint in model.joints}
        return cls(
            model.urdf,
            model.gravity,
            joints,
            arm,
            base,
            bodies,
            link,
            flange,
            effects,
            theta,
        )

    @property
    def links(self) -> list[Link]:
        """The links that differ from the file's."""
        parts = np.split(self.bodies.inertia, len(self.arm.links))
        return [Link(self.arm.links[i], parts[i]) for i in self.bodies.changed]

    @property
    def left_out(self) -> list[ArmEffect]:
        """The effects that no file holds."""
        return [
            effect
            for effect in self.effects
            if isinstance(effect, ArmEffect) and not isinstance(effect, HELD)
        ]


def exportable(model: LogModel) -> JointMotionModel:
    """Returns a model, if a robot's file can hold what it identifies.

    Raises:
        DisasmError: it can't.
    """
    if not isinstance(model, JointMotionModel):
        raise DisasmError(
            "export: the log has no joint torques, from which a robot's inertias and "
            "friction are identified; give a log of kind joint_motion"
        )
    if not model.has_urdf:
        raise DisasmError(
            "export: the axis has no URDF to write to; name that of the robot by `urdf`"
        )
    if not model.has_free_bodies:
        raise DisasmError(
            "export: some base parameters were held at the URDF's values, so that the "
            "arm was not identified; leave `parameters` out"
        )
    return model


def _payload(
    effects: Sequence[Effect], arm: ArmDynamics, base: BaseSet
) -> tuple[Array | None, Array]:
    """Returns the payload's body, and what it leaves for the links' base parameters.

    The effect's inertia is a point's. The file gets a ball of the same mass and first
    moment, and the links what the torques have less of than the ball.
    """
    carried = [e for e in effects if isinstance(e, FlangePayload) and not e.is_null]
    pi = np.zeros_like(arm.inertia)
    pi[arm.last_link] = sum((e.inertial for e in carried), np.zeros(len(INERTIAL)))
    mass, moment = pi[arm.last_link][0], pi[arm.last_link][1:4]
    if mass < _LIGHTEST:
        return None, base.beta(pi)
    body = ball(mass, moment / mass)
    pi[arm.last_link] -= body
    return body, base.beta(pi)


def _numbers(joint: str, effects: Sequence[Effect]) -> JointNumbers:
    own = [e for e in effects if getattr(e, "joint", None) == joint]
    return JointNumbers(
        sum(e.coefficient for e in own if isinstance(e, JointViscousFriction)),
        sum(e.size for e in own if isinstance(e, DRY)),
        sum(e.inertia for e in own if isinstance(e, RotorInertia)),
    )


def _covariance(fit: Fit) -> Array:
    """Returns the covariance (p, p) of a fit's parameters, SI.

    By Gauss-Newton, with the power that the residual has in each channel, times the
    rows over which it is correlated. Shape parameters are held: their rows are zero.
    """
    linear, parameters = fit.linearisation, fit.model.parameters
    free = np.flatnonzero([not p.is_shape for p in parameters])
    J, w, r = linear.jacobian[..., free], linear.weights, linear.residual
    flat = J.reshape(-1, len(free))
    H = np.linalg.pinv(flat.T @ (w.reshape(-1, 1) * flat), hermitian=True)
    power = np.mean((w * r) ** 2, axis=0) * r.size / max(1, r.size - len(free))
    middle = np.einsum("rci,c,rcj->ij", J, power, J, optimize=True)
    # A block is twice as long as the residual is correlated.
    rows = max(1.0, 0.5 * block_length(r, fit.model.measurements.episode))
    span = np.array([parameters[i].high - parameters[i].low for i in free])
    covariance = np.zeros((len(parameters), len(parameters)))
    covariance[np.ix_(free, free)] = rows * (H @ middle @ H) * np.outer(span, span)
    return covariance


def _moved(fit: Fit, covariance: Array, change: Array) -> Array:
    """Returns the most likely parameters (p,) with base parameters changed."""
    count = len(change)
    step = np.linalg.solve(covariance[:count, :count], change)
    bounds = [(p.low, p.high) for p in fit.model.parameters]
    low, high = np.array(bounds).T
    return np.clip(fit.theta + covariance[:, :count] @ step, low, high)

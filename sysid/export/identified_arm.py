"""What closing the loop identified of an arm, as the numbers that a file can hold."""

import itertools
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
from sysid.export.consistent_inertia import (
    ConsistentInertia,
    ball,
    consistent_inertia,
    whitening,
)
from sysid.fitting.fit import Fit
from sysid.identification.uncertainty import block_length
from sysid.models.base import LogModel
from sysid.models.joint_motion import JointMotionModel
from sysid.models.regressor import INERTIAL, ArmRegressor, BaseSet

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
    arm: ArmRegressor
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
        effects = model.effects_at(theta)
        covariance = _covariance(closed.last)
        within = covariance[:count, :count]
        bodies, beta = _bodies(arm, base, theta[:count], within, effects)
        if not bodies.is_exact:
            theta = _moved(closed.last, covariance, bodies.beta - beta)
        effects = model.effects_at(theta)
        payload = bodies.inertia[len(arm.inertia) :]
        link = Link(_free_name(arm.links), payload) if len(payload) else None
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
        parts, names = self.bodies.inertia.reshape(-1, len(INERTIAL)), self.arm.links
        return [Link(names[i], parts[i]) for i in self.bodies.changed if i < len(names)]

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


def _bodies(
    arm: ArmRegressor,
    base: BaseSet,
    beta: Array,
    covariance: Array,
    effects: Sequence[Effect],
) -> tuple[ConsistentInertia, Array]:
    """Returns the links' bodies, and a payload's, and the base parameters of all.

    The effect's payload is a point with a mass. The body has the same mass and first
    moment, and what it has of inertia the last link has less.
    """
    pi, B = np.zeros_like(arm.inertia), base.matrix(len(arm.inertia))
    for effect in effects:
        if isinstance(effect, FlangePayload) and not effect.is_null:
            pi[arm.last_link] += effect.inertial
    beta = beta + B @ pi
    body = pi[arm.last_link]
    if body[0] < _LIGHTEST:
        return consistent_inertia(B, arm.inertia, beta, covariance), beta
    held = {len(pi) + i: float(body[i]) for i in range(4)}
    nominal = np.concatenate([arm.inertia, ball(body[0], body[1:4] / body[0])])
    B = np.hstack([B, B[:, arm.last_link]])
    return consistent_inertia(B, nominal, beta, covariance, held), beta


def _free_name(links: Sequence[str]) -> str:
    """Returns a name for a payload that no link has: a file may be exported again."""
    names = (f"{PAYLOAD}{number or ''}" for number in itertools.count())
    return next(name for name in names if name not in links)


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
    rows over which it is correlated. Shape parameters and a payload, which is not told
    from the last link, are held: their rows are zero.
    """
    linear, parameters = fit.linearisation, fit.model.parameters
    payload = f"{FlangePayload.__name__}."
    is_free = [not (p.is_shape or p.name.startswith(payload)) for p in parameters]
    free = np.flatnonzero(is_free)
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
    W = whitening(covariance[:count, :count])
    step = W.T @ (W @ change)
    bounds = [(p.low, p.high) for p in fit.model.parameters]
    low, high = np.array(bounds).T
    return np.clip(fit.theta + covariance[:, :count] @ step, low, high)

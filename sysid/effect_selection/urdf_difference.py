"""By how much identified rigid bodies differ from the URDF's, and what explains it."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lstsq

from sysid.fitting.fit import Array, Fit
from sysid.fitting.settings import DEFAULT_SETTINGS
from sysid.models.joint_motion import JointMotionModel
from sysid.parameters import Scaling

_RANK = 1e-6  # of the largest singular value: below it the log does not tell
_EXPLAINS = 0.5  # of the difference: what explains less is not named
_WELDED = 1e-6  # by which shares of bodies on links that move as one differ
_OPEN = 1e-3  # of a direction that the log does not tell, in one coefficient


@dataclass(frozen=True)
class AddedBody:
    """A body on one link that makes the URDF's rigid bodies the identified ones.

    Attributes:
        link: its name.
        mass: more than the URDF says [kg], with its 95 % interval.
        distance: of the body's centre of mass from the link's origin [m].
        share: of the difference in torque that rotors leave, as a mean square.
        rivals: links on which a body explains it about as well.
    """

    link: str
    mass: tuple[float, float, float]
    distance: float
    share: float
    rivals: tuple[str, ...] = ()


@dataclass(frozen=True)
class UrdfDifference:
    """How identified base parameters differ from the URDF's.

    Attributes:
        share: rms torque that the difference makes, of the rms torque.
        names: of the base parameters: each stands for a sum (they are regrouped).
        units: of them.
        urdf, identified: (b,) values, SI.
        half: (b,) half of 95 % intervals.
        rotors: share of it that inertia of rotors explains, as a mean square.
        body: what explains the rest; None if no body on a single link does.
    """

    share: float
    names: tuple[str, ...]
    units: tuple[str, ...]
    urdf: Array
    identified: Array
    half: Array
    rotors: float
    body: AddedBody | None

    def to_mapping(self) -> dict[str, Any]:
        """Returns the difference as plain data, for `result.json`."""
        rows = zip(
            self.names, self.units, self.urdf, self.identified, self.half, strict=True
        )
        return {
            "share_of_torque": self.share,
            "sentence": self.sentence,
            "base_parameters": {
                name: {
                    "unit": unit,
                    "urdf": float(nominal),
                    "identified": float(value),
                    "interval_95": [float(value - half), float(value + half)],
                }
                for name, unit, nominal, value, half in rows
            },
            "explained_by_rotors": self.rotors,
            "body": dataclasses.asdict(self.body) if self.body else None,
        }

    @property
    def differing(self) -> tuple[str, ...]:
        """Names of base parameters whose interval excludes the URDF's value."""
        away = np.abs(self.identified - self.urdf) > self.half
        return tuple(n for n, is_far in zip(self.names, away, strict=True) if is_far)

    @property
    def sentence(self) -> str:
        """The difference in plain English."""
        count = f"{len(self.differing)} of {len(self.names)}"
        said = (
            f"The rigid bodies differ from the URDF's by {100 * self.share:.2g} % of "
            f"the torque ({count} base parameters, which are sums over links, by more "
            "than their intervals)"
        )
        if self.rotors >= _EXPLAINS:
            said += f"; inertia of rotors explains {100 * self.rotors:.0f} % of that"
        rest = "of the rest" if self.rotors >= _EXPLAINS else "of that"
        if self.body is None:
            return f"{said}; no body on a single link explains half {rest}."
        value, low, high = self.body.mass
        word = "more" if value > 0.0 else "less"
        ends = sorted((abs(low), abs(high)))
        mass = f"{abs(value):.3g} kg ({ends[0]:.3g} to {ends[1]:.3g}) {word}"
        others = f" (or {', '.join(self.body.rivals)})" if self.body.rivals else ""
        return (
            f"{said}; {100 * self.body.share:.0f} % {rest} is {mass} on "
            f"{self.body.link}{others} than the URDF says, "
            f"{1e3 * self.body.distance:.0f} mm from its origin."
        )


def urdf_difference(fit: Fit) -> UrdfDifference | None:
    """Returns how a fit's base parameters differ from the URDF's.

    None where they are not all identified, or there is no URDF.

    Args:
        fit: of joint torques, with or without effects.
    """
    model = fit.model
    if not isinstance(model, JointMotionModel):
        return None
    if not (model.has_urdf and model.has_free_bodies):
        return None
    count = model.motion.Y.shape[2]
    own = model.parameters[:count]
    urdf = np.array([p.nominal for p in own])
    identified = fit.theta[:count]
    slope = Scaling(model.parameters).slope(fit.theta)[:count]
    root = fit.half_interval_factor * slope
    C = fit.covariance[:count, :count] * np.outer(root, root)
    Y = model.motion.Y.reshape(-1, count)
    G = Y.T @ Y / Y.shape[0]
    difference = identified - urdf
    power = float(np.mean(model.measurements.values**2))
    return UrdfDifference(
        float(np.sqrt(difference @ G @ difference / power)),
        tuple(p.name for p in own),
        tuple(p.unit for p in own),
        urdf,
        identified,
        np.sqrt(np.diagonal(C)),
        *_explanation(model, G, difference, C),
    )


def links_in_base(model: JointMotionModel) -> dict[str, Array]:
    """Returns what inertial parameters (10,) of each link add to the base parameters.

    (b, 10) by the link's name, from the base on.
    """
    arm, base = model.rigid_bodies()
    parts = np.split(base.matrix(len(arm.inertia)), len(arm.links), axis=1)
    return dict(zip(arm.links, parts, strict=True))


def _rotors(model: JointMotionModel) -> Array:
    """Returns what an inertia at each rotor changes of the base parameters (b, joints).

    As far as bodies can make the same torques.
    """
    Y, vd = model.motion.Y, model.motion.vd
    alone = np.eye(vd.shape[1]) * vd[:, None, :]
    columns = alone.reshape(-1, vd.shape[1])
    return np.asarray(lstsq(Y.reshape(-1, Y.shape[2]), columns)[0])


def _explanation(
    model: JointMotionModel, G: Array, difference: Array, C: Array
) -> tuple[float, AddedBody | None]:
    """Returns what rotors explain of a difference (b,), and the body for the rest.

    A URDF seldom states rotors, and their inertia looks like that of many bodies. So a
    body that leaves more than the intervals allow is fitted with them. None explains
    less than half of what rotors leave.

    Args:
        model: whose links they are.
        G: (b, b) mean Y^T Y over the readings.
        difference: of the base parameters.
        C: (b, b) covariance of the base parameters, in half 95 % intervals.
    """
    total = float(difference @ G @ difference)
    allowed = float(np.sum(G * C)) / max(total, 1e-300)
    alone = _outermost(_bodies(model, G, difference, C, np.zeros((len(G), 0))))
    rotors = _rotors(model)
    by_rotors = _Explained.by(rotors, G, difference).share
    if alone is not None and alone.share >= max(1.0 - allowed, by_rotors):
        return 0.0, alone
    left = 1.0 - by_rotors
    if left <= allowed:
        return by_rotors, None
    of_rest = [
        dataclasses.replace(body, share=(body.share - by_rotors) / left)
        for body in _bodies(model, G, difference, C, rotors)
    ]
    return by_rotors, _outermost(of_rest)


def _bodies(
    model: JointMotionModel, G: Array, difference: Array, C: Array, others: Array
) -> list[AddedBody]:
    """Returns bodies on links, from the base on, whose mass is surely not zero.

    Args:
        model, G, difference, C: see `_explanation`.
        others: (b, k) what is fitted with each.
    """
    found = []
    for link, into_base in links_in_base(model).items():
        by = _Explained.by(np.hstack([into_base, others]), G, difference)
        off = float(np.sqrt(by.back[0] @ C @ by.back[0]))
        mass = float(by.x[0])
        if by.is_determined[0] and abs(mass) > off:
            distance = float(np.linalg.norm(by.x[1:4]) / abs(mass))
            bounds = (mass, mass - off, mass + off)
            found.append(AddedBody(link, bounds, distance, by.share))
    return found


def _outermost(bodies: Sequence[AddedBody]) -> AddedBody | None:
    """Returns, of bodies that explain most, that on the outermost link.

    None if none explains half. Its rivals explain about as much, on links that move
    otherwise.
    """
    most = max((body.share for body in bodies), default=0.0)
    if most < _EXPLAINS:
        return None
    least = most - DEFAULT_SETTINGS.ambiguity_margin
    *others, best = (body for body in bodies if body.share >= least)
    rivals = tuple(b.link for b in others if abs(b.share - best.share) > _WELDED)
    return dataclasses.replace(best, rivals=rivals)


@dataclass(frozen=True)
class _Explained:
    """A least-squares explanation of a difference of base parameters.

    Attributes:
        x: (k,) coefficients of its columns.
        back: (k, b) their derivatives by the difference.
        share: of the difference in torque, as a mean square.
        is_determined: (k,) which coefficients the others can't make up for.
    """

    x: Array
    back: Array
    share: float
    is_determined: NDArray[np.bool_]

    @classmethod
    def by(cls, columns: Array, G: Array, difference: Array) -> Self:
        """Returns the explanation by columns (b, k), where G weighs the base."""
        values, axes = np.linalg.eigh(G)
        root = np.sqrt(np.maximum(values, 0.0))[:, None] * axes.T
        A = root @ columns
        size = np.linalg.norm(A, axis=0)
        is_used = size > _RANK * size.max(initial=1e-300)
        scaled = np.where(is_used, A / np.where(is_used, size, 1.0), 0.0)
        U, s, Vt = np.linalg.svd(scaled, full_matrices=True)
        rank = int(np.sum(s > _RANK * s[0]))
        inverse = (Vt[:rank].T / s[:rank]) @ U[:, :rank].T
        back = inverse @ root / np.where(is_used, size, 1.0)[:, None]
        x = back @ difference
        left = difference - columns @ x
        total = max(float(difference @ G @ difference), 1e-300)
        is_open = np.abs(Vt[rank:]).max(axis=0, initial=0.0) > _OPEN
        return cls(x, back, 1.0 - float(left @ G @ left) / total, is_used & ~is_open)

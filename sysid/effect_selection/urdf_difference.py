"""By how much identified rigid bodies differ from the URDF's, and what explains it."""

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from sysid.fitting.fit import Array, Fit
from sysid.models.joint_motion import JointMotionModel
from sysid.parameters import Scaling

_RANK = 1e-6  # of the largest singular value: below it the log does not tell
_EXPLAINS = 0.5  # of the difference: a body that explains less is not named


@dataclass(frozen=True)
class AddedBody:
    """A body on one link that makes the URDF's rigid bodies the identified ones.

    Attributes:
        link: its name.
        mass: more than the URDF says [kg], with its 95 % interval.
        distance: of the body's centre of mass from the link's origin [m].
        share: of the difference in torque that it explains, as a mean square.
    """

    link: str
    mass: tuple[float, float, float]
    distance: float
    share: float


@dataclass(frozen=True)
class UrdfDifference:
    """How identified base parameters differ from the URDF's.

    Attributes:
        share: rms torque that the difference makes, of the rms torque.
        names: of the base parameters: each stands for a sum (they are regrouped).
        units: of them.
        urdf, identified: (b,) values, SI.
        half: (b,) half of 95 % intervals.
        body: what explains it; None if no body on a single link does.
    """

    share: float
    names: tuple[str, ...]
    units: tuple[str, ...]
    urdf: Array
    identified: Array
    half: Array
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
        if self.body is None:
            return f"{said}; no body on a single link explains half of that."
        value, low, high = self.body.mass
        word = "more" if value > 0.0 else "less"
        ends = sorted((abs(low), abs(high)))
        mass = f"{abs(value):.3g} kg ({ends[0]:.3g} to {ends[1]:.3g}) {word}"
        return (
            f"{said}; {100 * self.body.share:.0f} % of that is {mass} on "
            f"{self.body.link} than the URDF says, {1e3 * self.body.distance:.0f} mm "
            "from its origin."
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
        _body(model, G, difference, C),
    )


def links_in_base(model: JointMotionModel) -> dict[str, Array]:
    """Returns what inertial parameters (10,) of each link add to the base parameters.

    (b, 10) by the link's name, from the base on.
    """
    arm, base = model.rigid_bodies()
    parts = np.split(base.matrix(len(arm.inertia)), len(arm.links), axis=1)
    return dict(zip(arm.links, parts, strict=True))


def _body(
    model: JointMotionModel, G: Array, difference: Array, C: Array
) -> AddedBody | None:
    """Returns the body on one link that explains most of a difference (b,).

    Args:
        model: whose links they are.
        G: (b, b) mean Y^T Y over the readings.
        difference: of the base parameters.
        C: (b, b) covariance of the base parameters, in half 95 % intervals.
    """
    total = float(difference @ G @ difference)
    found: list[AddedBody] = []
    for link, into_base in links_in_base(model).items():
        power = np.einsum("bi,bc,ci->i", into_base, G, into_base)
        used = power > _RANK * power.max(initial=1e-300)
        P = into_base[:, used] / np.sqrt(power[used])
        if not used[0] or np.linalg.cond(P.T @ G @ P) > 1.0 / _RANK:
            continue  # the log does not tell this link's mass
        back = np.linalg.solve(P.T @ G @ P, P.T @ G) / np.sqrt(power[used])[:, None]
        x = back @ difference
        left = difference - into_base[:, used] @ x
        off = float(np.sqrt(back[0] @ C @ back[0]))
        moment = x[1 : 1 + int(used[1:4].sum())]
        found.append(
            AddedBody(
                link,
                (float(x[0]), float(x[0] - off), float(x[0] + off)),
                float(np.linalg.norm(moment) / max(abs(x[0]), 1e-9)),
                1.0 - float(left @ G @ left) / max(total, 1e-300),
            )
        )
    # Of links that are welded to each other, the outermost: the flange.
    best = max(reversed(found), key=lambda each: round(each.share, 6), default=None)
    return best if best is not None and best.share >= _EXPLAINS else None

"""An arm's rigid bodies close to a measured motion, to first order.

To ask Drake for them takes longer than all the rest of a step, and the motions that a
fit tries differ by milliradians. So they are asked for along the measured motion, once,
with their derivatives there. States that are far from it are left to Drake.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.effects import ArmEffect
from sysid.models.base import Array
from sysid.models.response.rigid_bodies import RigidBodies, RigidBodyTerms

_CHANGE = 1e-5  # rad and rad/s, for differences
#: So near the measured ones, positions and velocities count as close. What is left out
#: is of second order: 0.02 % of gravity's torque, and of Coriolis torques that of
#: 0.1 rad/s.
_NEAR = (0.02, 0.1)  # rad, rad/s; or m, m/s
#: Segments that are kept in mind: 1 MB each for seven joints and a second. Of longer
#: logs Drake is asked again each time.
MOST_KEPT = 256


@dataclass(frozen=True)
class Bodies:
    """An arm's rigid bodies, and what its controller knows of them.

    Attributes:
        arm: by the URDF.
        compensates: whether the controller adds what gravity takes.
    """

    arm: RigidBodies
    compensates: bool

    def terms(self, q: Array, v: Array, effects: Sequence[ArmEffect]) -> "BodyTerms":
        """Returns what Drake gives of states (n, joints), with effects on bodies."""
        found = self.arm.terms(q, v, effects)
        added = self.arm.holding(q) if self.compensates else np.zeros_like(q)
        return BodyTerms(found.M, found.bias, added)


@dataclass(frozen=True)
class BodyTerms(RigidBodyTerms):
    """Rigid bodies, and what the controller adds.

    Attributes:
        added: (..., joints) torques.
    """

    added: Array

    @classmethod
    def zeros(cls, *shape: int) -> Self:
        """Returns terms of states (..., joints) that are to be put in."""
        return cls(np.zeros((*shape, shape[-1])), np.zeros(shape), np.zeros(shape))

    def of(self, lanes: NDArray[np.intp] | slice) -> Self:
        """Returns those of some states (n, joints) in a row."""
        return type(self)(self.M[lanes], self.bias[lanes], self.added[lanes])

    def put(self, where: tuple[int, NDArray[np.bool_]], terms: "BodyTerms") -> None:
        """Replaces those of some states."""
        for name in ("M", "bias", "added"):
            getattr(self, name)[where] = getattr(terms, name)

    def flat(self) -> Self:
        """Returns the same of all states (n, joints) in a row."""
        joints = self.bias.shape[-1]
        M = self.M.reshape(-1, joints, joints)
        return type(self)(M, *(a.reshape(-1, joints) for a in (self.bias, self.added)))


@dataclass(frozen=True)
class Expansion:
    """Terms along motions, and their derivatives.

    Attributes:
        q, v: (steps, segments, joints) the motions.
        values: (steps, segments, k) mass matrix, bias and added torques in a row.
        by_q: (steps, segments, k, joints) derivatives of these.
        by_v: (steps, segments, joints, joints) of the bias.
    """

    q: Array
    v: Array
    values: Array
    by_q: Array
    by_v: Array

    @classmethod
    def along(cls, bodies: Bodies, q: Array, v: Array) -> Self:
        """Returns the expansion along motions (steps, segments, joints)."""
        _, segments, joints = q.shape
        parts = [
            _of_motion(bodies, q[:, n].tobytes(), v[:, n].tobytes(), joints)
            for n in range(segments)
        ]
        stacked = (np.stack(arrays, axis=1) for arrays in zip(*parts, strict=True))
        return cls(q, v, *stacked)

    def at(self, step: int, q: Array, v: Array) -> tuple[BodyTerms, NDArray[np.bool_]]:
        """Returns the terms of states (sets, segments, joints) in a step.

        And which (sets, segments) are too far for them.
        """
        joints = q.shape[-1]
        dq, dv = q - self.q[step], v - self.v[step]
        is_near = (np.abs(dq) <= _NEAR[0]) & (np.abs(dv) <= _NEAR[1])
        row = self.values[step] + _product(self.by_q[step], dq)
        M, bias, added = np.split(row, [joints**2, joints**2 + joints], axis=-1)
        bias = bias + _product(self.by_v[step], dv)
        M = M.reshape(*q.shape, joints)
        return BodyTerms(M, bias, added), ~is_near.all(axis=-1)


@functools.lru_cache(maxsize=MOST_KEPT)
def _of_motion(
    bodies: Bodies, q: bytes, v: bytes, joints: int
) -> tuple[Array, Array, Array]:
    """Returns values and derivatives along one motion, of bytes (steps, joints)."""
    path_q, path_v = (np.frombuffer(a).reshape(-1, joints) for a in (q, v))
    terms = bodies.terms(path_q, path_v, ())
    values, by_q, by_v = _in_a_row(terms), [], []
    for change in _CHANGE * np.eye(joints):
        by_q.append(_in_a_row(bodies.terms(path_q + change, path_v, ())) - values)
        by_v.append(bodies.terms(path_q, path_v + change, ()).bias - terms.bias)
    slope_q, slope_v = (np.stack(c, axis=-1) / _CHANGE for c in (by_q, by_v))
    return values, slope_q, slope_v


def _in_a_row(terms: BodyTerms) -> Array:
    """Returns mass matrix, bias and added torques (n, k)."""
    M = terms.M.reshape(len(terms.M), -1)
    return np.concatenate([M, terms.bias, terms.added], axis=1)


def _product(A: Array, x: Array) -> Array:
    """Returns A x (sets, segments, k) of (segments, k, n) and (sets, segments, n)."""
    return np.moveaxis(A @ np.moveaxis(x, 0, -1), -1, 0)

"""Inverse dynamics of an arm, linear in its links' inertial parameters."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.tree import (
    JacobianWrtVariable,
    MultibodyForces,
    SpatialInertia,
    UnitInertia,
)
from scipy.linalg import qr

from sysid.models.arm_plant import ArmPlant

Array = NDArray[np.float64]

#: A link's inertial parameters: mass, first moment, inertia about Bo, in B.
INERTIAL = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
INERTIAL_UNITS = ("kg", *["kg m"] * 3, *["kg m^2"] * 6)

#: Where Ixx, Ixy, Ixz, Iyy, Iyz, Izz stand in a symmetric matrix, row by row.
_SYMMETRIC = ([0, 1, 2], [1, 3, 4], [2, 4, 5])
_EXCITATION = 200  # random states, to see which parameters matter
_RANK = 1e-8  # of the largest diagonal element


class ArmRegressor:
    """tau = Y(q, v, vd) pi for an arm of a URDF, by Drake's kinematics.

    tau are the joint torques that the motion takes, Drake's
    `CalcInverseDynamics(vd)` minus gravity's, and pi stacks INERTIAL over the
    links. Friction and rotors are not in it.

    Attributes:
        urdf: of the arm.
        gravity, given_inertia: see Args.
        links: names of the links that move, in the order of pi.
        inertia: nominal pi.
        prismatic: names of the joints that slide; others turn.
        last_link: where in pi the link is that is farthest from the base.
        moved_links: (joints, 10) where in pi the link is that each joint moves.

    Args:
        urdf: a path, or `package://`.
        joints: names of the actuated joints, in the order of q, v, vd and tau.
        gravity: (3,) in the base's frame [m/s^2]; None for an arm that stands upright.
        inertia: pi of physical bodies; None for the URDF's.
    """

    def __init__(
        self,
        urdf: str,
        joints: Sequence[str],
        gravity: Sequence[float] | None = None,
        inertia: Array | None = None,
    ) -> None:
        self.urdf, self.gravity, self.given_inertia = urdf, gravity, inertia
        arm = ArmPlant.of(urdf, joints, gravity)
        self._plant, self._columns = arm.plant, arm.columns
        self._bodies = arm.bodies
        self._context = arm.plant.CreateDefaultContext()
        self.prismatic = arm.prismatic(joints)
        self.links = tuple(body.name() for body in self._bodies)
        if inertia is not None:
            parts = np.split(inertia, len(self._bodies))
            for body, own in zip(self._bodies, parts, strict=True):
                body.SetSpatialInertiaInBodyFrame(self._context, _spatial(own))
        self.inertia = np.concatenate(
            [
                _inertial(body.CalcSpatialInertiaInBodyFrame(self._context))
                for body in self._bodies
            ]
        )
        last = len(INERTIAL) * arm.last_body
        self.last_link = slice(last, last + len(INERTIAL))
        own = len(INERTIAL) * np.array(arm.moved(joints))
        self.moved_links = own[:, None] + np.arange(len(INERTIAL))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of pi's elements."""
        return tuple(f"{link}.{name}" for link in self.links for name in INERTIAL)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of pi's elements."""
        return INERTIAL_UNITS * len(self.links)

    def regressor(self, q: Array, v: Array, vd: Array) -> Array:
        """Returns Y (n, joints, parameters) of states (n, joints)."""
        return self._regressor(self._links(q, v, vd))

    def with_tilt(self, q: Array, v: Array, vd: Array) -> tuple[Array, Array]:
        """Returns Y, and dY (n, joints, parameters, 2) by a tilt [rx, ry] of the base.

        By the gravity that the base then sees, which is linear in Y: turned by w, it
        sees g - w x g.
        """
        links = self._links(q, v, vd)
        changes = -np.cross(np.eye(3)[:2], self._plant.gravity_field().gravity_vector())
        parts = []
        for dg in changes:
            blocks = []
            for k in links:
                rest = np.zeros_like(k.w)
                blocks.append(k.to_joints(body_regressor(rest, rest, -dg @ k.R_WB)))
            parts.append(self._stacked(blocks))
        return self._regressor(links), np.stack(parts, axis=-1)

    def _regressor(self, links: "Sequence[_LinkMotion]") -> Array:
        return self._stacked(
            [k.to_joints(body_regressor(k.w, k.alpha, k.a)) for k in links]
        )

    def torques(self, q: Array, v: Array, vd: Array) -> Array:
        """Returns the torques (n, joints) by the URDF of states (n, joints).

        The regressor's, but many times faster.
        """
        plant, context = self._plant, self._context
        no_forces = MultibodyForces(plant)
        found = np.empty_like(q)
        for i, state in enumerate(zip(q, v, vd, strict=True)):
            vdot = self._set_state(*state)
            tau = plant.CalcInverseDynamics(context, vdot, no_forces)
            tau -= plant.CalcGravityGeneralizedForces(context)
            found[i] = tau[self._columns]
        return found

    def random_regressor(self, at_rest: bool = False) -> Array:
        """Returns Y of random states: it excites all that motion, or rest, can reveal.

        Args:
            at_rest: whether nothing moves.
        """
        generator = np.random.default_rng(0)
        size = (_EXCITATION, len(self._columns))
        low, high = -np.ones(size), np.ones(size)
        reach = (3.0, 0.0, 0.0) if at_rest else (3.0, 2.0, 5.0)
        states = [generator.uniform(k * low, k * high) for k in reach]
        return self.regressor(*states)

    def _stacked(self, blocks: Sequence[Array]) -> Array:
        """Returns links' blocks (n, velocities, 10) as Y (n, joints, parameters)."""
        return np.concatenate(blocks, axis=-1)[:, self._columns]

    def _links(self, q: Array, v: Array, vd: Array) -> "list[_LinkMotion]":
        """Returns how each link moves in states (n, joints)."""
        velocities = self._plant.num_velocities()
        found = [_LinkMotion.empty(len(q), velocities) for _ in self._bodies]
        for row, state in enumerate(zip(q, v, vd, strict=True)):
            self._put(found, row, *state)
        return found

    def _put(
        self, links: "list[_LinkMotion]", row: int, q: Array, v: Array, vd: Array
    ) -> None:
        """Puts into a row of links' motions what they are in one state (joints,)."""
        plant, context = self._plant, self._context
        vdot = self._set_state(q, v, vd)
        A_W = plant.CalcSpatialAccelerationsFromVdot(context, vdot)
        g_W = plant.gravity_field().gravity_vector()
        zero, world = np.zeros(3), plant.world_frame()
        for link, body in zip(links, self._bodies, strict=True):
            R_WB = plant.EvalBodyPoseInWorld(context, body).rotation().matrix()
            w_W = plant.EvalBodySpatialVelocityInWorld(context, body).rotational()
            A_WB, frame = A_W[int(body.index())], body.body_frame()
            link.J[row] = plant.CalcJacobianSpatialVelocity(
                context, JacobianWrtVariable.kV, frame, zero, world, frame
            )
            link.R_WB[row] = R_WB
            link.w[row] = w_W @ R_WB
            link.alpha[row] = A_WB.rotational() @ R_WB
            link.a[row] = (A_WB.translational() - g_W) @ R_WB

    def _set_state(self, q: Array, v: Array, vd: Array) -> Array:
        """Sets one state (joints,), and returns all the plant's accelerations."""
        full = np.zeros((3, self._plant.num_velocities()))
        full[:, self._columns] = q, v, vd
        self._plant.SetPositions(self._context, full[0])
        self._plant.SetVelocities(self._context, full[1])
        return np.asarray(full[2])


@dataclass(frozen=True)
class _LinkMotion:
    """How a link moves, in many states.

    Attributes:
        J: (n, 6, velocities) its Jacobian [w; v] at Bo, in B.
        R_WB: (n, 3, 3) its orientation.
        w, alpha: (n, 3) angular velocity and acceleration, in B.
        a: (n, 3) acceleration of Bo minus gravity, in B.
    """

    J: Array
    R_WB: Array
    w: Array
    alpha: Array
    a: Array

    @classmethod
    def empty(cls, count: int, velocities: int) -> Self:
        """Returns room for `count` states of an arm with so many velocities."""
        shapes = (6, velocities), (3, 3), (3,), (3,), (3,)
        return cls(*(np.empty((count, *shape)) for shape in shapes))

    def to_joints(self, of_body: Array) -> Array:
        """Returns a regressor (n, 6, 10) of [tau; f] as (n, velocities, 10)."""
        return np.swapaxes(self.J, -1, -2) @ of_body


def body_regressor(w: Array, alpha: Array, a: Array) -> Array:
    """Returns Y (..., 6, 10) with [tau; f] = Y [m, mx, my, mz, Ixx, ..., Izz].

    Newton's and Euler's equations of a rigid body about its frame's origin Bo:
    f = m a + alpha x c + w x (w x c), tau = c x a + I alpha + w x I w, with c = m
    p_BoBcm.

    Args:
        w, alpha: (..., 3) angular velocity and acceleration, in B.
        a: (..., 3) acceleration of Bo minus gravity, in B.
    """
    W = _skew(w)
    L = _inertia_times(alpha) + W @ _inertia_times(w)
    Y = np.zeros((*a.shape[:-1], 6, 10))
    Y[..., 3:, 0] = a
    Y[..., 3:, 1:4] = _skew(alpha) + W @ W
    Y[..., :3, 1:4] = -_skew(a)
    Y[..., :3, 4:] = L
    return Y


@dataclass(frozen=True)
class BaseSet:
    """The combinations of inertial parameters that joint torques can reveal.

    beta = pi[independent] + K pi[dependent], and tau = Y[:, independent] beta.

    Attributes:
        independent, dependent: indices into pi; those without any effect are in
            neither.
        K: how the dependent ones add to the independent.
    """

    independent: NDArray[np.int64]
    dependent: NDArray[np.int64]
    K: Array

    def beta(self, pi: Array) -> Array:
        """Returns the base parameters of inertial parameters."""
        return pi[self.independent] + self.K @ pi[self.dependent]

    def matrix(self, size: int) -> Array:
        """Returns B (b, size) with beta = B pi, of `size` inertial parameters."""
        B = np.zeros((len(self.independent), size))
        B[np.arange(len(self.independent)), self.independent] = 1.0
        B[:, self.dependent] = self.K
        return B

    def label(self, number: int, names: Sequence[str]) -> str:
        """Returns what a base parameter is a sum of."""
        parts = [names[self.independent[number]]]
        for k, j in zip(self.K[number], self.dependent, strict=True):
            if abs(k) > 1e-6:
                parts.append(f"{k:+.4g} {names[j]}")
        return " ".join(parts)


def base_set(Y: Array) -> BaseSet:
    """Returns the base set by QR with pivoting of a regressor (n, joints, k).

    Gautier's method: columns without effect are left out, and of those that depend
    on each other the QR keeps a well-conditioned few.
    """
    flat = Y.reshape(-1, Y.shape[-1])
    used = np.flatnonzero(np.linalg.norm(flat, axis=0) > _RANK * np.linalg.norm(flat))
    R, order = qr(flat[:, used], mode="r", pivoting=True)
    diagonal = np.abs(np.diagonal(R))
    rank = int(np.sum(diagonal > _RANK * diagonal[0]))
    K = np.linalg.solve(R[:rank, :rank], R[:rank, rank:])
    K[np.abs(K) < 1e-9] = 0.0
    return BaseSet(used[order[:rank]], used[order[rank:]], np.array(K, dtype=float))


def _inertial(M_B: SpatialInertia) -> Array:
    """Returns INERTIAL (10,) of a spatial inertia about Bo in B."""
    mass = M_B.get_mass()
    inertia = M_B.CalcRotationalInertia().CopyToFullMatrix3()
    upper = inertia[np.triu_indices(3)]
    return np.concatenate([[mass], mass * M_B.get_com(), upper])


def _spatial(inertial: Array) -> SpatialInertia:
    """Returns the spatial inertia about Bo in B of INERTIAL (10,); the inverse."""
    mass, first, rest = inertial[0], inertial[1:4], inertial[4:] / inertial[0]
    Gxx, Gxy, Gxz, Gyy, Gyz, Gzz = rest
    return SpatialInertia(mass, first / mass, UnitInertia(Gxx, Gyy, Gzz, Gxy, Gxz, Gyz))


def _skew(a: Array) -> Array:
    """Returns [a]x (..., 3, 3) with [a]x b = a x b."""
    return np.cross(a[..., None, :], np.eye(3)).swapaxes(-1, -2)


def _inertia_times(w: Array) -> Array:
    """Returns L (..., 3, 6) with I w = L [Ixx, Ixy, Ixz, Iyy, Iyz, Izz]."""
    L = np.zeros((*w.shape[:-1], 3, 6))
    for row, columns in enumerate(_SYMMETRIC):
        L[..., row, columns] = w
    return L

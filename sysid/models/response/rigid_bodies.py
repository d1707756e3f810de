"""Mass matrix and bias of an arm, by Drake, in many states."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    JacobianWrtVariable,
    RigidBody,
    SpatialInertia,
    UnitInertia,
    WeldJoint,
)

from drake_disasm.effects import ArmEffect, ArmTilt, FlangePayload
from sysid.models.arm_plant import ArmPlant
from sysid.models.base import Array


@dataclass(frozen=True)
class RigidBodyTerms:
    """Of states (n, joints): load = M vd + bias.

    Attributes:
        M: (n, joints, joints) mass matrix.
        bias: (n, joints) Coriolis and centrifugal torques minus gravity's.
    """

    M: Array
    bias: Array

    def load(self, vd: Array) -> Array:
        """Returns the torques (..., n, joints) that accelerations so many take."""
        return np.asarray((self.M @ vd[..., None])[..., 0] + self.bias)


class RigidBodies:
    """An arm of a URDF, with what hangs on it and how its base stands.

    Args:
        urdf: a path, or `package://`.
        joints: names of the actuated joints; others rest where they are.
    """

    def __init__(self, urdf: str, joints: Sequence[str]) -> None:
        self._arm = arm = ArmPlant.of(urdf, joints)
        self._context = arm.plant.CreateDefaultContext()
        self._columns = np.array(arm.columns)
        self._link, self._X_LF = _carrier(arm.plant, arm.bodies[arm.last_body])
        self._nominal = self._link.default_spatial_inertia()
        gravity = arm.plant.gravity_field().gravity_vector()
        self._g = float(np.linalg.norm(gravity))

    def terms(self, q: Array, v: Array, effects: Sequence[ArmEffect]) -> RigidBodyTerms:
        """Returns what the torques of states (n, joints) are made of.

        Args:
            q, v: (n, joints).
            effects: on the arm; payloads and tilts of its base count.
        """
        plant, context = self._arm.plant, self._context
        self._set_payload([e for e in effects if isinstance(e, FlangePayload)])
        tilts = [e for e in effects if isinstance(e, ArmTilt) and not e.is_null]
        M, forces = [], []
        for state in self._states(q, v):
            plant.SetPositionsAndVelocities(context, state)
            force = plant.CalcGravityGeneralizedForces(context)
            for tilt in tilts:
                force = force + self._pull_by_tilt(tilt)
            M.append(plant.CalcMassMatrix(context))
            forces.append(plant.CalcBiasTerm(context) - force)
        columns = self._columns
        chosen = np.array(M)[:, columns[:, None], columns]
        return RigidBodyTerms(chosen, np.array(forces)[:, columns])

    def holding(self, q: Array) -> Array:
        """Returns torques (n, joints) that hold the arm at rest, by the URDF alone."""
        plant, found = self._arm.plant, []
        self._set_payload([])
        for state in self._states(q, np.zeros_like(q)):
            plant.SetPositionsAndVelocities(self._context, state)
            found.append(-plant.CalcGravityGeneralizedForces(self._context))
        return np.array(found)[:, self._columns]

    def _states(self, q: Array, v: Array) -> Array:
        """Returns the plant's states (n, 2 velocities) of the joints' (n, joints).

        A motion that has failed is NaN, for which Drake would end all others: it is
        zero here.
        """
        count = self._arm.plant.num_velocities()
        states = np.zeros((len(q), 2 * count))
        states[:, self._columns] = np.nan_to_num(q)
        states[:, self._columns + count] = np.nan_to_num(v)
        return states

    def _set_payload(self, payloads: Sequence[FlangePayload]) -> None:
        """Sets what the link that carries the flange weighs, with payloads on that."""
        if not payloads:
            self._link.SetSpatialInertiaInBodyFrame(self._context, self._nominal)
            return
        M_L = self._nominal
        pi = _seen_from(self._X_LF, np.sum([p.inertial for p in payloads], axis=0))
        mass = M_L.get_mass() + pi[0]
        moment = M_L.get_mass() * M_L.get_com() + pi[1:4]
        upper = M_L.CalcRotationalInertia().CopyToFullMatrix3()[np.triu_indices(3)]
        xx, xy, xz, yy, yz, zz = (upper + pi[4:]) / mass
        unit = UnitInertia(xx, yy, zz, xy, xz, yz)
        loaded = SpatialInertia(mass, moment / mass, unit, skip_validity_check=True)
        self._link.SetSpatialInertiaInBodyFrame(self._context, loaded)

    def _pull_by_tilt(self, tilt: ArmTilt) -> Array:
        """Returns generalised forces of what a tilt of the base adds to gravity."""
        plant, world = self._arm.plant, self._arm.plant.world_frame()
        J = plant.CalcJacobianCenterOfMassTranslationalVelocity(
            self._context, JacobianWrtVariable.kV, world, world
        )
        dg = self._g * np.array([tilt.ry, -tilt.rx, 0.0])
        return np.asarray(plant.CalcTotalMass(self._context) * (J.T @ dg))


def _carrier(
    plant: MultibodyPlant, flange: RigidBody
) -> tuple[RigidBody, RigidTransform]:
    """Returns the link that a flange is welded to and that has mass, and X_LF.

    Most URDFs end in frames that weigh nothing, whose inertia no payload adds to. The
    flange itself, if it moves by itself or nothing in the chain has mass.
    """
    welds = {
        int(joint.child_body().index()): joint.parent_body()
        for joint in (plant.get_joint(i) for i in plant.GetJointIndices())
        if joint.type_name() == WeldJoint.kTypeName
    }
    link = flange
    while not link.default_mass() and int(link.index()) in welds:
        link = welds[int(link.index())]
    if not link.default_mass():
        return flange, RigidTransform()
    frames = link.body_frame(), flange.body_frame()
    return link, plant.CalcRelativeTransform(plant.CreateDefaultContext(), *frames)


def _seen_from(X_LF: RigidTransform, pi_F: Array) -> Array:
    """Returns inertial parameters (10,) about and in F as about and in L.

    Of [m, m c, Ixx, Ixy, Ixz, Iyy, Iyz, Izz], linear in them, also without a mass
    (Khalil and Dombre 2002).
    """
    R, p = X_LF.rotation().matrix(), X_LF.translation()
    m, c = pi_F[0], R @ pi_F[1:4]
    I_F = np.zeros((3, 3))
    I_F[np.triu_indices(3)] = pi_F[4:]
    I_F = I_F + np.triu(I_F, 1).T
    turned = R @ I_F @ R.T
    twice = np.outer(p, c) + np.outer(c, p) + m * np.outer(p, p)
    moved = turned + np.trace(twice) * np.eye(3) - twice
    return np.concatenate([[m], c + m * p, moved[np.triu_indices(3)]])

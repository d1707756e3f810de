"""The twin's carrier: six joints with the spring and damper of each axis."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    Frame,
    Joint,
    JointActuator,
    PdControllerGains,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SpatialInertia,
)
from pydrake.systems.framework import Context

from drake_disasm.scenario import TwinConfig

_AXES = np.eye(3)
_JOINT_ORDER = (0, 1, 2, 5, 4, 3)  # x, y, z, then yaw, pitch, roll


class Carrier:
    """Joints x, y, z, yaw, pitch and roll from Gn, and what controls them.

    Stiffness and damping are the gains of Drake's implicit PD controllers; what arm,
    gripper and sensor weigh is the inertia of the joints' rotors.

    Attributes:
        body: that the joints move.
        instance: model instance of joints and bodies.

    Args:
        plant: not yet finalized.
        frame_Gn: the groove's nominal frame.
        twin: springs, dampers and inertia.
    """

    def __init__(
        self, plant: MultibodyPlant, frame_Gn: Frame, twin: TwinConfig
    ) -> None:
        self._plant, self._actuators = plant, dict[int, JointActuator]()
        self.instance = plant.AddModelInstance("carrier")
        parent = frame_Gn
        for axis in _JOINT_ORDER:
            self.body = self._add_axis(axis, parent, twin)
            parent = self.body.body_frame()

    def _add_axis(self, axis: int, parent: Frame, twin: TwinConfig) -> RigidBody:
        plant, name = self._plant, f"axis_{axis}"
        body = plant.AddRigidBody(name, self.instance, SpatialInertia.Zero())
        joint = plant.AddJoint(_axis_joint(axis, parent, body.body_frame()))
        actuator = plant.AddJointActuator(name, joint)
        actuator.set_default_rotor_inertia(_inertia(twin, axis))
        actuator.set_default_gear_ratio(1.0)
        actuator.set_controller_gains(_gains(twin, axis))
        self._actuators[axis] = actuator
        return body

    def set_springs(self, twin: TwinConfig, plant_context: Context) -> None:
        """Gives the joints other springs, dampers and inertia.

        Springs and dampers belong to the plant, not to the Context.
        """
        for axis, actuator in self._actuators.items():
            actuator.SetRotorInertia(plant_context, _inertia(twin, axis))
            actuator.set_controller_gains(_gains(twin, axis))

    def gains(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns stiffness (6,) [N/m, N m/rad] and damping (6,) [N s/m, N m s/rad].

        In the order of the joints.
        """
        gains = [self._actuators[axis].get_controller_gains() for axis in _JOINT_ORDER]
        return np.array([gain.p for gain in gains]), np.array([g.d for g in gains])

    def mass_matrix(self, plant_context: Context) -> np.ndarray:
        """Returns the joints' mass matrix (6, 6) at their zero."""
        at_zero = self._plant.CreateDefaultContext()
        self._plant.SetPositions(at_zero, np.zeros(self._plant.num_positions()))
        for actuator in self._actuators.values():
            inertia = actuator.rotor_inertia(plant_context)
            actuator.SetRotorInertia(at_zero, inertia)
        return self._plant.CalcMassMatrix(at_zero)


def _axis_joint(axis: int, parent: Frame, child: Frame) -> Joint:
    kind = PrismaticJoint if axis < 3 else RevoluteJoint
    return kind(f"axis_{axis}", parent, child, _AXES[axis % 3])


def _inertia(twin: TwinConfig, axis: int) -> float:
    """Returns what an axis moves in addition to the bolt [kg or kg m^2]."""
    return twin.mass if axis < 3 else twin.inertia


def _gains(twin: TwinConfig, axis: int) -> PdControllerGains:
    k = twin.stiffness[axis]
    d = 2.0 * twin.damping_ratio * np.sqrt(k * _inertia(twin, axis))
    return PdControllerGains(p=k, d=d)

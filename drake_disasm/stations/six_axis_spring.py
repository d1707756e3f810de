"""Six joints with the spring and damper of each axis, between two bodies."""

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

from drake_disasm.cell.grip import AXIS_ORDER, Springs

_AXES = np.eye(3)


class SixAxisSpring:
    """Joints along x, y, z and about z, x, y from a frame, with a spring in each.

    Stiffness and damping are the gains of Drake's PD controllers, which the discrete
    solver takes implicitly.

    Attributes:
        last: massless body that the joints move; weld to it what is carried.
        instance: model instance of joints and bodies.

    Args:
        plant: not yet finalized.
        name: of the model instance.
        parent: frame whose axes the springs have.
        springs: stiffness and damping of each.
    """

    def __init__(
        self, plant: MultibodyPlant, name: str, parent: Frame, springs: Springs
    ) -> None:
        self._plant, self._actuators = plant, dict[int, JointActuator]()
        self.instance = plant.AddModelInstance(name)
        for axis in AXIS_ORDER:
            joint, self.last = _add_axis(plant, self.instance, axis, parent)
            self._actuators[axis] = plant.AddJointActuator(f"axis_{axis}", joint)
            parent = self.last.body_frame()
        self.set_springs(springs)

    def set_springs(self, springs: Springs) -> None:
        """Gives the joints other springs; they belong to the plant, not a Context."""
        for axis, actuator in self._actuators.items():
            gains = PdControllerGains(
                p=springs.stiffness[axis], d=springs.damping[axis]
            )
            actuator.set_controller_gains(gains)

    def mass_matrix(self) -> np.ndarray:
        """Returns the joints' mass matrix (6, 6) at their zero, in a plant of its own.

        That is a plant whose other bodies do not move.
        """
        return self._plant.CalcMassMatrix(self._plant.CreateDefaultContext())

    def gains(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns stiffness (6,) [N/m, N m/rad] and damping (6,) [N s/m, N m s/rad].

        In the order of the joints.
        """
        gains = [self._actuators[axis].get_controller_gains() for axis in AXIS_ORDER]
        return np.array([gain.p for gain in gains]), np.array([g.d for g in gains])


def _add_axis(
    plant: MultibodyPlant, instance: int, axis: int, parent: Frame
) -> tuple[Joint, RigidBody]:
    name = f"axis_{axis}"
    body = plant.AddRigidBody(name, instance, SpatialInertia.Zero())
    kind = PrismaticJoint if axis < 3 else RevoluteJoint
    joint = kind(name, parent, body.body_frame(), _AXES[axis % 3])
    return plant.AddJoint(joint), body

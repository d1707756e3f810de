"""What the hardware may do: limits, each with what it is there for."""

import dataclasses

import numpy as np

from drake_disasm.common.quantity import quantity


@dataclasses.dataclass
class SafetyConfig:
    """Limits of the safety filter.

    The gripper takes 25 N in any direction, 5 N m about x and y and 3 N m about z
    (Robotiq's manual of the 2F-140); limits stay below that.
    """

    max_force: float = quantity(20.0, "N", "on the gripper", low=1.0, high=25.0)
    max_torque_xy: float = quantity(
        4.0, "N m", "on the gripper about its x and y", low=0.1, high=5.0
    )
    max_torque_z: float = quantity(
        2.4, "N m", "on the gripper about its z", low=0.1, high=3.0
    )
    on_force: str = quantity(
        "hold", "", "what a hold for too much force does: hold where the arm was "
        "measured, which keeps pressing, or yield: back away along the force",
        choices=("hold", "yield"),
    )  # fmt: skip
    retreat: float = quantity(
        0.002, "m", "that on_force: yield may back away", low=1e-4, high=0.01
    )
    retreat_speed: float = quantity(
        0.01, "m/s", "at which it backs away", low=1e-3, high=0.05
    )
    joint_margin: float = quantity(
        0.035, "rad", "kept from each joint's limit", low=0.0, high=0.5
    )
    velocity_share: float = quantity(
        0.25, "1", "of each joint's greatest velocity", low=0.001, high=1.0
    )
    workspace_low: list[float] = quantity(
        [-0.012, -0.010, -0.010], "m", "of the bolt in G, from the start",
        low=-0.5, high=0.0,
    )  # fmt: skip
    workspace_high: list[float] = quantity(
        [0.080, 0.030, 0.010], "m", "of the bolt in G, from the start",
        low=0.0, high=0.5,
    )  # fmt: skip
    workspace_margin: float = quantity(
        0.002, "m", "kept from the workspace's sides", low=0.0, high=0.05
    )
    max_lead: float = quantity(
        0.02, "rad", "of a joint's command before what is measured, besides what the "
        "arm's control yields to the greatest force and torque", low=1e-3, high=0.5,
    )  # fmt: skip
    max_jump: float = quantity(
        0.05, "rad", "of a measured joint between two looks", low=1e-3, high=0.5
    )
    start_tolerance: float = quantity(
        0.005, "rad", "between command and measurement when motion begins",
        low=1e-5, high=0.1,
    )  # fmt: skip
    stale_arm: float = quantity(
        0.05, "s", "age of the arm's status", low=0.005, high=1.0
    )
    stale_sensor: float = quantity(
        0.05, "s", "age of the sensor's reading", low=0.005, high=1.0
    )
    stale_gripper: float = quantity(
        0.5, "s", "age of the gripper's status", low=0.05, high=5.0
    )
    late_command: float = quantity(
        0.25, "s", "between two commands: a policy that thinks too long",
        low=0.01, high=5.0,
    )  # fmt: skip
    lag_window: float = quantity(
        2.0, "s", "over which lost time is added up", low=0.1, high=60.0
    )
    max_lag: float = quantity(
        0.8, "s", "lost within the window: a diagram that is late by habit",
        low=0.01, high=60.0,
    )  # fmt: skip

    def allowed_lead(self, yielding: np.ndarray) -> np.ndarray:
        """Returns how far each joint's command may be before what is measured [rad].

        Whatever holds the arm back, and lets it go, finds it pulled by a spring that
        pushes the bolt with no more than what the gripper may be loaded with.

        Args:
            yielding: (7, 6) of the joints to a load on the bolt, see
                `drake_disasm.cell.arm_control.yielding`.
        """
        torque = np.hypot(self.max_torque_xy, self.max_torque_z)
        by_force = self.max_force * np.linalg.norm(yielding[:, :3], axis=1)
        by_torque = torque * np.linalg.norm(yielding[:, 3:], axis=1)
        return np.asarray(self.max_lead + by_force + by_torque)

    def stale_after(self, device: str) -> float:
        """Returns the age [s] at which a device's sample is stale."""
        return {
            "iiwa": self.stale_arm,
            "ft_sensor": self.stale_sensor,
            "gripper": self.stale_gripper,
        }[device]

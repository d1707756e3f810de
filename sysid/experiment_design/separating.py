"""The motion that is designed to tell two effects of an arm apart, as an experiment."""

import dataclasses

import numpy as np

from drake_disasm.common.quantity import quantity
from drake_disasm.experiments import JointExperiment
from drake_disasm.free_motion.arm_space import ArmSpace
from drake_disasm.free_motion.rest_to_rest import PERIOD, straight
from drake_disasm.free_motion.table import MotionTable
from sysid.experiment_design.design import DesignSettings, design_motion
from sysid.experiment_design.information import ArmExperiment

_NOISE = 0.01  # of each joint's greatest torque
_ITERATIONS = 5


@dataclasses.dataclass(frozen=True)
class SeparatingMotion(JointExperiment):
    """The motion of `drake-disasm excite --separate`, from home and back."""

    one: str = quantity("", "", "effect that it is to tell")
    other: str = quantity("", "", "from this one")
    urdf: str = quantity("", "", "of the arm")
    duration: float = quantity(10.0, "s", "of the motion", low=2.0, high=120.0)

    @property
    def text(self) -> str:
        """See AnyExperiment."""
        return f"SeparatingMotion({self.one}, {self.other})"

    def motion(self, space: ArmSpace) -> MotionTable:
        """See JointExperiment; this one looks for collisions itself.

        Raises:
            DisasmError: an effect is none that an arm's torques show.
        """
        limits, pair = space.limits, (self.one, self.other)
        noise = _NOISE * limits.effort
        experiment = ArmExperiment(
            self.urdf, limits.names, [], noise, self.duration, pair
        )
        settings = DesignSettings(
            duration=self.duration,
            rate=1.0 / PERIOD,
            clearance=space.clearance,
            floor=space.floor,
            iterations=_ITERATIONS,
        )
        found = design_motion(experiment, limits, space.collisions, settings).motion
        time = np.linspace(0.0, self.duration, round(self.duration / PERIOD) + 1)
        q, home = found.states(time)[0], space.home
        there, back = straight(limits, home, q[0]), straight(limits, q[-1], home)
        whole = np.concatenate([there, q, back])
        return MotionTable(PERIOD * np.arange(len(whole)), whole)

"""Simulated arms that play motions, each with something that its model may lack."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from drake_disasm.common.progress import Progress
from drake_disasm.effects import ArmEffect
from drake_disasm.free_motion.arm_limits import CollisionFreeSpace, JointLimits
from drake_disasm.free_motion.arm_space import ArmSpace
from drake_disasm.free_motion.table import MotionTable
from drake_disasm.logs import LogHeader
from drake_disasm.stations.hardware import HoldError
from sysid.models.arm_motion import ArmMotion
from sysid.models.regressor import ArmRegressor, base_set
from sysid.models.response.drive import Drive, Inputs
from sysid.models.response.near_motion import Bodies
from sysid.models.response.rigid_bodies import RigidBodies
from sysid.models.response.segments import Segment
from sysid.models.response.simulation import Arm as SimulatedArm
from sysid.models.response.simulation import ParameterSet, simulate
from tests.sysid.models.response.servo import write_pendulum

JOINT = "servo"
PERIOD = 0.005
_STIFFNESS, _DAMPING, _DELAY, _NOISE = 30.0, 0.5, 0.012, 1e-5


class Pendulum:
    """A pendulum on a servo: plays motions, and measures torques and positions.

    Args:
        folder: of its URDF.
        effects: at its joint.
        is_stiff: whether it does exactly what it is told.
        holds_at: motion, counted from 0, in the middle of which it is held.
    """

    def __init__(
        self,
        folder: Path,
        *effects: ArmEffect,
        is_stiff: bool = True,
        holds_at: int = -1,
    ) -> None:
        self.urdf = str(write_pendulum(folder / "pendulum.urdf"))
        self._effects, self._holds_at, self.played = effects, holds_at, 0
        self._is_held, self._is_stiff = False, is_stiff
        limits = JointLimits((JOINT,), *np.array([[-2.5], [2.5], [4.0], [10.0], [5.0]]))
        collisions = CollisionFreeSpace(self.urdf, (JOINT,), limits)
        self.space = ArmSpace.of(limits, collisions)

    def header(self) -> LogHeader:
        """Of recordings."""
        joints, drive = (JOINT,), {"gravity_compensation": True}
        return LogHeader(
            "joint_response",
            "swing",
            {},
            period=PERIOD,
            joints=joints,
            urdf=self.urdf,
            drive=drive,
        )

    def play(
        self, motion: MotionTable, _: Progress
    ) -> tuple[Mapping[str, np.ndarray], float]:
        """See Arm."""
        self.check()
        time = PERIOD * np.arange(int(motion.time[-1] / PERIOD) + 1)
        if self.played == self._holds_at:
            time, self._is_held = time[: len(time) // 2], True
        self.played += 1
        goal = CubicSpline(motion.time, motion.q, bc_type="clamped")
        random = np.random.default_rng(self.played)
        commanded = goal(time)
        q = commanded
        if not self._is_stiff:
            q = self._response(time, commanded, goal(time, 1))
        noisy = q + _NOISE * random.standard_normal(q.shape)
        tau = self._torque(time, q) + 0.005 * random.standard_normal(q.shape)
        columns = {"time": time, "q_commanded": commanded, "q": noisy, "tau": tau}
        return columns, float(time[-1])

    def check(self) -> None:
        """See Arm."""
        if self._is_held:
            raise HoldError("the robot is held: somebody pressed the button")

    def resume(self) -> None:
        """Ends the hold."""
        self._is_held = False

    def _response(self, time: np.ndarray, goal: np.ndarray, v: np.ndarray):
        arm = SimulatedArm((JOINT,), Bodies(RigidBodies(self.urdf, (JOINT,)), True))
        drive = Drive(np.array([_STIFFNESS]), np.array([_DAMPING]), np.inf)
        one = np.ones_like(goal)
        inputs = Inputs(goal, v, one, one, one)
        begin = Segment(0.0, goal[0], np.zeros(1), time, inputs, np.zeros(1))
        parameters = ParameterSet(drive, _DELAY, self._effects)
        found = simulate(arm, [parameters], [begin], 5 * (len(time) - 1), PERIOD / 5)
        return found.q[::5, 0, 0]

    def _torque(self, time: np.ndarray, q: np.ndarray) -> np.ndarray:
        line = CubicSpline(time, q)
        episode = {"time": time, "q": q, "v": line(time, 1), "vd": line(time, 2)}
        arm = ArmRegressor(self.urdf, (JOINT,))
        base = base_set(arm.random_regressor())
        motion = ArmMotion.of(arm, base, (JOINT,), [episode])
        return motion.torques(base.beta(arm.inertia), list(self._effects))

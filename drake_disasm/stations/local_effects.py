"""A simulator monitor that updates effects which depend on the bolt's motion."""

from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import Context, EventStatus

from drake_disasm.common.timing import MOTION_DELAY
from drake_disasm.effects import BoltMotion, is_local
from drake_disasm.stations.base import Station

Monitor = Callable[[Context], EventStatus | None]

_ROUNDING = 1e-9  # s


class LocalEffectsMonitor:
    """Updates a station's motion-dependent effects once per task period.

    A monitor, since an event of a LeafSystem can't change the scene graph's proximity
    properties. In each period the commanded velocity is estimated over the first
    control period after the policy has acted, and the bolt's true pose is read then.
    At the start of a simulation, or after its time was reset, the velocity is zero.

    Args:
        station: whose effects are updated.
        before: the simulator's previous monitor, called first; or None.
    """

    def __init__(self, station: Station, before: Monitor | None) -> None:
        self._station, self._before = station, before
        self._last, self._period = np.inf, 0
        self._command: tuple[float, np.ndarray] | None = None

    def __call__(self, root: Context) -> EventStatus | None:
        """Called by the simulator after each of its steps."""
        status = self._before(root) if self._before else None
        context = self._station.GetMyMutableContextFromRoot(root)
        if is_local(self._station.effects_in_force(context)):
            self._follow(context, root.get_time())
        return status

    def _follow(self, context: Context, time: float) -> None:
        if time < self._last:
            self._begin(context, time)
        elif time > self._period * self._task_period + MOTION_DELAY + _ROUNDING:
            self._measure(context, time)
        self._last = time

    @property
    def _task_period(self) -> float:
        return self._station.scenario.task.period

    def _begin(self, context: Context, time: float) -> None:
        self._command = None
        self._period = int(np.ceil(time / self._task_period - _ROUNDING))
        self._update(context, np.zeros(3), time)

    def _measure(self, context: Context, time: float) -> None:
        """Samples the command twice, a control period apart, then updates."""
        p_GnB = self._commanded_position(context)
        if self._command is None:
            self._command = time, p_GnB
            return
        since, earlier = self._command
        if time - since >= self._station.control_period - _ROUNDING:
            steps = int(np.floor(time / self._task_period + _ROUNDING))
            v_GnB = (p_GnB - earlier) / (time - since)
            self._update(context, v_GnB, steps * self._task_period)
            self._command = None
            self._period = steps + 1

    def _commanded_position(self, context: Context) -> np.ndarray:
        """Returns where the bolt is commanded to be (3,) in Gn [m]."""
        station = self._station
        command = station.GetInputPort(f"{station.arm}.position").Eval(context)
        return station.coordinates.pose(command).translation()

    def _update(self, context: Context, v_GnB: np.ndarray, time: float) -> None:
        station = self._station
        X_GnB = station.GetOutputPort("bolt_pose").Eval(context)
        motion = BoltMotion(X_GnB.translation(), v_GnB, time)
        effects = station.effects_in_force(context)
        station.update_local_effects(context, effects, motion)

"""The diagram that plays motions of the joints on the cell, and records them."""

from collections.abc import Callable

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import (
    ConstantVectorSource,
    TrajectorySource,
    VectorLogSink,
)
from pydrake.trajectories import PiecewisePolynomial

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from drake_disasm.free_motion.table import MotionTable
from drake_disasm.free_motion.way import with_straight_way, with_way
from drake_disasm.stations import Station
from drake_disasm.stations.advance import advance

#: Columns of a log of kind `joint_response`, and the arm's ports that they are from.
_QUANTITIES = {
    "q_commanded": "position_commanded",
    "q": "position_measured",
    "v": "velocity_estimated",
    "tau": "torque_measured",
}
_SLICE = 0.1  # s, between two updates of the progress


class MotionPlayer:
    """Plays motions on a station of the cell, simulated or real, one after the other.

    Attributes:
        station: that moves.
        simulator: of the whole diagram.
        begin: when the motion itself begins, after the way to it [s].
        end: when it has been played [s].
        period: of what is recorded, the arm's control period [s].

    Args:
        station: "cell" or "hardware", from `make_station`, its arm at the start of
            the task.
        motion: of its joints.
        add_view: adds to the diagram what shows the station, if anything does.

    Raises:
        DisasmError: the station has no arm, or it can't go to where the motion begins.
    """

    def __init__(
        self,
        station: Station,
        motion: MotionTable,
        add_view: Callable[[DiagramBuilder, Station], object] | None = None,
    ) -> None:
        if not station.joints:
            raise DisasmError("the twin has no arm to move; use `station` cell")
        self.station, self.period = station, station.control_period
        whole, self.begin = with_way(station, motion)
        self.end = float(whole.time[-1])
        self._has_begun, self._last = False, motion.q[-1]
        builder = DiagramBuilder()
        builder.AddSystem(station)
        self._source = builder.AddNamedSystem("motion", TrajectorySource(_path(whole)))
        command = station.GetInputPort(f"{station.arm}.position")
        builder.Connect(self._source.get_output_port(), command)
        assert station.grip_command is not None  # every arm here has a gripper
        grip = builder.AddNamedSystem(
            "grip", ConstantVectorSource([station.grip_command])
        )
        opening = station.GetInputPort("gripper.position")
        builder.Connect(grip.get_output_port(), opening)
        self._sinks = {}
        for name, quantity in _QUANTITIES.items():
            sink = builder.AddNamedSystem(
                f"log_{name}", VectorLogSink(len(station.start), self.period)
            )
            port = station.GetOutputPort(f"{station.arm}.{quantity}")
            builder.Connect(port, sink.get_input_port())
            self._sinks[name] = sink
        if add_view:
            add_view(builder, station)
        self.simulator = Simulator(builder.Build())
        self._context = self.simulator.get_mutable_context()

    def play(
        self, realtime_rate: float = 0.0, progress: Progress = ignore_progress
    ) -> None:
        """Goes to where the motion begins, and plays it, once.

        Args:
            realtime_rate: 1 for real time, 0 for full speed.
            progress: gets the seconds that are done; it may raise to stop the arm
                where it is.

        Raises:
            DisasmError: the station can't begin, or holds the robot.
            DivergedError: the arm has run into something, most likely.
        """
        station, simulator = self.station, self.simulator
        if not self._has_begun:
            station.begin(station.GetMyMutableContextFromRoot(self._context))
            station.attach(simulator)
            simulator.set_target_realtime_rate(realtime_rate)
            simulator.Initialize()
            self._has_begun = True
        begin = self._context.get_time()
        for i in range(1, int(np.ceil((self.end - begin) / _SLICE)) + 1):
            advance(simulator, min(begin + i * _SLICE, self.end), "cell")
            station.check()
            done = round(self._context.get_time() - begin)
            total = round(self.end - begin)
            progress(ProgressUpdate("playing the motion", done, total))

    def follow_with(self, motion: MotionTable) -> None:
        """Prepares another motion, after one that was played to its end.

        The arm goes straight from where it stands to where the motion begins.
        """
        now = self._context.get_time()
        whole, begin = with_straight_way(self._last, motion)
        self._last = motion.q[-1]
        self.begin, self.end = now + begin, now + float(whole.time[-1])
        self._source.UpdateTrajectory(_path(MotionTable(now + whole.time, whole.q)))

    def columns(self) -> dict[str, np.ndarray]:
        """Returns what was recorded of the last motion so far, by the log's columns.

        Time begins with the motion. Where `play` was stopped on the way to it, there
        are no rows.
        """
        logs = {name: sink.FindLog(self._context) for name, sink in self._sinks.items()}
        time = logs["q"].sample_times()
        kept = time >= self.begin - 0.5 * self.period
        columns = {name: log.data().T[kept] for name, log in logs.items()}
        return {"time": time[kept] - self.begin} | columns


def _path(motion: MotionTable) -> PiecewisePolynomial:
    return PiecewisePolynomial.CubicShapePreserving(
        motion.time, motion.q.T, zero_end_point_derivatives=True
    )

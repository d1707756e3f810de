"""A bag of our own cell, as ROS drivers would leave it, and a log of the same run."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import VectorLogSink
from scipy.interpolate import make_interp_spline

from drake_disasm.cell.parsing import movable_joints
from drake_disasm.common.files import write_text
from drake_disasm.fakes.bag import FakeBag, bag_times
from drake_disasm.free_motion.cell_urdf import cell_urdf
from drake_disasm.free_motion.playing import MotionPlayer
from drake_disasm.free_motion.table import MotionTable
from drake_disasm.logs import LogHeader, LogWriter, flat_columns
from drake_disasm.scenario import Scenario
from drake_disasm.stations import Station, make_station

#: Ports of the station that the drivers' topics are made of.
_PORTS = {
    "q": "iiwa.position_measured",
    "tau": "iiwa.torque_measured",
    "wrench": "ft_sensor.wrench",
}
_COLUMNS = ("q", "v", "tau")


def record_cell(
    folder: Path, stated: Scenario, hidden: Scenario, motion: MotionTable, late: float
) -> None:
    """Plays a motion on the simulated cell; writes `bag`, `log` and `arm.urdf`.

    The bag has JointState at 200 Hz and WrenchStamped at 500 Hz, with jitter, 2 % of
    the messages lost, and stamps of the sensor that are late. The log is of kind
    `joint_motion`, of the ports themselves.

    Args:
        folder: for all of it.
        stated: what is known of the cell.
        hidden: what is simulated.
        motion: of its joints.
        late: by which the sensor's stamps are [s].
    """
    sinks: dict[str, VectorLogSink] = {}

    def listen(builder: DiagramBuilder, station: Station) -> None:
        """Adds what the drivers listen to."""
        for name, port in _PORTS.items():
            output = station.GetOutputPort(port)
            sink = VectorLogSink(output.size(), hidden.simulation.cell_time_step)
            builder.AddNamedSystem(f"bag_{name}", sink)
            builder.Connect(output, sink.get_input_port())
            sinks[name] = sink

    player = MotionPlayer(make_station("cell", hidden), motion, listen)
    player.play()
    context = player.simulator.get_context()
    logs = {name: sink.FindLog(context) for name, sink in sinks.items()}
    lines = {
        name: make_interp_spline(log.sample_times(), log.data().T, k=1)
        for name, log in logs.items()
    }
    names = movable_joints(stated.arm.model)
    _write_bag(folder, player, lines, names, late)
    write_text(folder / "arm.urdf", cell_urdf(stated))
    _write_log(folder, player, names)


def _write_bag(
    folder: Path,
    player: MotionPlayer,
    lines: Mapping[str, Callable[[float], np.ndarray]],
    names: list[str],
    late: float,
) -> None:
    random, bag, begin = np.random.default_rng(3), FakeBag(), player.begin
    duration = player.end - begin
    for t in bag_times(random, duration, 200.0):
        order = random.permutation(len(names))
        q, tau = (lines[name](begin + max(t, 0.0))[order] for name in ("q", "tau"))
        bag.add_joint_state(t, [names[i] for i in order], q, tau)
    for t in bag_times(random, duration, 500.0):
        bag.add_wrench(t + late, lines["wrench"](begin + max(t, 0.0)))
    bag.write(folder / "bag")


def _write_log(folder: Path, player: MotionPlayer, names: list[str]) -> None:
    header = LogHeader(
        kind="joint_motion",
        task="free motion",
        provenance={"program": "cell_bag"},
        period=player.period,
        joints=names,
        urdf=str(folder / "arm.urdf"),
    )
    found = player.columns()
    with LogWriter(folder / "log", header) as writer:
        columns = {name: found[name] for name in ("time", *_COLUMNS)}
        writer.write_episode(flat_columns("joint_motion", columns))

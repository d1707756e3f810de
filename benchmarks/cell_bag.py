"""A bag of our own cell, as ROS drivers would leave it, and a log of the same run.

The cell has dry friction that its URDF does not state. The bag's sensor has a clock of
its own. Prints the shift that the importer finds, and what `close_loop` says of either.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import VectorLogSink
from scipy.interpolate import make_interp_spline

from drake_disasm.cell.parsing import movable_joints
from drake_disasm.common import program
from drake_disasm.common.files import write_text
from drake_disasm.effects import Effect, JointCoulombFriction
from drake_disasm.free_motion.cell_urdf import cell_urdf
from drake_disasm.free_motion.playing import MotionPlayer
from drake_disasm.free_motion.table import MotionTable
from drake_disasm.logs import LogHeader, LogWriter, flat_columns, read_log
from drake_disasm.logs.importing import (
    ImportProcessing,
    Known,
    guessed_map,
    import_recordings,
    read_source,
    write_log,
)
from drake_disasm.logs.importing.shift import Shift
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.stations import Station, make_station
from drake_disasm.stations.fake_cell.bag import FakeBag, bag_times
from sysid.effect_selection import close_loop
from sysid.effect_selection.verdict import Verdict
from sysid.models.from_logs import ModelChoice, model_of

LATE = 0.012  # s, by which the sensor's stamps are
FRICTION = {"iiwa_joint_2": 4.0, "iiwa_joint_4": 2.5}  # N m

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
    names: Sequence[str],
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


def _write_log(folder: Path, player: MotionPlayer, names: Sequence[str]) -> None:
    header = LogHeader(
        kind="joint_motion",
        task="free motion",
        provenance={"program": "cell_bag"},
        period=player.period,
        joints=tuple(names),
        urdf=str(folder / "arm.urdf"),
    )
    found = player.columns()
    with LogWriter(folder / "log", header) as writer:
        columns = {name: found[name] for name in ("time", *_COLUMNS)}
        writer.write_episode(flat_columns("joint_motion", columns))


def motion() -> MotionTable:
    """Returns 12 s of all joints, each at a rate of its own, from rest to rest."""
    time = np.arange(0.0, 12.0, 0.005)
    phase = 2.0 * np.pi * np.outer(time / 12.0, np.arange(3, 10))
    middle = np.array([0.0, 0.2, 0.0, -1.4, 0.0, 1.2, 0.0])
    return MotionTable(time, middle - 0.1 * (1.0 - np.cos(phase)))


def verdicts(folder: Path) -> tuple[Verdict, Verdict, float]:
    """Returns the verdicts on the bag and on the log, and the bag's shift [s].

    Args:
        folder: for recordings and logs.
    """
    stated = load_scenario("removal")
    effects: list[Effect] = [
        JointCoulombFriction(joint=j, size=s) for j, s in FRICTION.items()
    ]
    hidden = dataclasses.replace(stated, effects=effects)
    record_cell(folder, stated, hidden, motion(), LATE)
    urdf = folder / "arm.urdf"
    bag, shifts = _imported(folder / "bag", urdf, folder / "a")
    own, _ = _imported(folder / "log/episode_0000.parquet", urdf, folder / "b")
    return bag, own, shifts["/ft"].seconds


def _imported(
    source: Path, urdf: Path, folder: Path
) -> tuple[Verdict, dict[str, Shift]]:
    """Returns the verdict on a recording, and its shifts."""
    read = read_source(source)
    fields = guessed_map(
        read, "joint_motion", Known(movable_joints(str(urdf)), urdf=str(urdf))
    )
    imported = import_recordings([read], fields, ImportProcessing())
    write_log(imported, [read], fields, folder, {"program": "cell_bag"})
    closed = close_loop(model_of([read_log(folder)], ModelChoice()))
    return closed.verdict, imported.recordings[0].shifts


def main(arguments: Sequence[str]) -> int:
    """Records, imports and prints the verdicts; returns the exit status."""
    parser = program.argument_parser("python benchmarks/cell_bag.py", __doc__, "")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    bag, own, shift = verdicts(parser.parse_args(arguments).out)
    print(f"shift of the sensor's clock: {1e3 * shift:.1f} ms")
    for name, verdict in (("bag", bag), ("log", own)):
        each = ", ".join(f"{s.name} ({s.status})" for s in verdict.standings)
        print(f"{name}: {verdict.ending}: {each}")
    return 0


if __name__ == "__main__":
    program.run(main)

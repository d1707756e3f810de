"""How often a watch raises false alarms, and how soon it finds what has changed.

Episodes of 3 s of an arm whose joints rub, along paths that vary. Each has noise of its
own, correlated from row to row, and differs from the others as days do: a load of
+-10 g, viscous friction of +-5 % (the gears' temperature), offsets of +-0.05 N m. Then
a tool of 0.5 kg or a camera of 0.15 kg hangs on the flange, a joint's dry friction is
30 % higher, or its torque offset jumps by 0.5 N m.

The first --files episodes go through logs on the disk and a watch's folder. The others
are computed from the same derivatives, which do not depend on the noise. A run that was
stopped goes on where it was.
"""

import dataclasses
import functools
import json
import resource
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from changes import friction, motion, noise_of
from results import add_results_argument, write_result
from scipy.signal import lfilter

from drake_disasm.cell.parsing import movable_joints
from drake_disasm.common import options, program
from drake_disasm.common.archive import ArchiveKind, load_archive, save_archive
from drake_disasm.common.arrays import Array
from drake_disasm.common.files import make_folder, write_json
from drake_disasm.effects import (
    Effect,
    FlangePayload,
    JointCoulombFriction,
    JointViscousFriction,
    TorqueOffset,
)
from drake_disasm.learning.statistics import wilson_interval
from drake_disasm.logs import LogHeader, LogWriter, flat_columns, read_log
from sysid.effect_selection.close_loop import close_loop
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.joint_motion import JointMotionModel
from sysid.monitoring.judgement import Judgement
from sysid.monitoring.linear_episode import EpisodeNumbers, LinearEpisode
from sysid.monitoring.monitor import Monitor
from sysid.monitoring.record import Record
from sysid.monitoring.reference import KEY, Reference
from sysid.monitoring.watched import Arrival

_PROGRAM = "benchmarks/monitor.py"
_EXAMPLES = """examples:
  python benchmarks/monitor.py models/iiwa14/iiwa14.urdf --files 300
"""
_SEED, _DURATION, _RHO = 59_500, 3.0, 0.9
_PATHS, _REFERENCES = 16, 12
_LEVELS = (100.0, 1000.0)
_BEFORE, _MOST = 10, 60  # episodes before a change, and after it at most
_MASS, _WARMTH, _OFFSET = 0.01, 0.05, 0.05  # kg, share, N m: of the day
_ARM = np.array([0.05, 0.02, 0.1])  # m, where loads hang
_STATE = ArchiveKind(
    "state of a watch", "name a new folder", "name a new folder", 2**30, 20
)
KINDS = {
    "tool": (FlangePayload(0.5, *(0.5 * _ARM)), "FlangePayload"),
    "camera": (FlangePayload(0.15, *(0.15 * _ARM)), "FlangePayload"),
    "friction": (None, "JointCoulombFriction"),
    "offset": (None, "TorqueOffset"),
}


@dataclasses.dataclass(frozen=True)
class Motion:
    """A motion of the arm, and the torques along it.

    Attributes:
        columns: time, q, v, vd.
        tau: (n, joints) without noise.
        daily: (k, n, joints) what differs from day to day, by one standard deviation.
        changes: (n, joints) torques of each kind of change.
    """

    columns: dict[str, Array]
    tau: Array
    daily: Array
    changes: dict[str, Array]


class Simulation:
    """Episodes of an arm, by number."""

    def __init__(self, urdf: Path, scratch: Path) -> None:
        """Simulates the paths.

        Args:
            urdf: of the arm.
            scratch: a folder for logs without torques.
        """
        self.urdf, self.joints = urdf, movable_joints(str(urdf))
        self.own = friction(self.joints, np.random.default_rng(_SEED))
        self.noise = noise_of(urdf)
        self.header = LogHeader(
            "joint_motion", "simulated", {}, joints=self.joints, urdf=str(urdf)
        )
        self.paths = [self._path(number, scratch) for number in range(_PATHS)]

    def change(self, kind: str) -> tuple[Effect, str]:
        """Returns the effect of a change, and its name."""
        effect, name = KINDS[kind]
        rubs = self.own[1]
        assert isinstance(rubs, JointCoulombFriction)
        if kind == "friction":
            effect = JointCoulombFriction(rubs.joint, 0.3 * rubs.size)
        if kind == "offset":
            effect = TorqueOffset(rubs.joint, 0.5)
        assert effect is not None
        return effect, name if effect in _values() else f"{name}.{rubs.joint}"

    def _path(self, number: int, scratch: Path) -> Motion:
        random = np.random.default_rng([_SEED, 1, number])
        time, q, v, vd = motion(len(self.joints), random, _DURATION)
        columns = {"time": time, "q": q, "v": v, "vd": vd, "tau": np.zeros_like(q)}
        shutil.rmtree(scratch, ignore_errors=True)
        with LogWriter(scratch, self.header) as writer:
            writer.write_episode(flat_columns("joint_motion", columns))
        model = JointMotionModel([read_log(scratch)])
        nominal = np.array([p.nominal for p in model.parameters])

        def _torques(*effects: Effect) -> Array:
            return model.with_effects([*self.own, *effects]).predictions(nominal)

        tau = _torques()
        warm = [e for e in self.own if isinstance(e, JointViscousFriction)]
        days: list[list[Effect]] = [
            [FlangePayload(_MASS, *(_MASS * _ARM))],
            [JointViscousFriction(e.joint, _WARMTH * e.coefficient) for e in warm],
            *([TorqueOffset(joint, _OFFSET)] for joint in self.joints),
        ]
        daily = np.array([_torques(*effects) - tau for effects in days])
        changes = {kind: _torques(self.change(kind)[0]) - tau for kind in KINDS}
        return Motion(columns, tau, daily, changes)

    def draw(self, number: int, kind: str = "") -> tuple[int, Array]:
        """Returns the path of an episode, and its torques less those of the path."""
        random = np.random.default_rng([_SEED, 2, number])
        which = int(random.integers(_PATHS))
        path = self.paths[which]
        white = random.normal(size=(200 + len(path.tau), len(self.joints)))
        noise = lfilter([np.sqrt(1.0 - _RHO**2)], [1.0, -_RHO], white, axis=0)[200:]
        more = np.tensordot(random.normal(size=len(path.daily)), path.daily, 1)
        more = more + self.noise * noise
        return which, more + path.changes[kind] if kind else more

    def write(self, folder: Path, number: int, kind: str = "") -> None:
        """Writes an episode as a log."""
        which, more = self.draw(number, kind)
        path = self.paths[which]
        with LogWriter(folder, self.header) as writer:
            columns = path.columns | {"tau": path.tau + more}
            writer.write_episode(flat_columns("joint_motion", columns))


def _values() -> list[Effect | None]:
    return [effect for effect, _ in KINDS.values()]


class Case:
    """A reference, a simulation, and the episodes' numbers."""

    def __init__(self, urdf: Path, out: Path) -> None:
        """Makes the reference, if it is not there."""
        self.out = out
        self.simulation = Simulation(urdf, out / "scratch")
        if not (out / "closed" / "result.json").exists():
            self._close()
        self.reference = Reference.read(out / "closed")
        self.monitor = Monitor.of(self.reference, 1e300)

    def _close(self) -> None:
        folders = [self.out / "reference" / f"{n:03d}" for n in range(_REFERENCES)]
        for number, folder in enumerate(folders):
            shutil.rmtree(folder, ignore_errors=True)
            self.simulation.write(folder, -number - 1 + 2**31)
        logs, choice = [read_log(folder) for folder in folders], ModelChoice(fixed=True)
        closed = close_loop(model_of(logs, choice), test=())
        known = Reference.of(closed, logs, choice)
        make_folder(self.out / "closed")
        write_json(self.out / "closed" / "result.json", {KEY: known.to_mapping()})

    @functools.cached_property
    def _linear(self) -> list[LinearEpisode]:
        """Of each path, without noise."""
        found = []
        for path in self.simulation.paths:
            folder = self.out / "scratch"
            shutil.rmtree(folder, ignore_errors=True)
            with LogWriter(folder, self.simulation.header) as writer:
                columns = path.columns | {"tau": path.tau}
                writer.write_episode(flat_columns("joint_motion", columns))
            found.append(self.monitor.statistics.linearised(read_log(folder)))
        return found

    def numbers(self, number: int, kind: str = "") -> EpisodeNumbers:
        """Returns what an episode shows."""
        which, more = self.simulation.draw(number, kind)
        linear = self._linear[which]
        residual = linear.linear.residual - more / np.array(self.reference.noise)
        return linear.with_residual(residual).numbers()

    def new_monitor(self, every: float) -> Monitor:
        """Returns a monitor that knows the reference alone."""
        return Monitor(self.monitor.statistics, self.monitor.baseline, every)


def through_files(case: Case, episodes: int) -> dict[str, Any]:
    """Runs a watch over logs on the disk; returns alarms and its memory [MiB]."""
    logs, notes = case.out / "days", case.out / "memory.jsonl"
    make_folder(logs)
    watch = case.out / "watch"
    record = Record.open(watch, case.reference, logs, _LEVELS[0], {})
    while record.monitor.count < episodes:
        number = record.monitor.count
        folder = logs / f"day_{number:05d}"
        shutil.rmtree(folder, ignore_errors=True)
        case.simulation.write(folder, number)
        for arrival in record.watched.arrivals():
            record.watched.take(arrival)
            assert isinstance(arrival, Arrival) and arrival.log is not None
            judgement = record.monitor.judge(arrival.log)
            record.keep(judgement)
            if judgement.is_alarm:
                record.monitor.restart()
        shutil.rmtree(folder)
        if number % 50 == 49:
            line = {"episodes": number + 1, "mib": memory()}
            with notes.open("a") as stream:
                print(json.dumps(line), file=stream)
    lines = (watch / "episodes.jsonl").read_text().splitlines()
    found = [json.loads(line) for line in lines]
    evidence = [each["log10_evidence"] for each in found]
    _refuse_difference(case, evidence)
    marks = [json.loads(line) for line in notes.read_text().splitlines()]
    return {"alarms": record.monitor.alarms, "memory": marks}


def _refuse_difference(case: Case, evidence: Sequence[float]) -> None:
    """Refuses a quick path that is not what goes through files."""
    monitor = case.new_monitor(_LEVELS[0])
    for number, value in enumerate(evidence[:20]):
        said = judged(monitor, case, number)
        assert said.log10_evidence is not None
        assert abs(said.log10_evidence - value) < 1e-3, (number, said, value)


def judged(monitor: Monitor, case: Case, number: int, kind: str = "") -> Judgement:
    """Returns what is said of an episode; an alarm restarts the monitor."""
    return monitor.judge_numbers(Path("day"), number, case.numbers(number, kind))


def memory() -> float:
    """Returns the process's memory [MiB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return round(pages * resource.getpagesize() / 2**20, 1)


def false_alarms(case: Case, episodes: int) -> dict[str, int]:
    """Returns the number of alarms without a change, at each level."""
    files = {level: case.out / f"null_{level:g}.npz" for level in _LEVELS}
    monitors = {level: _kept(case, level, path) for level, path in files.items()}
    for number in range(min(m.count for m in monitors.values()), episodes):
        numbers = case.numbers(number)
        for level, monitor in monitors.items():
            if monitor.count > number:  # it was kept a little later than the other
                continue
            if monitor.judge_numbers(Path("day"), number, numbers).is_alarm:
                monitor.restart()
            if monitor.count % 500 == 0 or monitor.count == episodes:
                save_archive(files[level], *monitor.to_archive())
    return {f"{level:g}": monitor.alarms for level, monitor in monitors.items()}


def _kept(case: Case, level: float, path: Path) -> Monitor:
    """Returns a monitor as it was kept, or a new one."""
    if not path.exists():
        return case.new_monitor(level)
    return Monitor.from_archive(case.reference, *load_archive(path, _STATE), level)


def delays(case: Case, kind: str, count: int) -> list[dict[str, Any]]:
    """Returns when changes of a kind were found, and what was named."""
    path = case.out / f"{kind}.jsonl"
    lines = path.read_text().splitlines() if path.exists() else []
    with path.open("a") as stream:
        for number in range(len(lines), count):
            lines.append(json.dumps(_delay(case, kind, number)))
            print(lines[-1], file=stream, flush=True)
    return [json.loads(line) for line in lines[:count]]


def _delay(case: Case, kind: str, number: int) -> dict[str, Any]:
    monitor, first = case.new_monitor(_LEVELS[1]), 10**6 + 1000 * number
    _, name = case.simulation.change(kind)
    for step in range(_BEFORE + _MOST):
        said = judged(monitor, case, first + step, kind * (step >= _BEFORE))
        if said.is_alarm and step < _BEFORE:
            monitor.restart()
        elif said.is_alarm:
            names = [suspect.statistic.name for suspect in said.suspects]
            since = int(said.suspects[0].since.rpartition("_")[2]) - first
            return {
                "delay": step - _BEFORE + 1,
                "names": names,
                "is_first": names[0] == name,
                "is_named": name in names,
                "start_off": since - _BEFORE,
            }
    return {"delay": None, "names": [], "is_first": False, "is_named": False}


def main(arguments: Sequence[str]) -> int:
    """Runs the watches and prints the tables; returns the exit status."""
    parser = program.argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    add = parser.add_argument
    add("urdf", type=Path, help="of the arm")
    add("--episodes", type=options.positive, default=10_000, metavar="N",
        help="without a change (default: 10000)")  # fmt: skip
    add("--files", type=options.positive, default=300, metavar="N",
        help="of these, through files (default: 300)")  # fmt: skip
    add("--changes", type=options.positive, default=200, metavar="N",
        help="of each kind (default: 200)")  # fmt: skip
    add("--out", type=Path, default=Path("out/monitor"), metavar="DIR",
        help="a run that was stopped goes on (default: out/monitor)")  # fmt: skip
    add_results_argument(parser)
    args = parser.parse_args(arguments)
    make_folder(args.out)
    case = Case(args.urdf.resolve(), args.out.resolve())
    rows = _alarm_rows(args.episodes, false_alarms(case, args.episodes))
    for kind in KINDS:
        rows += _delay_rows(kind, delays(case, kind, args.changes))
    rows += _file_rows(args.files, through_files(case, args.files))
    columns = ("change", "what is counted", "number", "of", "remark")
    for row in rows:
        print("| " + " | ".join(map(str, row)) + " |")
    title = f"A watch of {args.urdf.stem}, simulated"
    write_result(args.results, title, columns, rows, _PROGRAM, arguments)
    return 0


def _alarm_rows(episodes: int, alarms: dict[str, int]) -> list[list[str | int]]:
    found: list[list[str | int]] = []
    for level, count in alarms.items():
        low, high = (episodes * end for end in wilson_interval(count, episodes))
        stated = f"stated: at most {episodes / float(level):.0f}"
        remark = f"{stated}; 95 % interval {low:.0f} to {high:.0f}"
        what = f"false alarms, once in {level} stated"
        found.append(["nothing changed", what, count, episodes, remark])
    return found


def _delay_rows(kind: str, found: Sequence[dict[str, Any]]) -> list[list[str | int]]:
    late = sorted(each["delay"] for each in found if each["delay"])
    off = [abs(each["start_off"]) for each in found if each["delay"]]
    if not late:
        return [[kind, "found", 0, len(found), ""]]
    ends = [late[int(share * (len(late) - 1))] for share in (0.5, 0.95)]
    remark = f"after {ends[0]} episodes (median), {ends[1]} (95 %), {late[-1]} at most"
    first, named = (sum(e[key] for e in found) for key in ("is_first", "is_named"))
    right = sum(value <= 1 for value in off)
    return [
        [kind, "found", len(late), len(found), remark],
        [kind, "named first", first, len(found), f"named at all: {named}"],
        [kind, "start within one episode", right, len(late), ""],
    ]


def _file_rows(episodes: int, found: dict[str, Any]) -> list[list[str | int]]:
    marks = found["memory"]
    first, last = marks[0], marks[-1]
    remark = (
        f"memory {first['mib']:.0f} MiB after {first['episodes']} episodes, "
        f"{last['mib']:.0f} MiB after {last['episodes']}"
    )
    what = f"false alarms through files, once in {_LEVELS[0]:g} stated"
    return [["nothing changed", what, found["alarms"], episodes, remark]]


if __name__ == "__main__":
    program.run(main)

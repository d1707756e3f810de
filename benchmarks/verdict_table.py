"""What close-loop says of logs that are hard to judge: short, damaged or ambiguous.

Makes a log for each row, real (`../shared/data`) or simulated, runs
`tools/close_loop.py` on it as a user would, and prints a table in Markdown.
"""

import dataclasses
import json
import resource
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from answers import complete
from cell_verdicts import record
from damaged_logs import (
    Damage,
    changed,
    damaged,
    late,
    rounded,
    scaled,
    swapped,
    with_episode,
)
from real_data import write_arm, write_emps, write_motion, write_slide, write_static
from results import Cell, add_results_argument, write_result
from scipy.spatial.transform import Rotation

from drake_disasm.common import program
from drake_disasm.common.arrays import Array
from drake_disasm.effects import (
    Effect,
    GrooveFriction,
    GroovePose,
    MotionLag,
    PayloadError,
    SensorBias,
    SensorDrift,
    SensorEffect,
    SensorGain,
)
from drake_disasm.effects.base import Sensing
from drake_disasm.effects.fields import amplitude
from drake_disasm.logs import Log, LogWriter, read_log, write_static_wrench
from drake_disasm.scenario import dump_scenario, load_scenario
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log

SENSOR = ("wrench", "ft_sensor")
_TITLE = "Verdicts on logs that are hard to judge"
_COLUMNS = ("log", "answer", "CPU time [s]")
_PROGRAM = "benchmarks/verdict_table.py"
_CLOSE_LOOP = Path(__file__).parents[1] / "tools" / "close_loop.py"
_EXAMPLES = """examples:
  python benchmarks/verdict_table.py                # a quarter of an hour on one core
  python benchmarks/verdict_table.py sensor stroke
"""

#: Writes a log or logs to a folder; returns the options of close-loop.
Make = Callable[[Path], list[str]]
_SAID = ("data:", "error:")  # begins of lines on stderr that are part of an answer
_SEED = 8001  # of the logs of this table


@dataclasses.dataclass
class Hum(SensorEffect):
    """A sine on fy, which no effect of the library is. Equation: F + a sin(2 pi f t).

    Not registered: the program does not know it.
    """

    fy: float = amplitude("N", -5.0, 5.0, "half of its height, along y_S")

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Adds the sine at this time."""
        sine = np.sin(2.0 * np.pi * 1.3 * np.asarray(sensing.time))
        return wrench_S + self.fy * sine[..., None] * np.eye(6)[1]


def _transitions(effects: Sequence[Effect] = (), damage: Damage | None = None) -> Make:
    """Returns what writes a log of the twin, maybe with columns that are damaged."""

    def _make(folder: Path) -> list[str]:
        transitions_log(folder / "log", nominal(), effects, _SEED)
        if damage:
            _rewritten(folder / "log", damaged(read_log(folder / "log"), damage))
        return ["--log", str(folder / "log"), *_stated(folder)]

    return _make


def _rewritten(folder: Path, log: Log) -> None:
    """Writes a log in the place of the one that is there."""
    for old in folder.glob("*"):
        old.unlink()
    with LogWriter(folder, log.header) as writer:
        for episode in log.episodes:
            writer.write_episode(dict(episode.columns))


def _stated(folder: Path) -> list[str]:
    """Returns the option of the scenario that the simulated logs state."""
    path = folder / "stated.yaml"
    path.write_text(dump_scenario(nominal()))
    return ["--scenario", str(path)]


def _one_episode_offset(folder: Path) -> list[str]:
    """Writes eleven episodes without, and one with an offset of 1 N in fy."""
    transitions_log(folder / "log", nominal(), [], _SEED, 11)
    transitions_log(folder / "with", nominal(), [SensorBias(fy=1.0)], _SEED, 1)
    log, with_offset = (read_log(folder / name) for name in ("log", "with"))
    _rewritten(folder / "log", with_episode(log, with_offset, 4))
    return ["--log", str(folder / "log"), *_stated(folder)]


def _moving(folder: Path) -> list[str]:
    """Writes readings "at rest", 0.1 s apart, of a payload that is turned all along."""
    random, time = np.random.default_rng(_SEED), 0.1 * np.arange(600)
    angles = np.cumsum(0.05 * random.standard_normal((600, 3)), axis=0)
    turn = Rotation.from_euler("xyz", angles)
    g_S = turn.inv().apply([0.0, 0.0, -9.81])
    wrench = 1.2 * np.hstack([g_S, np.cross([0.01, -0.02, 0.06], g_S)])
    wrench += random.standard_normal(wrench.shape) * ([0.05] * 3 + [0.002] * 3)
    quaternions = turn.as_quat()[:, [3, 0, 1, 2]]
    write_static_wrench(folder / "log", quaternions, wrench, "S", "weigh", {}, time)
    return ["--log", str(folder / "log")]


def _arm(rows: int | None) -> Make:
    """Returns what writes the begin of a real arm's recording 1, or both recordings."""

    def _make(folder: Path) -> list[str]:
        urdf = write_arm(folder / "arm.urdf")
        logs = [write_motion(n, folder / f"run_{n}", urdf) for n in (1, 2)]
        if rows is None:
            return ["--log", *map(str, logs), "--held-out", "run_2"]
        _cut(logs[0], slice(0, rows))
        return ["--log", str(logs[0])]

    return _make


def _cut(folder: Path, rows: slice) -> None:
    """Keeps some rows of a log of one episode."""
    log = read_log(folder)
    [episode] = log.episodes
    columns = {name: values[rows] for name, values in episode.columns.items()}
    columns["time"] = columns["time"] - columns["time"][0]
    _rewritten(
        folder,
        dataclasses.replace(
            log, episodes=(dataclasses.replace(episode, columns=columns),)
        ),
    )


def _emps(folder: Path) -> list[str]:
    urdf = write_slide(folder / "emps.urdf")
    logs = [str(write_emps(n, folder / f"record_{n}", urdf)) for n in (1, 2)]
    return ["--log", *logs, "--held-out", "record_2"]


def _stroke(folder: Path) -> list[str]:
    """Writes the longest stretch of EMPS in which the carriage does not turn back."""
    log = write_emps(1, folder / "record_1", write_slide(folder / "emps.urdf"))
    speed = read_log(log).episodes[0]["v.0"]
    moving = np.flatnonzero(np.diff(np.sign(np.where(speed > 0.01, 1, -1))))
    ends = np.append(moving, len(speed) - 1)
    begins = np.insert(moving + 1, 0, 0)
    forth = [(e - b, b, e) for b, e in zip(begins, ends, strict=True) if speed[b] > 0]
    _, begin, end = max(forth)
    _cut(log, slice(int(begin), int(end)))
    return ["--log", str(log)]


def _static(folder: Path) -> list[str]:
    return ["--log", str(write_static(100, folder / "log"))]


def _cell(*effects: Effect) -> Make:
    """Returns what records the cell, with effects that its log does not state."""

    def _make(folder: Path) -> list[str]:
        scenario = load_scenario("removal")
        scenario.effects = list(effects)
        record(folder / "log", scenario, "effect", _SEED)
        return ["--log", str(folder / "log"), "--scenario", "removal"]

    return _make


def _wrong_name(folder: Path) -> list[str]:
    return [*_arm(None)(folder)[:3], "--held-out", "run_3"]


_THREE = [GrooveFriction(coefficient=0.1), SensorGain(fx=0.2), MotionLag(delay=0.05)]
_SPIKES = changed("wrench.fy", [3, 9, 15], lambda values: values + 5.0)

#: The log in words, and what makes it, by a name that the command line takes.
ROWS: dict[str, tuple[str, Make]] = {
    "arm": ("a real arm (KUKA LWR 4+), recording 1; held out: 2", _arm(None)),
    "arm_10s": ("the same, its first 10.4 s", _arm(2080)),
    "arm_8s": ("the same, its first 8 s", _arm(1600)),
    "arm_4s": ("the same, its first 4 s", _arm(800)),
    "arm_2s": ("the same, its first 2 s", _arm(400)),
    "sensor": ("a real force/torque sensor, 100 poses", _static),
    "emps": ("a real linear drive (EMPS), record 1; held out: 2", _emps),
    "stroke": ("the same, one stroke", _stroke),
    "cell": ("the cell, nothing hidden", _cell()),
    "moving": ("readings at rest that move, 0.1 s apart", _moving),
    "wrong_name": ("a wrong name after --held-out", _wrong_name),
    "dead": ("the wrench zero everywhere", _transitions(damage=scaled(0.0, *SENSOR))),
    "hum": ("0.15 N at 1.3 Hz on fy", _transitions([Hum(fy=0.15)])),
    "hum_loud": ("0.3 N at 1.3 Hz on fy", _transitions([Hum(fy=0.3)])),
    "spikes": (
        "three rows of each episode with +5 N on fy",
        _transitions(damage=_SPIKES),
    ),
    "late_wrench": ("the wrench a row late", _transitions(damage=late(1, *SENSOR))),
    "late_pose": (
        "the pose a row late",
        _transitions(damage=late(1, "X_GB_measured")),
    ),
    "swapped": (
        "fy and fz exchanged",
        _transitions(damage=swapped("wrench.fy", "wrench.fz")),
    ),
    "turned": (
        "the twin, groove turned by ry = 0.034907",
        _transitions([GroovePose(ry=0.034907)]),
    ),
    "turned_cell": (
        "the cell, groove turned by rx = 0.02, rz = -0.015, and 50 g of payload",
        _cell(GroovePose(rx=0.02, rz=-0.015), PayloadError(mass=0.05)),
    ),
    "three": ("friction, gain of fx, and a lag at once", _transitions(_THREE)),
    "cancel": (
        "an offset of 0.6 N and a drift of -0.12 N/s",
        _transitions([SensorBias(fx=0.6), SensorDrift(fx=-0.12)]),
    ),
    "one_episode": ("an offset in one episode of twelve", _one_episode_offset),
    "quantum": (
        "a quantum of 0.5 N",
        _transitions(damage=rounded(0.5, "wrench.f", "ft_sensor.f")),
    ),
}


def answer(name: str, folder: Path) -> dict[str, Any]:
    """Returns what the program prints of a row, its status, and its time [s]."""
    if not (folder / "options.json").exists():
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "options.json").write_text(json.dumps(ROWS[name][1](folder)))
    options = json.loads((folder / "options.json").read_text())
    command = [sys.executable, _CLOSE_LOOP, *options, "--out", folder / "out"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run([*command, "--workers", "1"], capture_output=True, text=True)
    spent = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    said = [line for line in done.stderr.splitlines() if line.startswith(_SAID)]
    if done.returncode == 0:
        result = json.loads((folder / "out" / "result.json").read_text())
        said.append(f"{result['ending']}: {result['sentence']}")
    return {"rc": done.returncode, "said": said, "cpu": round(spent, 1)}


def main(arguments: Sequence[str]) -> int:
    """Asks about the logs and prints the table; returns the exit status."""
    parser = program.argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    parser.add_argument(
        "rows", nargs="*", metavar="ROW", help=f"of {', '.join(ROWS)} (default: all)"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out/verdict_table"), metavar="DIR",
        help="keeps logs and answers; a run that was stopped goes on from there "
        "(default: out/verdict_table)",
    )  # fmt: skip
    add_results_argument(parser)
    args = parser.parse_args(arguments)
    if unknown := [name for name in args.rows if name not in ROWS]:
        parser.error(f"row '{unknown[0]}' is unknown; take of {', '.join(ROWS)}")
    rows: list[list[Cell]] = []
    for name in args.rows or ROWS:
        ask = partial(_numbered, name, args.out / name)
        [found] = complete(args.out / f"{name}.jsonl", 1, ask)
        rows.append([ROWS[name][0], "<br>".join(found["said"]), found["cpu"]])
    lines = [_COLUMNS, ["---"] * len(_COLUMNS), *rows]
    print("\n".join(f"| {' | '.join(map(str, line))} |" for line in lines))
    write_result(args.results, _TITLE, _COLUMNS, rows, _PROGRAM, arguments)
    return 0


def _numbered(name: str, folder: Path, _: int) -> dict[str, Any]:
    return answer(name, folder)


if __name__ == "__main__":
    program.run(main)

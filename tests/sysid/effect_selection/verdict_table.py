"""What the first version of closing the loop got wrong, and what it says today.

    python -m tests.sysid.effect_selection.verdict_table --out out/verdict_table

Makes a log for each row of `../shared/reference/verdicts-2.md` whose recording is at
hand, or can be simulated, runs `tools/close_loop.py` on it as a user would, and prints
a table in Markdown: what was said at 796ad0f, and what is said now. Writes each answer
as it comes, and goes on from there; rows by name run alone.
"""

import argparse
import dataclasses
import json
import resource
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

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
from tests.sysid.data_checks.damage import (
    Damage,
    changed,
    damaged,
    late,
    rounded,
    scaled,
    swapped,
    with_episode,
)
from tests.sysid.effect_selection.cell_verdicts import record
from tests.sysid.real_data import (
    write_arm,
    write_emps,
    write_motion,
    write_slide,
    write_static,
)

SENSOR = ("wrench", "ft_sensor")
_PROGRAM = "tools/close_loop.py"
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


@dataclasses.dataclass(frozen=True)
class Row:
    """A row of the table.

    Attributes:
        what: the log, in words.
        then: what was said of it.
        make: writes the log or logs to a folder; returns the program's options.
    """

    what: str
    then: str
    make: Callable[[Path], list[str]]


def _transitions(
    effects: Sequence[Effect] = (), damage: Damage | None = None
) -> Callable[[Path], list[str]]:
    """Returns what writes a log of the twin, maybe with columns that are damaged."""

    def make(folder: Path) -> list[str]:
        transitions_log(folder / "log", nominal(), effects, _SEED)
        if damage:
            _rewritten(folder / "log", damaged(read_log(folder / "log"), damage))
        return ["--log", str(folder / "log"), *_stated(folder)]

    return make


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


def _arm(rows: int | None) -> Callable[[Path], list[str]]:
    """Returns what writes the begin of a real arm's recording 1, or both recordings."""

    def make(folder: Path) -> list[str]:
        urdf = write_arm(folder / "arm.urdf")
        logs = [write_motion(n, folder / f"run_{n}", urdf) for n in (1, 2)]
        if rows is None:
            return ["--log", *map(str, logs), "--held-out", "run_2"]
        _cut(logs[0], slice(0, rows))
        return ["--log", str(logs[0])]

    return make


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


def _cell(*effects: Effect) -> Callable[[Path], list[str]]:
    """Returns what records the cell, with effects that its log does not state."""

    def make(folder: Path) -> list[str]:
        scenario = load_scenario("removal")
        scenario.effects = list(effects)
        record(folder / "log", scenario, _SEED)
        return ["--log", str(folder / "log"), "--scenario", "removal"]

    return make


def _wrong_name(folder: Path) -> list[str]:
    return [*_arm(None)(folder)[:3], "--held-out", "run_3"]


_THREE = [GrooveFriction(coefficient=0.1), SensorGain(fx=0.2), MotionLag(delay=0.05)]
_SPIKES = changed("wrench.fy", [3, 9, 15], lambda values: values + 5.0)

#: By a name that the command line takes.
ROWS: dict[str, Row] = {
    "arm": Row(
        "a real arm (KUKA LWR 4+), recording 1, held out: 2",
        "6.7 to 2.1 %: friction of six joints, offsets of four",
        _arm(None),
    ),
    "arm_10s": Row(
        "row 1; its first 10.4 s (in place of the Franka's, which is kept apart)",
        "the Franka's: none, though friction halves the error",
        _arm(2080),
    ),
    "arm_8s": Row("row 1; its first 8 s", "refused as too short", _arm(1600)),
    "arm_4s": Row("row 1; its first 4 s", "refused as too short", _arm(800)),
    "arm_2s": Row("row 1; its first 2 s", "refused as too short", _arm(400)),
    "sensor": Row(
        "a real force/torque sensor, 100 poses",
        "0.334 to 0.064 N: a drift of fz that ends",
        _static,
    ),
    "emps": Row(
        "rows 2, 3 and 6; EMPS, record 1, held out: 2",
        "68 to 7.1 %, explained; units of a rotary joint",
        _emps,
    ),
    "stroke": Row(
        "row 8; one stroke of EMPS",
        "of a rack and pinion's: JointLoadFriction, a tie of four",
        _stroke,
    ),
    "cell": Row(
        "row 4; the cell, nothing hidden",
        "unexplained: 4.2 times the noise",
        _cell(),
    ),
    "moving": Row(
        "row 5; readings at rest that move, 0.1 s apart", "none, 0.178 N", _moving
    ),
    "wrong_name": Row(
        "row 7; a wrong name after --held-out", "refused after 30 s", _wrong_name
    ),
    "dead": Row(
        "row 9; the wrench zero everywhere",
        "SensorSaturation, RustyPatch, SensorGain",
        _transitions(damage=scaled(0.0, *SENSOR)),
    ),
    "hum": Row("row 10; 0.15 N at 1.3 Hz on fy", "none", _transitions([Hum(fy=0.15)])),
    "hum_loud": Row("row 10; 0.3 N at 1.3 Hz on fy", "-", _transitions([Hum(fy=0.3)])),
    "spikes": Row(
        "row 10; three rows of each episode with +5 N on fy",
        "none",
        _transitions(damage=_SPIKES),
    ),
    "late_wrench": Row(
        "row 11; the wrench a row late",
        "unexplained, nearest MotionLag",
        _transitions(damage=late(1, *SENSOR)),
    ),
    "late_pose": Row(
        "row 11; the pose a row late",
        "unexplained, nearest Backlash",
        _transitions(damage=late(1, "X_GB_measured")),
    ),
    "swapped": Row(
        "row 11; fy and fz exchanged",
        "unexplained, nearest CrossTalk",
        _transitions(damage=swapped("wrench.fy", "wrench.fz")),
    ),
    "turned": Row(
        "row 12; the twin, groove turned by ry = 0.034907",
        "0.03488 (0.03487 to 0.0349), rz -17 (-48 to -6) urad",
        _transitions([GroovePose(ry=0.034907)]),
    ),
    "turned_cell": Row(
        "row 12; the cell, rx = 0.02, rz = -0.015, and 50 g of payload",
        "rz -0.01456 (-0.01484 to -0.01423), y = 22 um",
        _cell(GroovePose(rx=0.02, rz=-0.015), PayloadError(mass=0.05)),
    ),
    "three": Row(
        "row 13; friction, gain of fx, and a lag at once, 300 rows",
        "two of the three, on 883 rows, in 371 s",
        _transitions(_THREE),
    ),
    "cancel": Row(
        "right before; an offset of 0.6 N and a drift of -0.12 N/s",
        "0.606 and -0.1207",
        _transitions([SensorBias(fx=0.6), SensorDrift(fx=-0.12)]),
    ),
    "one_episode": Row(
        "right before; an offset in one episode of twelve",
        "episode_0004 (SensorBias)",
        _one_episode_offset,
    ),
    "quantum": Row(
        "right before; a quantum of 0.5 N",
        "unexplained",
        _transitions(damage=rounded(0.5, "wrench.f", "ft_sensor.f")),
    ),
}


def answer(name: str, folder: Path) -> dict[str, Any]:
    """Returns what the program prints of a row, its status, and its time [s]."""
    if not (folder / "options.json").exists():
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "options.json").write_text(json.dumps(ROWS[name].make(folder)))
    options = json.loads((folder / "options.json").read_text())
    command = [sys.executable, _PROGRAM, *options, "--out", str(folder / "out")]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run([*command, "--workers", "1"], capture_output=True, text=True)
    spent = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    said = [line for line in done.stderr.splitlines() if line.startswith(_SAID)]
    if done.returncode == 0:
        result = json.loads((folder / "out" / "result.json").read_text())
        said.append(f"{result['ending']}: {result['sentence']}")
    return {"name": name, "rc": done.returncode, "said": said, "cpu": round(spent, 1)}


def table(answers: Sequence[dict[str, Any]]) -> str:
    """Returns the answers beside those of before, as Markdown."""
    lines = ["| log | at 796ad0f | now | CPU |", "|---|---|---|---|"]
    for each in answers:
        row, said = ROWS[each["name"]], "<br>".join(each["said"])
        lines.append(f"| {row.what} | {row.then} | {said} | {each['cpu']} s |")
    return "\n".join(lines)


def main() -> None:
    """Runs the program."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rows", nargs="*", metavar="ROW", help=", ".join(ROWS))
    parser.add_argument("--out", type=Path, default=Path("out/verdict_table"))
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    path = args.out / "answers.jsonl"
    known = [json.loads(line) for line in path.open()] if path.exists() else []
    found = {each["name"]: each for each in known}
    with path.open("a") as stream:
        for name in args.rows or ROWS:
            if name not in found:
                found[name] = answer(name, args.out / name)
                print(json.dumps(found[name]), file=stream, flush=True)
    print(table([found[name] for name in args.rows or ROWS]))


if __name__ == "__main__":
    main()

"""Whether real logs that are written wrongly are said to be, and right ones are not.

Windows of real recordings are read as they are, and the first of each length with one
fault put in: `bookkeeping` says how each was written. An answer is right if its only
hypothesis puts the log right, silent if there is none, and wrong if there is any other.
A window as it is must have no hypothesis, but for one that the recording is known for.
Prints each wrong answer, and how many were right, silent and wrong.
"""

import dataclasses
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np
from damaged_logs import Columns, Damage, both, damaged, late, reordered, scaled
from numpy.typing import NDArray
from real_data import data_folder
from results import Cell, add_results_argument, markdown, write_result
from scipy.spatial.transform import Rotation
from selection.real import RECORDED

from drake_disasm.common import program
from drake_disasm.effects import ArmDelay
from drake_disasm.logs import Log, read_log, write_static_wrench
from drake_disasm.logs.schema import WRENCH
from sysid.models.base import LogModel
from sysid.models.bookkeeping import Bookkeeping
from sysid.models.from_logs import ModelChoice, model_of
from sysid.parameters import nominal_values

_PROGRAM = "benchmarks/bookkeeping.py"
_EXAMPLES = """examples:
  python benchmarks/bookkeeping.py
  python benchmarks/bookkeeping.py lwr4_1 rokae --seconds 2
"""
_POSES = "static_order"  # readings whose frame W is turned
#: What is known of a recording: EMPS's clocks differ by under a millisecond.
_KNOWN = {
    "emps_fit": "CommonDelay",
    "emps_pulses": "CommonDelay",
    _POSES: "GravityDirection",
}
_TITLE = "What is said of real logs that are written wrongly, by windows"
_ANSWERS = ("right", "silent", "wrong")
_DELAY = 0.03  # s
_CLOSE = 0.05  # of the rms of what was measured: put right but for rounding
_LOGS = (*RECORDED, _POSES)


@dataclasses.dataclass(frozen=True)
class Fault:
    """A way to write a log wrongly.

    Attributes:
        kind: what is counted together.
        name: of the hypothesis that it is, up to the first full stop.
        damage: puts it into the log.
    """

    kind: str
    name: str
    damage: Damage


def _joint_faults(joints: int, period: float) -> Iterator[Fault]:
    """Yields faults of a log of joint motion, sampled with a period [s]."""
    for i in range(joints):
        yield Fault("sign of one torque", "TorqueSign", scaled(-1.0, f"tau.{i}"))
    yield Fault("sign of all torques", "TorqueSign", scaled(-1.0, "tau"))
    for factor in (0.5, 180.0 / np.pi):
        of_one = scaled(factor, f"v.{joints // 2}")
        yield Fault("velocity of one joint", "VelocityFactor", of_one)
        yield Fault("velocity of all joints", "VelocityFactor", scaled(factor, "v."))
    yield Fault("delay of all torques", "CommonDelay", late(_rows(period), "tau"))
    swaps = [(i, i + 1) for i in range(joints - 1)] + [(0, joints - 1)] * (joints > 2)
    for i, j in swaps:
        order = np.arange(joints)
        order[[i, j]] = j, i
        yield Fault("two torques exchanged", "JointOrder", reordered(order))
    if joints > 2:
        for by in (1, -1):
            order = np.roll(np.arange(joints), by)
            yield Fault("all torques rotated", "JointOrder", reordered(order))
        backwards = np.arange(joints)[::-1]
        yield Fault("all torques reversed", "JointOrder", reordered(backwards))


def _sensor_faults(in_W: bool) -> Iterator[Fault]:
    """Yields faults of readings at rest, of a wrench that is in W or in S."""
    for axis in "xyz":
        damage = both(*(scaled(-1.0, f"wrench.{part}{axis}") for part in "ft"))
        yield Fault("sign of an axis", "WrenchAxes", damage)
    for axis in "xy":
        turn = Rotation.from_euler(axis, 90.0, degrees=True)
        yield Fault("world turned", "GravityDirection", _turned(turn, in_W))
    yield Fault("weight taken away", "WeightRemoved", _weightless(in_W))


def _orientations(columns: Columns) -> Rotation:
    names = [f"R_WS.q{i}" for i in "wxyz"]
    quaternions = np.column_stack([columns[name] for name in names])
    return Rotation.from_quat(quaternions, scalar_first=True)


def _turned(turn: Rotation, in_W: bool) -> Damage:
    """Returns what writes readings in another W: R_WS, and a wrench in W."""

    def _damage(columns: Columns) -> None:
        R_WS = turn * _orientations(columns)
        quaternions = R_WS.as_quat(scalar_first=True)
        columns.update(zip([f"R_WS.q{i}" for i in "wxyz"], quaternions.T, strict=True))
        for part in (WRENCH[:3], WRENCH[3:]) if in_W else ():
            names = [f"wrench.{axis}" for axis in part]
            vectors = turn.apply(np.column_stack([columns[n] for n in names]))
            columns.update(zip(names, vectors.T, strict=True))

    return _damage


def _weightless(in_W: bool) -> Damage:
    """Returns what takes away the weight that fits best: m g and c x m g in S."""

    def _damage(columns: Columns) -> None:
        names = [f"wrench.{axis}" for axis in WRENCH]
        R_WS = _orientations(columns)
        own = R_WS if in_W else Rotation.identity(len(R_WS))
        vectors = np.stack([columns[name] for name in names], axis=1).reshape(-1, 2, 3)
        wrench = np.stack([own.inv().apply(vectors[:, k]) for k in (0, 1)], axis=1)
        g_S = R_WS.inv().apply([0.0, 0.0, -9.81])
        A = np.zeros((len(g_S), 2, 3, 10))
        A[:, 0, :, 0] = g_S
        for axis in range(3):
            A[:, 1, :, 1 + axis] = np.cross(np.eye(3)[axis], g_S)
        A[..., 4:] = np.eye(6).reshape(2, 3, 6)
        fit = np.linalg.lstsq(A.reshape(-1, 10), wrench.reshape(-1), rcond=None)[0]
        left = wrench - A[..., :4] @ fit[:4]
        left = np.stack([own.apply(left[:, k]) for k in (0, 1)], axis=1)
        columns.update(zip(names, left.reshape(-1, 6).T, strict=True))

    return _damage


def _rows(period: float) -> int:
    return max(1, round(_DELAY / period))


def windows(log: Log, seconds: Sequence[float]) -> Iterator[tuple[str, Log]]:
    """Yields a log's contiguous windows of each length [s], and the whole of it."""
    yield "whole", log
    episode = log.episodes[0]
    if "time" not in episode or len(log.episodes) > 1:
        return
    time = episode["time"] - episode["time"][0]
    for length in seconds:
        for start in np.arange(0.0, time[-1] - length, length):
            rows = (time >= start) & (time < start + length)
            columns = {name: c[rows] for name, c in episode.columns.items()}
            cut = dataclasses.replace(episode, columns=MappingProxyType(columns))
            yield f"{length:g} s", dataclasses.replace(log, episodes=(cut,))


def faults(log: Log) -> list[Fault]:
    """Returns the faults that a log may have."""
    if log.header.kind == "static_wrench":
        return list(_sensor_faults(log.header.frames["wrench"] == "W"))
    period = float(np.median(np.diff(log.episodes[0]["time"])))
    return list(_joint_faults(len(log.header.joints), period))


def answer(right: LogModel, fault: Fault, log: Log, known: str) -> tuple[str, str]:
    """Returns whether a fault is found: right, silent or wrong; and what was said.

    Args:
        right: model of the log as it is.
        fault: that is put in.
        log: as it is.
        known: hypothesis that holds for the log as it is, or "".
    """
    ways = model_of([damaged(log, fault.damage)], ModelChoice()).bookkeeping()
    said = _said(ways)
    own = [way for way in ways if _is_put_right(way, right, fault)]
    others = [way for way in ways if way not in own and way.name != known]
    if others:
        return "wrong", said
    return ("right" if own else "silent"), said


def _is_put_right(way: Bookkeeping[LogModel], right: LogModel, fault: Fault) -> bool:
    """Returns whether a hypothesis undoes a fault."""
    if way.name.partition(".")[0] != fault.name:
        return False
    if fault.name == "WeightRemoved":
        return True
    if fault.name == "CommonDelay":
        delays = [e.delay for e in way.model.effects if isinstance(e, ArmDelay)]
        return abs(sum(delays) - _DELAY) < 0.5 * _DELAY
    change = _misfit(way.model) - _misfit(right)
    size = np.sqrt(np.mean(right.measurements.values**2))
    return bool(np.sqrt(np.mean(change**2)) < _CLOSE * size)


def _misfit(model: LogModel) -> NDArray[np.float64]:
    """Returns what nominal parameters leave (rows, channels)."""
    theta = nominal_values(model.parameters)
    return np.asarray(model.measurements.values - model.predictions(theta))


def measured(log: Log, known: str, seconds: Sequence[float]) -> Iterator[list[str]]:
    """Yields [fault, length, answer, what is said] of all windows of a log.

    Without a fault of all of them; with one, of the first of each length.
    """
    seen = set[str]()
    for length, part in windows(log, seconds):
        right = model_of([part], ModelChoice())
        ways = [way for way in right.bookkeeping() if way.name != known]
        yield ["none", length, "wrong" if ways else "right", _said(ways)]
        if length not in seen and known != "GravityDirection":
            for fault in faults(part):
                yield [fault.kind, length, *answer(right, fault, part, known)]
        seen.add(length)


def _said(ways: Sequence[Bookkeeping[LogModel]]) -> str:
    return ", ".join(f"{way.name}: {way.what}" for way in ways)


def _written(name: str, folder: Path) -> Log:
    """Returns a recording's log."""
    if name in RECORDED:
        return read_log(RECORDED[name].write(folder)[0])
    table = np.loadtxt(
        data_folder("cases") / name / "poses.csv", delimiter=",", skiprows=1
    )
    write_static_wrench(folder / "log", table[:, 1:5], table[:, 5:], "S", "weigh", {})
    return read_log(folder / "log")


def main(arguments: Sequence[str]) -> int:
    """Prints the table; returns the exit status."""
    parser = program.argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    parser.add_argument(
        "logs", nargs="*", default=list(_LOGS), help=f"of {', '.join(_LOGS)}"
    )
    parser.add_argument(
        "--seconds", type=float, nargs="*", default=[2.0, 5.0], help="of windows [s]"
    )
    add_results_argument(parser)
    options = parser.parse_args(arguments)
    counts: dict[tuple[str, str], Counter[str]] = {}
    for name in options.logs:
        with tempfile.TemporaryDirectory() as folder:
            log, known = _written(name, Path(folder)), _KNOWN.get(name, "")
            for kind, length, how, said in measured(log, known, options.seconds):
                counts.setdefault((kind, length), Counter())[how] += 1
                if how == "wrong":
                    print(f"{name} {length}, {kind}: {said}", flush=True)
    rows: list[tuple[Cell, ...]] = [
        (*of, *(count[how] for how in _ANSWERS)) for of, count in sorted(counts.items())
    ]
    columns = ("fault", "length", *_ANSWERS)
    print(markdown(columns, rows))
    write_result(options.results, _TITLE, columns, rows, _PROGRAM, arguments)
    return 0


if __name__ == "__main__":
    program.run(main)

"""Motor constants that are identified: of a real arm, and whether intervals hold.

With --real, those of the UR10e of ../shared/data, whose second recording carries
2.805 kg, beside the two sets that its authors state and the controller's. Without,
those of simulated arms: each with a payload and constants of its own, friction that the
URDF does not state, and noise that is correlated from row to row.
"""

import dataclasses
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType

import numpy as np
from answers import Answer, Count, add_arguments, complete, no_verdict, report
from changes import change, friction, simulated
from real_data import data_folder
from results import write_result

from drake_disasm.cell.parsing import movable_joints
from drake_disasm.common import program
from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import FlangePayload
from drake_disasm.logs import Episode, Log, read_log
from drake_disasm.logs.importing import (
    ImportProcessing,
    import_recordings,
    read_source,
    write_log,
)
from drake_disasm.logs.importing.field_map import parse_map
from sysid.motor_constants import (
    MotorConstants,
    constants_by_payload,
    constants_by_urdf,
)

_SEED = 60_000
_PROGRAM = "benchmarks/motor_constants.py"
_EXAMPLES = """examples:
  python benchmarks/motor_constants.py --real
  python benchmarks/motor_constants.py --urdf models/iiwa14/iiwa14.urdf --logs 20
"""
_PAYLOAD = 2.805  # kg
_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
_STATED = {
    "authors, first": (14.87, 13.26, 11.13, 10.62, 11.03, 11.47),
    "authors, from a fit": (10.00, 10.70, 8.46, 9.00, 9.48, 10.12),
}


def real_log(name: str, folder: Path) -> Log:
    """Returns a recording of the UR10e, with its motors' currents."""
    data = data_folder("ur10e")
    columns = {
        "q": {"from": [f"column_{i}" for i in range(1, 7)]},
        "current": {"from": [f"column_{i}" for i in range(13, 19)]},
    }
    fields = parse_map(
        {
            "kind": "joint_motion",
            "joints": [f"{joint}_joint" for joint in _JOINTS],
            "urdf": str(data / "ur10e.urdf"),
            "time": {"from": "column_0"},
            "columns": columns,
        }
    )
    source = read_source(data / f"{name}.csv")
    imported = import_recordings([source], fields, ImportProcessing())
    write_log(imported, [source], fields, folder / name, {})
    return read_log(folder / name)


def controller_constants() -> list[float]:
    """Returns constants by the controller's target currents and moments.

    By least squares: i = tau / k + a + b v + c sign(v).
    """
    table = np.loadtxt(data_folder("ur10e") / "unloaded.csv", delimiter=",")
    found = []
    for joint in range(6):
        v, current, moment = (table[:, k + joint] for k in (7, 19, 25))
        columns = np.column_stack([moment, np.ones_like(v), v, np.sign(v)])
        found.append(1.0 / np.linalg.lstsq(columns, current, rcond=None)[0][0])
    return found


def _cell(constants: MotorConstants, joint: int) -> str:
    interval = constants.intervals[joint]
    if interval is None:
        return "not identifiable"
    return f"{constants.values[joint]:.2f} ({interval[0]:.2f} to {interval[1]:.2f})"


def of_real_arm(arguments: Sequence[str], results: Path | None) -> None:
    """Prints, and writes, the constants of the UR10e."""
    with tempfile.TemporaryDirectory() as folder:
        logs = [real_log(name, Path(folder)) for name in ("unloaded", "loaded")]
        by_payload = constants_by_payload(logs, 1, _PAYLOAD)
        by_urdf = constants_by_urdf(logs[:1])
    controller = controller_constants()
    columns = ["joint", f"by {_PAYLOAD} kg", "by the URDF", "controller's", *_STATED]
    rows = [
        [
            joint,
            _cell(by_payload, i),
            _cell(by_urdf, i),
            f"{controller[i]:.2f}",
            *(f"{values[i]:.2f}" for values in _STATED.values()),
        ]
        for i, joint in enumerate(_JOINTS)
    ]
    for row in [columns, *rows]:
        print(" | ".join(row))
    title = "Motor constants of a UR10e [N m/A], 95 % intervals"
    write_result(results, title, columns, rows, _PROGRAM, arguments)


def in_currents(log: Log, constants: Sequence[float]) -> Log:
    """Returns a log with currents in place of torques."""

    def _episode(episode: Episode) -> Episode:
        kept = {n: v for n, v in episode.columns.items() if not n.startswith("tau.")}
        by_joint = zip(episode["tau"].T, constants, strict=True)
        kept |= {f"current.{i}": t / k for i, (t, k) in enumerate(by_joint)}
        return dataclasses.replace(episode, columns=MappingProxyType(kept))

    return dataclasses.replace(log, episodes=tuple(map(_episode, log.episodes)))


def answer(urdf: Path, number: int) -> Answer:
    """Returns the constants of a simulated arm by either basis, and the truth."""
    random = np.random.default_rng([_SEED, number])
    joints = movable_joints(str(urdf))
    rubs = friction(joints, random)
    [payload], _, _ = change("tool", rubs, random)
    assert isinstance(payload, FlangePayload)
    true = np.exp(random.uniform(np.log(1.0), np.log(20.0), len(joints))).tolist()
    seed = _SEED + 10 * number
    with tempfile.TemporaryDirectory() as folder:
        known = simulated(Path(folder, "reference"), urdf, rubs, seed)
        log = simulated(Path(folder, "newer"), urdf, rubs, seed + 1, [payload])
    logs = [in_currents(each, true) for each in (known, log)]
    found: Answer = {"mass": payload.mass, "true": true}
    for name, identify in (
        ("payload", partial(constants_by_payload, logs, 1, payload.mass)),
        ("urdf", partial(constants_by_urdf, logs[:1])),
    ):
        try:
            found[name] = dataclasses.asdict(identify())
        except DisasmError as error:
            found[name] = no_verdict("refused", str(error))
    return found


def _counts(arm: str, basis: str, answers: list[Answer]) -> list[Count]:
    """Returns how many constants are identified, and how many intervals hold."""
    joints = [
        {
            "true": true,
            "interval": interval,
            "ending": "identified" if interval else "not",
        }
        for each in answers
        for true, interval in zip(
            each["true"],
            each[basis].get("intervals") or [None] * len(each["true"]),
            strict=True,
        )
    ]
    known = [each for each in joints if each["interval"]]
    bounds = [(*each["interval"], each["true"]) for each in known]
    inside = [low < true < high for low, high, true in bounds]
    close = [high - low < 0.2 * true for low, high, true in bounds]
    name = f"{arm}, by {'a known payload' if basis == 'payload' else 'the URDF'}"
    return [
        Count(name, "constant is identified", len(known), joints),
        Count(name, "interval holds the truth", sum(inside), known),
        Count(name, "interval is within ±10 %", sum(close), known),
    ]


def main(arguments: Sequence[str]) -> int:
    """Prints the tables; returns the exit status."""
    parser = program.argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    parser.add_argument("--real", action="store_true", help="of the real UR10e")
    parser.add_argument("--urdf", type=Path, help="of a simulated arm")
    add_arguments(parser, 20, "motor_constants")
    args = parser.parse_args(arguments)
    if args.real == (args.urdf is not None):
        raise DisasmError("give either --real or --urdf FILE")
    if args.real:
        of_real_arm(arguments, args.results)
        return 0
    urdf = args.urdf.resolve()
    path = args.out / f"{urdf.stem}.jsonl"
    answers = complete(path, args.logs, partial(answer, urdf))
    counts = [c for b in ("payload", "urdf") for c in _counts(urdf.stem, b, answers)]
    title = f"Motor constants of a simulated {urdf.stem}"
    report(counts, title, _PROGRAM, arguments, args.results)
    return 0


if __name__ == "__main__":
    program.run(main)

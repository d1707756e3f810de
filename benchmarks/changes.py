"""What is said to have changed between simulated logs of an arm, and by how much.

A reference and a newer log of 15 s, each with a motion of its own; every joint has dry
and viscous friction that the URDF does not state; the noise is correlated from row to
row. In the newer log hangs a tool, or a camera; or a joint's friction is 30 % higher,
or its torque offset jumps within the log, or nothing has changed.
"""

import functools
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from answers import Answer, Count, add_arguments, complete, no_verdict, report, said

from drake_disasm.cell.parsing import movable_joints
from drake_disasm.common import program
from drake_disasm.common.arrays import Array
from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import (
    Effect,
    FlangePayload,
    JointCoulombFriction,
    JointViscousFriction,
    TorqueOffset,
)
from drake_disasm.logs import Log, LogHeader, LogWriter, flat_columns, read_log
from drake_disasm.scenario import Scenario
from sysid.effect_selection.changes import Changes, find_changes
from sysid.models.joint_motion import JointMotionModel
from sysid.models.regressor import ArmRegressor
from sysid.validation import null_logs

_SEED = 59_000
_RATE, _DURATION = 100.0, 15.0  # Hz, s
_HARMONICS = np.arange(1, 6) * 0.1  # Hz
_NOISE, _RHO = 0.01, 0.9  # of a joint's rms torque; from row to row
_PROGRAM = "benchmarks/changes.py"
_EXAMPLES = """examples:
  python benchmarks/changes.py models/iiwa14/iiwa14.urdf --logs 20
  python benchmarks/changes.py ../shared/data/ur10e/ur10e.urdf --kinds tool none
"""


def motion(
    joints: int, random: np.random.Generator, duration: float = _DURATION
) -> tuple[Array, ...]:
    """Returns time (n,) and q, v, vd (n, joints) of a sum of sines."""
    time = np.arange(0.0, duration, 1.0 / _RATE)
    w = 2.0 * np.pi * _HARMONICS
    phase = w[:, None, None] * time[None, :, None]
    a, b = random.normal(0.0, 0.25, (2, len(w), 1, joints)) / np.sqrt(w)[:, None, None]
    q = (a * np.sin(phase) + b * np.cos(phase)).sum(axis=0)
    v = (w[:, None, None] * (a * np.cos(phase) - b * np.sin(phase))).sum(axis=0)
    vd = (-(w[:, None, None] ** 2) * (a * np.sin(phase) + b * np.cos(phase))).sum(0)
    return time, q + random.uniform(-0.5, 0.5, joints), v, vd


@functools.cache
def noise_of(urdf: Path) -> Array:
    """Returns the noise (joints,) of an arm's torques, the same in all its logs."""
    joints = movable_joints(str(urdf))
    _, *states = motion(len(joints), np.random.default_rng(_SEED))
    tau = ArmRegressor(str(urdf), joints).torques(*states)
    return np.asarray(_NOISE * np.sqrt(np.mean(tau**2, axis=0)))


def friction(joints: Sequence[str], random: np.random.Generator) -> list[Effect]:
    """Returns the friction that the arm has anyway."""
    sizes = random.uniform(0.5, 3.0, (2, len(joints)))
    dry = [JointCoulombFriction(j, c) for j, c in zip(joints, sizes[0], strict=True)]
    wet = [JointViscousFriction(j, c) for j, c in zip(joints, sizes[1], strict=True)]
    return [*dry, *wet]


def change(
    kind: str, own: Sequence[Effect], random: np.random.Generator
) -> tuple[list[Effect], float, str]:
    """Returns the effects that are added, the row from which on, and a size's name."""
    if kind in ("tool", "camera"):
        mass = random.uniform(0.2, 3.0) if kind == "tool" else 0.15
        c = mass * random.uniform((-0.05, -0.05, 0.03), (0.05, 0.05, 0.12))
        return [FlangePayload(mass, *c)], 0.0, "FlangePayload.mass"
    joint = random.integers(len(own) // 2)
    if kind == "friction":
        rubs = own[joint]
        assert isinstance(rubs, JointCoulombFriction)
        more = JointCoulombFriction(rubs.joint, 0.3 * rubs.size)
        return [more], 0.0, f"JointCoulombFriction.{rubs.joint}.size"
    if kind == "offset":
        name = own[joint].joint  # type: ignore[attr-defined]
        offset = TorqueOffset(name, float(random.choice([-1, 1])) * 1.5)
        return [offset], random.uniform(0.3, 0.7), f"TorqueOffset.{name}.size"
    return [], 0.0, ""


def simulated(
    folder: Path, urdf: Path, effects: Sequence[Effect], seed: int,
    added: Sequence[Effect] = (), since: float = 0.0,
) -> Log:  # fmt: skip
    """Returns a log with effects, and others since a share of it."""
    random = np.random.default_rng(seed)
    joints = movable_joints(str(urdf))
    time, q, v, vd = motion(len(joints), random)
    columns = {"time": time, "q": q, "v": v, "vd": vd, "tau": np.zeros_like(q)}
    header = LogHeader("joint_motion", "simulated", {}, joints=joints, urdf=str(urdf))
    with tempfile.TemporaryDirectory() as scratch:
        with LogWriter(Path(scratch, "log"), header) as writer:
            writer.write_episode(flat_columns("joint_motion", columns))
        log = read_log(Path(scratch, "log"))
        parts = []
        for own in (effects, [*effects, *added]):
            model = JointMotionModel([log], scenario=Scenario(effects=list(own)))
            nominal = np.array([p.nominal for p in model.parameters])
            parts.append(model.predictions(nominal))
    is_after = np.arange(len(time)) >= since * len(time)
    tau = np.where(is_after[:, None], parts[1], parts[0])
    noise = null_logs.autoregressive(_RHO)(random, tau)
    columns["tau"] = tau + noise_of(urdf) * noise
    with LogWriter(folder, header) as writer:
        writer.write_episode(flat_columns("joint_motion", columns))
    return read_log(folder)


def answer(urdf: Path, kind: str, number: int) -> Answer:
    """Returns what is said of a case, with what was put in."""
    random = np.random.default_rng([_SEED, number])
    own = friction(movable_joints(str(urdf)), random)
    added, since, size = change(kind, own, random)
    seed = _SEED + 10 * number
    with tempfile.TemporaryDirectory() as folder:
        known = simulated(Path(folder, "reference"), urdf, own, seed)
        log = simulated(Path(folder, "newer"), urdf, own, seed + 1, added, since)
        put_in = {"kind": kind, "size": size, "hidden": repr(added), "since": since}
        try:
            found = find_changes(JointMotionModel([known, log]), 1)
        except DisasmError as error:
            return put_in | no_verdict("refused", str(error))
    return put_in | _said(found, size, added)


def _said(found: Changes, size: str, added: Sequence[Effect]) -> Answer:
    verdict = found.closed.verdict
    field = size.rpartition(".")[2]
    truth = float(getattr(added[0], field)) if added else float("nan")
    values = {v.name: (v.value, *v.interval) for v in verdict.values}
    low, high = values[size][1:] if size in values else (np.nan, np.nan)
    return {
        "ending": "changed" if verdict.names else "nothing",
        "names": [*verdict.confirmed, *verdict.ambiguous],
        "ties": [[tie.name for tie in own] for own in verdict.ties],
        "suggested": list(verdict.suggested),
        "truth": truth,
        "value": values.get(size),
        "covers": bool(low <= truth <= high),
        "onset": found.onset.row if found.onset else None,
        "leaves_more": found.leaves_more,
    }


def _counts(arm: str, kind: str, answers: list[Answer]) -> list[Count]:
    if kind == "none":
        named = sum(bool(each["names"]) for each in answers)
        return [Count(f"{arm}, nothing changed", "a change is named", named, answers)]
    whole = [each["size"].rpartition(".")[0] for each in answers]
    pairs = list(zip(answers, whole, strict=True))
    named = [name in said(each) for each, name in pairs]
    others = [bool(set(each["names"]) - {name}) for each, name in pairs]
    covered = [each["covers"] for each in answers if each["value"]]
    with_value = [each for each in answers if each["value"]]
    return [
        Count(f"{arm}, {kind}", "named", sum(named), answers),
        Count(f"{arm}, {kind}", "another change is named, too", sum(others), answers),
        Count(f"{arm}, {kind}", "interval holds the truth", sum(covered), with_value),
    ]


def main(arguments: Sequence[str]) -> int:
    """Judges the logs and prints the table; returns the exit status."""
    parser = program.argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    parser.add_argument("urdf", type=Path, help="of the arm")
    kinds = ("none", "tool", "camera", "friction", "offset")
    parser.add_argument(
        "--kinds", nargs="+", choices=kinds, default=kinds, help="(default: all)"
    )
    add_arguments(parser, 20, "changes")
    args = parser.parse_args(arguments)
    counts = []
    for kind in args.kinds:
        path = args.out / f"{args.urdf.stem}_{kind}.jsonl"
        found = complete(path, args.logs, partial(answer, args.urdf.resolve(), kind))
        counts += _counts(args.urdf.stem, kind, found)
    title = "Changes between simulated logs"
    report(counts, title, _PROGRAM, arguments, args.results)
    return 0


if __name__ == "__main__":
    program.run(main)

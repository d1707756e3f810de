"""What close-loop says of an iiwa's commanded and measured positions, without torques.

The logs are simulated, in steps five times finer than the model's, each with other
hidden effects. Prints the verdict on each, and how long it took.
"""

import time as clock
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from answers import Answer, complete, of_verdict
from results import add_results_argument, write_result

from drake_disasm.common import program
from drake_disasm.effects import (
    ArmEffect,
    ArmTilt,
    FlangePayload,
    JointBacklash,
    JointCoulombFriction,
    JointElasticity,
    JointViscousFriction,
)
from drake_disasm.logs import Log, LogHeader, LogWriter, flat_columns, read_log
from sysid.effect_selection.close_loop import close_loop
from sysid.models.response.drive import Drive, Inputs
from sysid.models.response.model import JointResponseModel
from sysid.models.response.near_motion import Bodies
from sysid.models.response.rigid_bodies import RigidBodies
from sysid.models.response.segments import Segment
from sysid.models.response.simulation import Arm, ParameterSet, simulate

JOINTS = tuple(f"iiwa_joint_{i}" for i in range(1, 8))
URDF = "package://disasm_models/iiwa14/iiwa14.urdf"
STIFFNESS = np.array([3000.0, 3000.0, 2500.0, 2500.0, 1500.0, 1000.0, 600.0])
DAMPING = np.array([120.0, 120.0, 90.0, 80.0, 40.0, 25.0, 12.0])
DELAY = 0.008
NOISE, QUANTUM = 3e-5, 2e-5  # rad
POSTURE = np.array([0.0, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0])
DURATION, PERIOD = 15.0, 0.01  # s
_PROGRAM = "benchmarks/seven_joints.py"
_EXAMPLES = """examples:
  python benchmarks/seven_joints.py                    # 10 minutes on one core
  python benchmarks/seven_joints.py --only payload tilt
"""
_TITLE = "Verdicts on an arm of seven joints, by its positions"
_COLUMNS = ("hidden effect", "ending", "effects", "time [s]")


def goals(time: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Returns commanded positions (n, 7): a Fourier series that begins at rest."""
    goal = np.zeros((len(time), len(JOINTS)))
    for k in (1, 2, 3, 5, 8):
        size, phase = random.normal(0.0, 0.25 / k**0.5, 7), random.uniform(0.0, 6.28, 7)
        angle = 2.0 * np.pi * k * time[:, None] / DURATION
        goal += size * (np.sin(angle + phase) - np.sin(phase))
    share = np.clip(time / 2.0, 0.0, 1.0)[:, None]
    return POSTURE + share**2 * (3.0 - 2.0 * share) * goal


def write_log(folder: Path, *effects: ArmEffect, seed: int = 0) -> Log:
    """Writes what an iiwa with effects does behind its drives, and reads it."""
    random = np.random.default_rng(seed)
    time = np.arange(round(DURATION / PERIOD) + 1, dtype=np.float64) * PERIOD
    goal, one = goals(time, random), np.ones((len(time), len(JOINTS)))
    bodies = RigidBodies(URDF, JOINTS)
    start = np.array(POSTURE - bodies.holding(POSTURE[None])[0] / STIFFNESS)
    inputs = Inputs(goal, 0.0 * one, one, one, one)
    segment = Segment(0.0, start, np.zeros(7), time, inputs, np.zeros(7))
    own = ParameterSet(Drive(STIFFNESS, DAMPING, np.inf), DELAY, effects)
    steps = 10 * (len(time) - 1)
    motion = simulate(Arm(JOINTS, Bodies(bodies, False)), [own], [segment], steps, 1e-3)
    q = motion.q[::10, 0, 0]
    q = np.round((q + random.normal(0.0, NOISE, q.shape)) / QUANTUM) * QUANTUM
    header = LogHeader("joint_response", "swing", {}, joints=JOINTS, urdf=URDF)
    with LogWriter(folder, header) as writer:
        table = {"time": time, "q_commanded": goal, "q": q}
        writer.write_episode(flat_columns("joint_response", table))
    return read_log(folder)


#: What is hidden, by name, and the seed of its motion and noise.
HIDDEN: dict[str, tuple[tuple[ArmEffect, ...], int]] = {
    "nothing": ((), 1),
    "payload": ((FlangePayload(mass=1.5, cy=0.02, cz=0.12),), 2),
    "friction": (
        (
            JointCoulombFriction(JOINTS[1], 6.0, 0.01),
            JointCoulombFriction(JOINTS[3], 4.0, 0.01),
            JointViscousFriction(JOINTS[5], 3.0),
        ),
        3,
    ),
    "tilt": ((ArmTilt(rx=0.03, ry=-0.02),), 4),
    "a gear that yields": ((JointElasticity(JOINTS[1], 3e-4),), 5),
    "play": ((JointBacklash(JOINTS[0], 4e-3, 1.0),), 6),
}


def verdict(name: str, folder: Path) -> Answer:
    """Returns what closing the loop says of a log, and how long it took [s]."""
    effects, seed = HIDDEN[name]
    log = write_log(folder, *effects, seed=seed)
    begin = clock.perf_counter()
    closed = close_loop(JointResponseModel([log]))
    took = round(clock.perf_counter() - begin)
    return of_verdict(closed.verdict) | {"text": closed.text, "s": took}


def _in_words(found: Answer) -> str:
    """Returns effects, with those that are ambiguous with them, and suggested ones."""
    pairs = zip(found["names"], found["ties"], strict=True)
    named = [" or ".join([name, *ties]) for name, ties in pairs]
    if found["suggested"]:
        named.append(f"suggested: {', '.join(found['suggested'])}")
    return "; ".join(named) or "-"


def _numbered(name: str, folder: Path, _: int) -> Answer:
    return verdict(name, folder)


def main(arguments: Sequence[str]) -> int:
    """Prints the verdict on each log, and how long it took."""
    parser = program.argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    parser.add_argument(
        "--only", nargs="+", choices=HIDDEN, default=list(HIDDEN), metavar="NAME",
        help=f"of {', '.join(HIDDEN)} (default: all)",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, default=Path("out/seven_joints"), metavar="DIR",
        help="keeps logs and verdicts; a run that was stopped goes on from there "
        "(default: out/seven_joints)",
    )  # fmt: skip
    add_results_argument(parser)
    args = parser.parse_args(arguments)
    rows = []
    for name in args.only:
        log, kept = args.out / name, args.out / f"{name}.jsonl"
        [found] = complete(kept, 1, partial(_numbered, name, log))
        print(f"{name}: {found['s']} s\n{found['text']}\n", flush=True)
        rows.append([name, found["ending"], _in_words(found), found["s"]])
    write_result(args.results, _TITLE, _COLUMNS, rows, _PROGRAM, arguments)
    return 0


if __name__ == "__main__":
    program.run(main)

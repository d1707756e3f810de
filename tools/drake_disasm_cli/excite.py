"""Designs a motion that shows an arm's parameters, and the effects that you name.

Joint positions are Fourier series that begin and end at rest in the same posture,
chosen for the least uncertainty of the base parameters and of the effects
(D-optimality), within the URDF's limits of position, velocity, acceleration and torque,
and without collisions of the arm with itself. Play motion.csv on the robot, record
joint positions and torques, and import them by `drake-disasm import-log`.

The intervals are those of white noise at every row; real residuals are slower, and
give wider ones.
"""

import argparse
import contextlib
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from drake_disasm.cell.parsing import movable_joints
from drake_disasm.common import options, program
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import write_text
from drake_disasm.free_motion.arm_limits import CollisionFreeSpace, JointLimits
from drake_disasm.free_motion.cell_urdf import cell_urdf
from drake_disasm.scenario import load_scenario
from sysid.experiment_design.design import DesignSettings, design_motion
from sysid.experiment_design.information import ArmExperiment, arm_effects
from sysid.experiment_design.output import TABLE, summary, write_design

_URDF = "arm.urdf"  # of a cell, beside the motion
_EXAMPLES = """examples:
  drake-disasm excite --urdf arm.urdf --out out/motion
  drake-disasm excite --urdf package://disasm_models/iiwa14/iiwa14.urdf \\
      --floor 0.1 --effects JointCoulombFriction JointViscousFriction --out out/motion
  drake-disasm excite --scenario removal --out out/cell_motion
                                  for the cell: see `drake-disasm play-motion`
  drake-disasm excite --urdf arm.urdf --separate JointCoulombFriction \\
      JointStribeckFriction --out out/motion
                                  for a verdict that can't tell these two apart
  drake-disasm excite --urdf arm.urdf --duration 10 --harmonics 8 --margin 0.3 \\
      --out out/motion                     shorter, livelier, farther from limits
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm excite", __doc__, _EXAMPLES)
    add = parser.add_argument
    arm = parser.add_mutually_exclusive_group(required=True)
    arm.add_argument("--urdf", metavar="FILE", help="that describes the arm")
    arm.add_argument(
        "--scenario",
        metavar="NAME|FILE",
        help="the cell's arm instead, with its tool, which keeps off the bench; its "
        "URDF is written beside the motion",
    )
    add("--out", type=Path, required=True, metavar="DIR", help="folder for the motion")
    add(
        "--joints",
        nargs="+",
        default=[],
        metavar="NAME",
        help="that move (default: all that the URDF has)",
    )
    add(
        "--effects",
        nargs="+",
        default=["JointCoulombFriction", "JointViscousFriction"],
        metavar="EFFECT",
        help="effects to show beside the base parameters, each at every joint: "
        f"{', '.join(arm_effects())} (default: dry and viscous friction)",
    )
    add(
        "--separate",
        nargs=2,
        metavar="EFFECT",
        help="two effects that the motion is to tell apart, before it is to show all "
        "else: rivals of a verdict, say",
    )
    _add_motion_arguments(add)
    _add_limit_arguments(add)
    add(
        "--iterations",
        type=options.positive,
        default=30,
        metavar="N",
        help="of the search; more is better, and takes longer (default: 30)",
    )
    add("--seed", type=options.seed, default=0, metavar="S", help="(default: 0)")
    return parser.parse_args(arguments)


def _add_motion_arguments(add: Callable[..., object]) -> None:
    add(
        "--duration",
        type=options.above_zero,
        default=20.0,
        metavar="S",
        help="of one period (default: 20)",
    )
    add(
        "--harmonics",
        type=options.positive,
        default=5,
        metavar="N",
        help="of the series: 3 at least (default: 5)",
    )
    add(
        "--rate",
        type=options.above_zero,
        default=200.0,
        metavar="HZ",
        help="of the table, and of the recording (default: 200)",
    )
    add(
        "--torque-noise",
        type=options.above_zero,
        default=0.01,
        metavar="SHARE",
        help="of each joint's torque limit, for the intervals (default: 0.01)",
    )


def _add_limit_arguments(add: Callable[..., object]) -> None:
    add(
        "--margin",
        type=options.share,
        default=0.1,
        metavar="SHARE",
        help="of each limit that is left free (default: 0.1)",
    )
    add(
        "--acceleration",
        type=options.above_zero,
        default=5.0,
        metavar="RAD/S2",
        help="limit of joints whose URDF states none (default: 5)",
    )
    add(
        "--clearance",
        type=options.nonnegative,
        default=0.02,
        metavar="M",
        help="of links from each other, at least (default: 0.02)",
    )
    add(
        "--floor",
        type=float,
        metavar="M",
        help="height that no link's origin may be below (default: none)",
    )


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    if args.harmonics < 3:
        raise DisasmError(
            "--harmonics: two of them end at rest only by resting; give 3"
        )
    if args.separate and args.separate[0] == args.separate[1]:
        raise DisasmError("--separate: an effect can't be told from itself; name two")
    if args.margin >= 0.5:
        raise DisasmError("--margin: 0.5 leaves nothing at either end; give less")
    with _arm(args) as urdf:
        _design(args, arguments, urdf)
    return 0


def _design(args: argparse.Namespace, arguments: Sequence[str], urdf: str) -> None:
    """Designs the motion of a URDF's arm, and writes it."""
    joints = tuple(args.joints or movable_joints(urdf))
    limits = JointLimits.of_urdf(urdf, joints, args.acceleration, args.margin)
    workspace = CollisionFreeSpace(urdf, joints, limits, args.clearance)
    if not workspace.has_geometry:
        print("the URDF has no collision geometry: collisions are not looked for")
    noise = args.torque_noise * np.array(limits.effort)
    separate = args.separate and tuple(args.separate)
    experiment = ArmExperiment(
        urdf, joints, args.effects, noise, args.duration, separate
    )
    settings = DesignSettings(
        duration=args.duration,
        harmonics=args.harmonics,
        rate=args.rate,
        clearance=args.clearance,
        floor=args.floor,
        iterations=args.iterations,
        seed=args.seed,
    )
    with program.ProgressBar(unit="step") as progress:
        design = design_motion(experiment, limits, workspace, settings, progress)
    provenance = program.provenance("drake-disasm excite", arguments, args.seed)
    write_design(design, experiment, limits, args.rate, args.out, provenance)
    if args.scenario:
        write_text(args.out / _URDF, Path(urdf).read_text())
    print("\n".join(summary(design, experiment)))
    print(f"motion: {args.out / TABLE}")


@contextlib.contextmanager
def _arm(args: argparse.Namespace) -> Iterator[str]:
    """Yields the URDF of the arm; that of a cell is a file for as long as it takes."""
    if args.urdf:
        yield args.urdf
        return
    text = cell_urdf(load_scenario(args.scenario))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / _URDF
        write_text(path, text)
        yield str(path)

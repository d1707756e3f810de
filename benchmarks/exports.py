"""Robots' files of arms that closing the loop identified, read again.

The KUKA LWR 4+ and the UR10e of ../shared/data, and a simulated iiwa with friction and
a tool that its URDF does not state. Writes each arm's files, and the difference of its
URDF to the original, into --out.
"""

import argparse
import difflib
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from changes import friction, simulated
from motor_constants import real_log
from real_data import MissingDataError, write_arm, write_motion
from results import add_results_argument, write_result

from drake_disasm.cell.parsing import movable_joints
from drake_disasm.common import program
from drake_disasm.common.files import make_folder, write_text
from drake_disasm.common.resources import model_path
from drake_disasm.effects import FlangePayload
from drake_disasm.logs import Log, read_log
from sysid.effect_selection.close_loop import close_loop
from sysid.export import FORMATS, Exports, make_exports
from sysid.models.from_logs import ModelChoice, model_of
from sysid.motor_constants import given_constants

_PROGRAM = "benchmarks/exports.py"
_EXAMPLES = """examples:
  python benchmarks/exports.py
  python benchmarks/exports.py --arms iiwa14 --out out/exports
"""
_SEED = 59_500
_IIWA = Path(__file__).parents[1] / "models" / "iiwa14" / "iiwa14.urdf"
#: Of the UR10e's controller, from its target currents and moments [N m/A].
_CONSTANTS = (11.70, 11.99, 9.78, 10.76, 9.93, 10.93)
_COLUMNS = (
    *("arm", "identified base parameters", "of the way to the 95 % edge"),
    *("torque moves by [%]", "Drake, URDF [%]", "Drake, SDF [%]", "MuJoCo, MJCF [%]"),
    *("no file holds [%]", "lines of the URDF that differ", "lines"),
)


def _lwr4(folder: Path) -> Log:
    return read_log(write_motion(1, folder / "log", write_arm(folder / "lwr4.urdf")))


def _ur10e(folder: Path) -> Log:
    log = real_log("unloaded", folder)
    return given_constants(log.header.joints, _CONSTANTS).torques([log])[0]


def _iiwa14(folder: Path) -> Log:
    random = np.random.default_rng(_SEED)
    rubs = friction(movable_joints(str(_IIWA)), random)
    tool = FlangePayload(1.2, 0.02, 0.0, 0.09)
    return simulated(folder / "log", _IIWA, [*rubs, tool], _SEED)


_ARMS: dict[str, Callable[[Path], Log]] = {
    "lwr4": _lwr4,
    "ur10e": _ur10e,
    "iiwa14": _iiwa14,
}


def _difference(original: Path, exports: Exports) -> list[str]:
    """Returns the lines in which the exported URDF differs from the original."""
    name = next(n for n in exports.files if n.endswith(".urdf"))
    texts = (original.read_text(), exports.files[name].decode())
    lines = [text.splitlines(keepends=True) for text in texts]
    return list(difflib.unified_diff(*lines, original.name, name, n=0))


def row_of(arm: str, out: Path) -> list[str]:
    """Writes an arm's files; returns what is said of it."""
    with tempfile.TemporaryDirectory() as folder:
        log = _ARMS[arm](Path(folder))
        closed = close_loop(model_of([log], ModelChoice(fixed=True)))
        exports = make_exports(closed, list(FORMATS))
        original = model_path(exports.arm.urdf)
        difference = _difference(original, exports)
        lines = len(original.read_text().splitlines())
    make_folder(out / arm)
    exports.write(out / arm)
    write_text(out / arm / "urdf.diff", "".join(difference))
    said, trips = exports.to_mapping(), exports.trips
    trip = trips["urdf"]
    removed = sum(x[0] == "-" and not x.startswith("---") for x in difference)
    return [
        arm,
        "kept" if said["base_parameters_are_exact"] else "no physical arm has them",
        f"{said['distance_in_joint_interval']:.2f}",
        f"{100 * trip.moved / trip.torque:.2g}",
        *(f"{100 * trips[kind].share:.1g}" for kind in ("urdf", "sdf", "mjcf")),
        f"{100 * trip.left_out / trip.torque:.2g}",
        str(removed),
        str(lines),
    ]


def main(arguments: Sequence[str]) -> int:
    """Exports the arms and prints the table; returns the exit status."""
    parser = program.argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    add: Callable[..., argparse.Action] = parser.add_argument
    add("--arms", nargs="+", choices=_ARMS, default=list(_ARMS), help="(default: all)")
    add("--out", type=Path, default=Path("out", "exports"), help="for the files")
    add_results_argument(parser)
    args = parser.parse_args(arguments)
    rows = []
    for arm in args.arms:
        try:
            rows.append(row_of(arm, args.out))
        except MissingDataError as error:
            print(f"{arm}: left out: {error}")
            continue
        print(" | ".join(rows[-1]), flush=True)
    title = "Files of identified arms, read again on held-out rows"
    write_result(args.results, title, _COLUMNS, rows, _PROGRAM, arguments)
    return 0


if __name__ == "__main__":
    program.run(main)

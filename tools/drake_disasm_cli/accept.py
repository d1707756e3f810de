"""Says whether to put a policy on the robot: whether its corrected twin accepts it.

Runs each policy greedily on the twin that `close-loop` corrected by a log of the robot:
at the verdict's values, and on draws over the verdict's 95 % intervals. A policy is
accepted if it does the task in all of them, within the limits of force and torque. The
default of 29 draws shows 90 % success with 95 % confidence. Prints the policies, the
best first, and writes `result.json` and a report that opens offline. What the verdict
leaves open is said with the answer. After Ctrl-C the same command resumes.

Exit status: 0 if a policy is accepted, 3 if none is, 2 for input that can't be used.
"""

import argparse
import shutil
from collections.abc import Sequence
from pathlib import Path

from drake_disasm.common import options, program
from drake_disasm.common.files import make_folder, write_json, write_text
from drake_disasm_cli import common
from sysid.acceptance import DRAWS, CorrectedTwin, accept
from sysid.acceptance.words import as_text, to_mapping
from sysid.report import acceptance_page

EXIT_REFUSED = 3

_EPISODES = "episodes"  # that are finished, for a run that is stopped
_EXAMPLES = """examples:
  drake-disasm accept --policy admittance --closed out/closed
  drake-disasm accept --policy out/first/seed_000/policy.npz straight \\
      --closed out/closed
  drake-disasm accept --policy my_policy.py:Mine --closed out/closed --draws 59
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm accept", __doc__, _EXAMPLES)
    add = parser.add_argument
    common.add_policies_argument(add)
    add(
        "--closed",
        required=True,
        type=Path,
        metavar="DIR",
        help="output of close-loop on transitions of the robot's cell",
    )
    add(
        "--draws",
        type=options.positive,
        default=DRAWS,
        metavar="N",
        help=f"over the verdict's intervals (default: {DRAWS}; 59 show 95 %% success)",
    )
    add(
        "--seed",
        type=options.seed,
        default=0,
        help="of the first draw; the next ones count on (default: 0)",
    )
    common.add_import_argument(parser)
    common.add_workers_argument(parser)
    add("--out", type=Path, metavar="DIR", help="(default: accept in --closed)")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    twin, out = CorrectedTwin.read(args.closed), args.out or args.closed / "accept"
    origin = program.provenance("drake-disasm accept", arguments, args.seed)
    with program.ProgressBar(unit="episode") as progress:
        judged = accept(
            args.policy,
            twin,
            args.draws,
            args.seed,
            args.workers,
            out / _EPISODES,
            progress,
        )
    make_folder(out)
    write_json(out / "result.json", to_mapping(judged, twin) | {"provenance": origin})
    write_text(out / "report.html", acceptance_page(judged, twin, origin))
    shutil.rmtree(out / _EPISODES, ignore_errors=True)
    print(as_text(judged, twin))
    print(f"report: {out / 'report.html'}")
    return 0 if judged[0].is_accepted else EXIT_REFUSED

"""Draws the learning curves of several trainings into one figure.

Lines are interquartile means over the seeds, bands their bootstrap 95 % intervals.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from drake_disasm.common import program
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import make_folder
from drake_disasm.learning.learning_curve import plot_learning_curves
from drake_disasm.learning.run import read_episodes

_EXAMPLES = """example:
  drake-disasm plot-training "TD3=out/td3" "SAC=out/sac" --out out/compared.png
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm plot-training", __doc__, _EXAMPLES)
    parser.add_argument(
        "trainings",
        nargs="+",
        metavar="[LABEL=]DIR",
        help="what `drake-disasm train` wrote; the label is the folder's name if not "
        "given",
    )
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="a PNG")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    trainings = dict(_labelled(text) for text in args.trainings)
    make_folder(args.out.parent)
    plot_learning_curves(trainings, args.out)
    print(f"figure: {args.out}")
    return 0


def _labelled(text: str) -> tuple[str, list[list[dict[str, Any]]]]:
    """Returns the label and the episodes of each finished seed."""
    label, separator, name = text.rpartition("=")
    folder = Path(name)
    paths = sorted(folder.glob("seed_*/episodes.csv"))
    if not paths:
        raise DisasmError(
            f"{folder}: no seed_*/episodes.csv in it; name a folder that "
            "`drake-disasm train` has finished a seed in"
        )
    return (label if separator else folder.name), [read_episodes(p) for p in paths]

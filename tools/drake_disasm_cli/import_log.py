"""Makes a log of what other programs recorded: tables, bags, datasets.

Reads CSV, XLSX, NPZ, NPY, MATLAB, Parquet, LeRobot datasets, ROS 1 and ROS 2 bags and
MCAP. What is what is guessed from names, metadata and message types, or said by a small
YAML map; --show prints every channel with its use or why it has none, and a guessed map
can be saved and edited. Joints are matched with the URDF's by name.

Joint motion is brought to one even time line and filtered without phase shift, by one
filter for all columns, whose cut-off is chosen from the data's spectrum; velocities and
accelerations are the filter's own derivatives. All that was done stands in the log's
provenance and is printed. --out also gets import.png: the spectrum and the filter.
"""

import argparse
import dataclasses
import math
from collections.abc import Callable, Sequence
from pathlib import Path

from drake_disasm.cell.parsing import movable_joints
from drake_disasm.common import options, program
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import write_text
from drake_disasm.common.resources import model_path
from drake_disasm.logs import KINDS
from drake_disasm.logs.header import HEADER_NAME, read_header
from drake_disasm.logs.importing import (
    FieldMap,
    ImportProcessing,
    Known,
    NoGuessError,
    Source,
    guessed_map,
    import_recordings,
    map_to_fill_in,
    read_map,
    read_source,
    write_log,
)
from drake_disasm.logs.importing.description import described, joint_words, summary
from drake_disasm.logs.importing.joining import WAYS, joined
from drake_disasm.logs.importing.lerobot import calibrated
from drake_disasm.logs.importing.plots import plot_import
from drake_disasm.logs.importing.presets import PRESETS
from drake_disasm.logs.importing.usage import without_torques

_EXAMPLES = """examples:
  drake-disasm import-log run.npz --show            what is in it, and the guess
  drake-disasm import-log run.npz --urdf arm.urdf --out out/log
  drake-disasm import-log run.csv --save-map map.yaml --show      then edit it
  drake-disasm import-log run.csv --map map.yaml --out out/from_table
  drake-disasm import-log run.npz --urdf arm.urdf --cutoff 12 --out out/filtered
  drake-disasm import-log run.csv --preset fri --urdf arm.urdf --out out/fri
  drake-disasm import-log q.csv tau.csv --join time --out out/joined
then:
  drake-disasm check-log --log out/log
  drake-disasm close-loop --log out/log --out out/closed
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm import-log", __doc__, _EXAMPLES)
    add = parser.add_argument
    add(
        "sources",
        nargs="+",
        type=Path,
        metavar="SOURCE",
        help="a file, FILE.xlsx:SHEET, or the folder of a ROS 2 bag or a LeRobot "
        "dataset; several become episodes of one log",
    )
    add(
        "--kind",
        default="joint_motion",
        choices=sorted(KINDS),
        help="of log (default: joint_motion; joint_torque_static: torques at rest; "
        "joint_response: commanded and measured positions; contact: a sensor's wrench "
        "in any task; transitions need a map)",
    )
    add(
        "--join",
        choices=WAYS,
        help="the files are columns of one recording, joined at the same times, or row "
        "by row (default: they are episodes)",
    )
    add("--out", type=Path, metavar="DIR", help="folder of the log")
    _add_map_arguments(add)
    _add_processing_arguments(add)
    return parser.parse_args(arguments)


def _add_map_arguments(add: Callable[..., object]) -> None:
    add(
        "--show",
        action="store_true",
        help="print what is in the sources and the map, and stop",
    )
    add("--map", type=Path, metavar="FILE", help="what is what (default: guessed)")
    add(
        "--preset",
        choices=list(PRESETS),
        help="what recorded it: "
        + "; ".join(f"{name}: {preset.about}" for name, preset in PRESETS.items()),
    )
    add(
        "--calibration",
        default="",
        metavar="FILE|degrees",
        help="of LeRobot's motors (.../calibration/robots/TYPE/ID.json), whose ranges "
        "its normalised units are of; or what it recorded in their place",
    )
    add("--save-map", type=Path, metavar="FILE", help="write the map, to edit it")
    add(
        "--urdf",
        default="",
        metavar="FILE",
        help="that describes the arm (default: of the log.yaml beside a table of ours)",
    )
    add(
        "--joints",
        nargs="+",
        default=[],
        metavar="NAME",
        help="names of the joints, in the order of the columns (default: the URDF's)",
    )
    add(
        "--rate",
        type=options.above_zero,
        metavar="HZ",
        help="rows a second, in place of the recorded times",
    )
    add(
        "--accept-left-out",
        action="store_true",
        help="import though torques, or more than a tenth of the rows, are left out",
    )
    add("--task", metavar="NAME", help="name of the task (default: recorded)")


def _add_processing_arguments(add: Callable[..., object]) -> None:
    add(
        "--cutoff",
        type=_cutoff,
        metavar="HZ|none",
        help="of the low-pass filter (default: chosen from the spectrum)",
    )
    add(
        "--decimate",
        type=options.positive,
        metavar="N",
        help="keep every Nth row (default: what the cut-off asks for)",
    )
    add(
        "--between",
        nargs=2,
        type=float,
        default=[0.0, math.inf],
        metavar=("S", "S"),
        help="keep what was recorded between these times since its begin",
    )
    add(
        "--keep-stamps",
        action="store_true",
        help="take stamps as they are, though they are those of arrival",
    )
    add(
        "--keep-shifts",
        action="store_true",
        help="don't take away shifts in time between topics of a bag",
    )


def _cutoff(text: str) -> float:
    return math.inf if text == "none" else options.above_zero(text)


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    if not (args.show or args.out or args.save_map):
        raise DisasmError("--out: give a folder for the log, or --show to look first")
    sources = _sources(args)
    if not args.show:
        for note in (note for source in sources for note in source.notes):
            print(note)
    try:
        fields = _fields(args, sources)
    except NoGuessError as error:
        if not (args.show or args.save_map):
            raise
        _show_without_map(args, sources, error)
        return 0
    if args.save_map:
        write_text(args.save_map, fields.to_yaml())
        print(f"map: {args.save_map}")
    if args.show:
        print("\n".join(described(s, fields.kind, fields) for s in sources))
        print(f"map:\n{_indented(fields.to_yaml())}")
    if words := joint_words(fields):
        print(program.with_options(words))
    if args.show or not args.out:
        return 0
    imported = import_recordings(
        sources,
        fields,
        ImportProcessing(args.cutoff, args.decimate, tuple(args.between)),
        shifts=not args.keep_shifts,
        accept=args.accept_left_out,
        even=not args.keep_stamps,
    )
    write_log(
        imported,
        sources,
        fields,
        args.out,
        program.provenance("drake-disasm import-log", arguments, 0),
    )
    if imported.done:
        plot_import(imported, args.out / "import.png")
    print(program.with_options(summary(imported)))
    if words := without_torques(sources[0], fields):
        print(program.with_options(words))
    print(f"log: {args.out}")
    return 0


def _show_without_map(
    args: argparse.Namespace, sources: Sequence[Source], error: NoGuessError
) -> None:
    """Shows what is in a recording whose map is not guessed; writes one to fill in."""
    if args.save_map:
        write_text(args.save_map, map_to_fill_in(args.kind, sources[0]))
        print(f"map to fill in: {args.save_map}")
    if args.show:
        print("\n".join(described(source, args.kind) for source in sources))
    print(program.with_options(f"no map is guessed: {error.reason}"))


def _sources(args: argparse.Namespace) -> list[Source]:
    """Returns the recordings, with the names that a preset gives them."""
    sources = [read_source(path) for path in args.sources]
    if args.join:
        preset = PRESETS[args.preset] if args.preset else None
        sources = [joined(sources, args.join, Known(rate=args.rate, preset=preset))]
    if args.preset:
        return [PRESETS[args.preset].labelled(source) for source in sources]
    return sources


def _fields(args: argparse.Namespace, sources: Sequence[Source]) -> FieldMap:
    """Returns the map that is given, or guessed; the command line comes first."""
    urdf = args.urdf or ("" if args.map else _urdf_of_log(args.sources[0]))
    if urdf:
        model_path(urdf, "give a file that is there by --urdf")
    joints = args.joints or (movable_joints(urdf) if urdf else [])
    if args.map:
        fields = read_map(args.map)
    else:
        preset = PRESETS[args.preset] if args.preset else None
        known = Known(joints, bool(args.joints), urdf, args.rate, preset)
        fields = guessed_map(sources[0], args.kind, known)
    changes = {"urdf": args.urdf, "joints": tuple(args.joints), "task": args.task}
    fields = dataclasses.replace(fields, **{n: v for n, v in changes.items() if v})
    if args.rate:
        fields = dataclasses.replace(fields, time=None, time_unit="s", rate=args.rate)
    if args.calibration:
        fields = calibrated(fields, sources[0], args.calibration)
    return fields


def _urdf_of_log(source: Path) -> str:
    """Returns the URDF that the log of a table names; "" for a table of no log."""
    folder = source.parent
    if source.suffix != ".parquet" or not (folder / HEADER_NAME).exists():
        return ""
    return read_header(folder).urdf or ""


def _indented(text: str) -> str:
    return "".join(f"  {line}" for line in text.splitlines(keepends=True))

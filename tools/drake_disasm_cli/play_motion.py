"""Plays a motion of the joints on the cell, simulated or real, and records it.

MOTION is a table as `drake-disasm excite` writes it: time, q.0, q.1, ... in SI. The
bolt is taken out of the groove, the arm goes to where the motion begins and plays it
once. What was commanded and measured becomes a log of kind `joint_response`, with the
URDF of arm and tool beside it. Torques are in it, too: import it as `joint_motion`, and
`drake-disasm close-loop` finds the arm's friction in a minute.

Nothing looks out for what the arm could run into: design the motion by --scenario, and
watch it in the simulated cell first. The arm stays where the motion ends.
"""

import argparse
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path

from drake_disasm.cell.arm_model import arm_joints
from drake_disasm.common import program
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import write_text
from drake_disasm.free_motion.cell_urdf import cell_urdf
from drake_disasm.free_motion.playing import MotionPlayer
from drake_disasm.free_motion.recording import URDF, response_header
from drake_disasm.free_motion.table import read_motion, refuse_beyond_limits
from drake_disasm.logs import LogWriter, flat_columns
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.stations import Station, make_station
from drake_disasm.visualization import add_cell_view, start_meshcat
from drake_disasm_cli import common, hardware

_EXAMPLES = """examples:
  drake-disasm excite --scenario removal --floor 0.05 --out out/motion
                                  a motion that shows friction, off the bench
  drake-disasm play-motion out/motion/motion.csv       watch it in Meshcat
  drake-disasm play-motion out/motion/motion.csv --no-meshcat --record out/arm_log \\
      --hidden arm.yaml        a log that states removal and measured another arm
  drake-disasm import-log out/arm_log/episode_0000.parquet --kind joint_motion \\
      --out out/arm_torques
  drake-disasm close-loop --log out/arm_torques --out out/arm_closed
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm play-motion", __doc__, _EXAMPLES)
    add = parser.add_argument
    add("motion", type=Path, metavar="MOTION", help="CSV file")
    common.add_scenario_arguments(parser)
    common.add_station_argument(
        add,
        "cell",
        "the simulated cell, or the hardware, which are the devices of "
        "--hardware-config",
        hardware=True,
    )
    hardware.add_config_argument(add)
    add("--record", type=Path, metavar="DIR", help="write a log into an empty folder")
    add(
        "--resume",
        action="store_true",
        help="with --record: add an episode to the log in the folder",
    )
    common.add_hidden_argument(add)
    common.add_view_arguments(add)
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    _refuse_contradictions(args)
    scenario = load_scenario(args.scenario, args.overrides)
    joints = arm_joints(scenario.arm)
    motion = read_motion(args.motion, len(joints))
    refuse_beyond_limits(motion, scenario.arm, args.motion)
    writer = _open_log(args, arguments, scenario) if args.record else None
    # Of hardware, the pace is its own.
    rate = 0.0 if args.station == "hardware" else common.realtime_rate(args)
    with _station(args, scenario) as station:
        player = MotionPlayer(station, motion, _view(args))
        print(
            f"{player.begin:.1f} s to where the motion begins, then "
            f"{player.end - player.begin:.1f} s",
            flush=True,
        )
        try:
            with program.ProgressBar("s") as progress:
                player.play(rate, progress)
        finally:
            if writer:
                _keep(writer, player, scenario)
    return 0


def _refuse_contradictions(args: argparse.Namespace) -> None:
    """Refuses options that do not go together.

    Raises:
        DisasmError: names the first.
    """
    if args.resume and not args.record:
        raise DisasmError("--resume: say which log by --record DIR")
    if args.station == "twin":
        raise DisasmError("--station twin: has no arm; use cell or hardware")
    usual = {"hidden": None, "realtime_rate": None}
    hardware.refuse_contradictions(args, ["hardware_config"], usual)


def _station(
    args: argparse.Namespace, scenario: Scenario
) -> AbstractContextManager[Station]:
    if args.station == "hardware":
        return hardware.open_station(scenario, args.hardware_config, False)
    real = common.real_scenario(args, scenario)
    return nullcontext(make_station(args.station, real))


def _view(args: argparse.Namespace) -> Callable[..., object] | None:
    if args.no_meshcat:
        return None
    meshcat = start_meshcat(args.meshcat_host)
    print(f"watch at {meshcat.web_url()}", flush=True)
    return partial(add_cell_view, meshcat=meshcat)


def _open_log(
    args: argparse.Namespace, arguments: Sequence[str], scenario: Scenario
) -> LogWriter:
    provenance = program.provenance("drake-disasm play-motion", arguments, 0) | {
        "motion": str(args.motion),
        "hidden": bool(args.hidden),
    }
    header = response_header(scenario, args.record, args.station, provenance)
    return LogWriter(args.record, header, resume=args.resume)


def _keep(writer: LogWriter, player: MotionPlayer, scenario: Scenario) -> None:
    """Writes what was recorded, all of the motion or what was played of it."""
    columns = player.columns()
    if len(columns["time"]) < 2:
        print("log: the motion had not begun; nothing recorded, go on by --resume")
        return
    with writer:
        write_text(writer.folder / URDF, cell_urdf(scenario))
        writer.write_episode(flat_columns("joint_response", columns))
    print(f"log: {writer.folder}")

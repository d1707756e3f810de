"""Runs the task, in simulation or on the robot, and shows it in Meshcat.

One scenario file gives one Drake diagram: an iiwa slides a bolt along a door-chain
groove under hydroelastic contact. Watch it in the browser page whose address is
printed, record it as a log, or save a page that plays offline. The same diagram runs
on the devices of a real cell; read docs/guides/hardware.md first.
"""

import argparse
import contextlib
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from drake_disasm.common import options, program, stopping
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import make_folder
from drake_disasm.logs import LogWriter, flat_columns
from drake_disasm.policies import Exploring, default_policy, resolve_policy
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.stations import Station
from drake_disasm.task.episode import EpisodeSummary, run_episode, summary_table
from drake_disasm.task.recording import EpisodeRecorder, transitions_header
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm.visualization import MeasuredView, MeshcatView, start_meshcat
from drake_disasm_cli import common, hardware

_MM = 1e-3
_EXAMPLES = """examples:
  drake-disasm simulate                              the default, in Meshcat
  drake-disasm simulate --policy straight --scenario removal_turned
  drake-disasm simulate --policy my_policy.py:Mine   a class of your own
  drake-disasm simulate --station twin --no-meshcat --episodes 10 --record out/log
  drake-disasm simulate --station twin --no-meshcat --episodes 20 --record out/log \\
      --resume                                       ten more
  drake-disasm simulate --set part.clearance=0.0002 --set contact.friction=0.3
  drake-disasm simulate --html out/removal.html      a page that plays offline
  drake-disasm simulate --no-meshcat --episodes 11 --record out/hidden \\
      --policy admittance --explore 0.15 --hidden removal_turned
                               a log that states removal and measured another
  drake-disasm simulate --station hardware --hardware-config cell.yaml --dry-run
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm simulate", __doc__, _EXAMPLES)
    common.add_scenario_arguments(parser)
    _add_run_arguments(parser.add_argument)
    _add_hardware_arguments(parser.add_argument)
    _add_log_arguments(parser.add_argument)
    _add_view_arguments(parser.add_argument)
    return parser.parse_args(arguments)


def _add_run_arguments(add: Callable[..., object]) -> None:
    add(
        "--policy",
        metavar="NAME",
        help="a scripted one (straight, admittance), a trained one (a shipped name, or "
        "an .npz file), or one of your own: FILE.py:Class or module:name, a callable "
        "from (12,) to (6,) or a LeafSystem (default: removal_randomised, shipped, for "
        "a door chain, and admittance for other parts)",
    )
    common.add_station_argument(
        add,
        "cell",
        "the simulated cell; its twin, which is bolt and groove alone; or the "
        "hardware, which are the devices of --hardware-config",
        hardware=True,
    )
    add(
        "--episodes",
        type=options.positive,
        default=1,
        metavar="N",
        help="how many (default: 1)",
    )
    add(
        "--seed",
        type=options.seed,
        default=0,
        help="of the first episode; the next ones count on (default: 0)",
    )


def _add_hardware_arguments(add: Callable[..., object]) -> None:
    hardware.add_config_argument(add)
    add(
        "--dry-run",
        action="store_true",
        help="with --station hardware: read and display, command nothing",
    )


def _add_log_arguments(add: Callable[..., object]) -> None:
    add("--record", type=Path, metavar="DIR", help="write a log into an empty folder")
    add(
        "--resume",
        action="store_true",
        help="with --record: go on with the log in the folder, which was interrupted; "
        "on hardware: add an episode to it",
    )
    add(
        "--explore",
        type=options.nonnegative,
        default=0.0,
        metavar="MM",
        help="add Gaussian noise to the policy's actions, so that the log shows more: "
        "standard deviation in mm, and in tenths of a degree (default: 0)",
    )
    common.add_hidden_argument(add)


def _add_view_arguments(add: Callable[..., object]) -> None:
    add(
        "--html",
        type=Path,
        metavar="FILE",
        help="save the last episode as a page that plays offline",
    )
    add("--close-up", action="store_true", help="look at the groove, not at the cell")
    common.add_view_arguments(add)


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    _refuse_contradictions(args)
    scenario = load_scenario(args.scenario, args.overrides)
    args.policy = args.policy or default_policy(scenario)
    if args.station == "hardware":
        return _on_hardware(args, arguments, scenario)
    real = common.real_scenario(args, scenario)
    policy = resolve_policy(args.policy, scenario)
    writer = _open_log(args, arguments, scenario) if args.resume else None
    done = writer.next_number if writer else 0
    if args.explore:
        policy = Exploring(policy, args.explore * _MM, args.seed + done)
    if args.html:
        make_folder(args.html.parent)
    view = _open_view(args)
    simulation = TaskSimulation(real, args.station, policy, [view] if view else [])
    simulation.set_target_realtime_rate(common.realtime_rate(args))
    if args.record and not writer:  # a station that is refused leaves no folder
        writer = _open_log(args, arguments, scenario)
    summaries: list[EpisodeSummary] = []
    try:
        for seed in range(args.seed + done, args.seed + args.episodes):
            summaries.append(_run_one(simulation, seed, writer, view))
    finally:
        if summaries:
            print(summary_table(summaries))
    _finish(args, view)
    return 0


def _on_hardware(
    args: argparse.Namespace, arguments: Sequence[str], scenario: Scenario
) -> int:
    """Runs one episode on the devices, or only watches them."""
    with hardware.open_station(scenario, args.hardware_config, args.dry_run) as station:
        if args.dry_run:
            hardware.watch(station, _open_measured_view(args, station))
        policy = resolve_policy(args.policy, scenario)
        writer = _open_log(args, arguments, scenario) if args.record else None
        seed = args.seed + (writer.next_number if writer else 0)
        if args.explore:
            policy = Exploring(policy, args.explore * _MM, seed)
        view = _open_view(args)
        views = [view] if view else []
        simulation = TaskSimulation(scenario, lambda _: station, policy, views)
        print("waiting for the devices", flush=True)
        try:
            print(summary_table([_run_one(simulation, seed, writer, view)]))
        finally:
            print(hardware.health_table(station))
            print(hardware.pace_in_words(station))
            if writer:
                writer.note(pace=station.counts())
    _finish(args, view)
    return 0


def _refuse_contradictions(args: argparse.Namespace) -> None:
    """Refuses options that do not go together.

    Raises:
        DisasmError: names the first.
    """
    if args.resume and not args.record:
        raise DisasmError("--resume: say which log by --record DIR")
    usual = {"episodes": 1, "realtime_rate": None, "hidden": None}
    hardware.refuse_contradictions(args, ["hardware_config", "dry_run"], usual)
    for name in ("record", "html"):
        if args.dry_run and getattr(args, name):
            raise DisasmError(f"--{name}: a dry run keeps nothing; leave one out")


def _run_one(
    simulation: TaskSimulation,
    seed: int,
    writer: LogWriter | None,
    view: MeshcatView | None,
) -> EpisodeSummary:
    """Runs, shows and records one episode."""
    stopping.stop_if_interrupted()
    if view:
        view.begin_episode()
    with (
        program.ProgressBar("step") as progress,
        _recorded(simulation, writer) as recorder,
    ):
        summary = run_episode(simulation, seed, recorder, progress)
    if view:
        view.end_episode()
    return summary


@contextlib.contextmanager
def _recorded(
    simulation: TaskSimulation, writer: LogWriter | None
) -> Iterator[EpisodeRecorder | None]:
    """Yields what records an episode, whose rows are kept at the end.

    On hardware they are on the disk as they come: nothing brings them back. A
    simulation can be run again; there an episode counts if it ended, or if its policy
    failed.
    """
    if writer is None:
        yield None
    elif simulation.station_name == "hardware":
        with writer.begin_episode() as episode:
            yield EpisodeRecorder(simulation, episode)
    else:
        recorder = EpisodeRecorder(simulation)
        try:
            yield recorder
        except DisasmError:
            _keep(writer, recorder)
            raise
        _keep(writer, recorder)


def _keep(writer: LogWriter, recorder: EpisodeRecorder) -> None:
    if recorder.steps:
        columns = recorder.columns()
        if writer.header.provenance["hidden"]:  # what was drawn would give it away
            columns = {k: v for k, v in columns.items() if not k.startswith("extra.")}
        writer.write_episode(flat_columns("transitions", columns))


def _open_log(
    args: argparse.Namespace, arguments: Sequence[str], scenario: Scenario
) -> LogWriter:
    origin = {"policy": args.policy, "explore_mm": args.explore}
    provenance = (
        program.provenance("drake-disasm simulate", arguments, args.seed) | origin
    )
    provenance["hidden"] = bool(args.hidden)
    header = transitions_header(scenario, args.station, provenance)
    writer = LogWriter(args.record, header, resume=args.resume)
    for remark in writer.remarks:
        print(remark, flush=True)
    return writer


def _open_view(args: argparse.Namespace) -> MeshcatView | None:
    """Returns the view that was asked for; --html needs one, though unwatched."""
    if args.no_meshcat and not args.html:
        return None
    meshcat = start_meshcat(args.meshcat_host)
    view = MeshcatView(meshcat, record=bool(args.html), close_up=args.close_up)
    if not args.no_meshcat:
        print(f"watch at {view.meshcat.web_url()}", flush=True)
    return view


def _open_measured_view(
    args: argparse.Namespace, station: Station
) -> MeasuredView | None:
    if args.no_meshcat:
        return None
    meshcat = start_meshcat(args.meshcat_host)
    print(f"watch at {meshcat.web_url()}", flush=True)
    return MeasuredView(meshcat, station, args.close_up)


def _finish(args: argparse.Namespace, view: MeshcatView | None) -> None:
    """Saves the page; leaves the live one up while somebody sits at the terminal."""
    if args.record:
        print(f"log: {args.record}")
    if view and args.html:
        view.save_html(args.html)
        print(f"page: {args.html}")
    if view and not args.no_meshcat and sys.stdin.isatty():
        common.wait_for_enter("press Enter to close the page ")

"""Finds what a model lacks by the station's own experiments, and says when it knows.

Records three removals and asks for the verdict, as close-loop does. Of the effects that
the verdict can't tell apart, or that its log could not have shown, the twin predicts
what each would do in every experiment of the library; the experiment that separates
them best per second of robot time is performed and added to the log, and the verdict is
asked for again. It ends when one hypothesis is left, when no experiment would help, or
when the robot time is spent.

An experiment is performed only if the twin keeps within 70 % of the task's force and
torque, the workspace and the arm's joint limits under every hypothesis. Before each one
a person is asked, unless --yes. Log, fits, the story of the rounds (`report.html`,
`diagnosis.json`) and the scenario with what was found (`scenario.yaml`) are in --out;
after Ctrl-C the same command goes on.

With --kind joint_motion (torques) or joint_response (positions) the arm takes the bolt
out and moves in free space beside the bench, and the model of the arm is diagnosed.

Exit status: 0 if one hypothesis is left, 3 if not, 2 for input that can't be used.
"""

import argparse
import contextlib
import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

from drake_disasm.common import options, program
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import make_folder, write_text
from drake_disasm.common.progress import Progress, ProgressUpdate
from drake_disasm.common.user_code import import_named
from drake_disasm.experiments import (
    AnyExperiment,
    Experiment,
    JointExperiment,
    find_experiment,
    registered_experiments,
    registered_joint_experiments,
)
from drake_disasm.scenario import Scenario, dump_scenario, load_scenario
from drake_disasm.stations import make_station
from drake_disasm.task.simulation import StationFactory
from drake_disasm.visualization import MeshcatView, start_meshcat
from drake_disasm_cli import common, hardware
from sysid.diagnosis import Budget, Diagnosis, GrowingArmLog, GrowingLog, arm_of_station
from sysid.diagnosis.arm_log import KINDS
from sysid.diagnosis.arm_subject import ArmSubject
from sysid.diagnosis.loop import pursue
from sysid.diagnosis.station_subject import StationSubject
from sysid.diagnosis.subject import Subject
from sysid.models.twin import with_impact_as_stiff
from sysid.report import diagnosis_page
from sysid.workers import Workers

EXIT_OPEN = 3

_IN_CONTACT = "transitions"

_MINUTE = 60.0  # s
_EXAMPLES = """examples:
  drake-disasm diagnose --scenario removal --hidden removal_turned --yes \\
      --contact impact --out out/diagnosis
  drake-disasm diagnose --station twin --scenario iiwa_peg --yes --robot-time 120 \\
      --verdict-time 5 --out out/peg
  drake-disasm diagnose --station hardware --hardware-config cell.yaml \\
      --scenario removal --experiments Presses Reversals Rest --out out/cell
  drake-disasm diagnose --scenario removal --kind joint_motion --hidden arm.yaml \\
      --yes --out out/arm           the arm alone, in free space
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm diagnose", __doc__, _EXAMPLES)
    add = parser.add_argument
    common.add_scenario_arguments(parser)
    common.add_station_argument(
        add, "cell", "on which experiments are performed", hardware=True
    )
    hardware.add_config_argument(add)
    add(
        "--kind",
        choices=(_IN_CONTACT, *KINDS),
        default=_IN_CONTACT,
        help="of the log: steps of the task, or the joints' torques or response in "
        f"free space (default: {_IN_CONTACT})",
    )
    add(
        "--contact",
        choices=("impact", "hydroelastic"),
        help="of the twin that judges and predicts: impact, as stiff, takes a minute "
        "where hydroelastic takes ten, and differs more from the cell (default: the "
        "scenario's)",
    )
    common.add_hidden_argument(add)
    _add_budget_arguments(add)
    add(
        "--html",
        action="store_true",
        help="save each experiment as a page that plays offline: OUT/meshcat",
    )
    add("--yes", action="store_true", help="perform each experiment without asking")
    common.add_workers_argument(parser)
    add("--out", required=True, type=Path, metavar="DIR", help="of log and report")
    return parser.parse_args(arguments)


def _add_budget_arguments(add: Callable[..., object]) -> None:
    add(
        "--robot-time",
        type=options.above_zero,
        default=Budget().robot,
        metavar="S",
        help=f"after which no experiment begins (default: {Budget().robot:g})",
    )
    add(
        "--verdict-time",
        type=options.above_zero_or_inf,
        default=math.inf,
        metavar="MIN",
        help="of the computer for each verdict (default: as long as it takes)",
    )
    contact, free = registered_experiments(), registered_joint_experiments()
    names = ", ".join(kind.__name__ for kind in contact)
    of_joints = ", ".join(kind.__name__ for kind in free)
    add(
        "--experiments",
        nargs="+",
        metavar="NAME|FILE.py",
        help=f"to choose from: {names}; of joints {of_joints}; or all of a file of "
        "your own (@register_experiment; default: all of the kind)",
    )


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    hardware.refuse_contradictions(args, ["hardware_config"], {"hidden": None})
    scenario = load_scenario(args.scenario, args.overrides)
    _refuse_contradictions(args)
    real = common.real_scenario(args, scenario)
    kinds = [kind for name in args.experiments or () for kind in _experiments(name)]
    _refuse_others(kinds, args.kind)
    budget = Budget(args.robot_time, _MINUTE * args.verdict_time)
    with (
        program.ProgressBar(unit="simulation") as progress,
        Workers(args.workers, progress=progress) as workers,
        _station(args, scenario) as station,
    ):
        make = _station_subject if args.kind == _IN_CONTACT else _arm_subject
        subject = make(args, scenario, station, real, kinds, progress)
        if subject.log.episodes:
            print(f"{args.out}: goes on after {subject.log.episodes} recordings")

        confirm = partial(_announced, progress) if args.yes else _asked
        found = pursue(subject, args.out, budget, confirm, workers)
    origin = program.provenance("drake-disasm diagnose", arguments, 0)
    write_text(args.out / "report.html", diagnosis_page(found, origin, args.html))
    _write_scenario(args.out / "scenario.yaml", found)
    print(_text(found))
    print(f"report: {args.out / 'report.html'}")
    return 0 if found.is_settled else EXIT_OPEN


def _refuse_contradictions(args: argparse.Namespace) -> None:
    """Refuses options that are for a station in contact alone.

    Raises:
        DisasmError: names the first.
    """
    if args.kind != _IN_CONTACT:
        for name in ("contact", "html"):
            if getattr(args, name):
                raise DisasmError(
                    f"--{name}: an arm in free space has none; leave it out"
                )


def _station_subject(
    args: argparse.Namespace,
    scenario: Scenario,
    station: str | StationFactory,
    real: Scenario,
    kinds: Sequence[type[AnyExperiment]],
    progress: Progress,
) -> Subject:
    """Returns a station in contact, as what is diagnosed."""
    model = _with_contact(scenario, args.contact or scenario.contact.model)
    view = MeshcatView(start_meshcat(), record=True) if args.html else None
    log = GrowingLog(model, args.out / "log", station, real, progress, view)
    own = [kind for kind in kinds if issubclass(kind, Experiment)]
    return StationSubject(model, log, own or None, None, progress)


def _with_contact(scenario: Scenario, model: str) -> Scenario:
    """Returns a scenario with a model of contact; IMPACT is as stiff as the other."""
    if model == scenario.contact.model:
        return scenario
    if model == "impact":
        return with_impact_as_stiff(scenario)
    contact = dataclasses.replace(scenario.contact, model=model)
    return dataclasses.replace(scenario, contact=contact)


def _arm_subject(
    args: argparse.Namespace,
    scenario: Scenario,
    station: str | StationFactory,
    real: Scenario,
    kinds: Sequence[type[AnyExperiment]],
    progress: Progress,
) -> Subject:
    """Returns the station's arm in free space, as what is diagnosed."""
    own = [kind for kind in kinds if issubclass(kind, JointExperiment)]
    make_folder(args.out)
    made = make_station(station, real) if isinstance(station, str) else station(real)
    arm, space, header = arm_of_station(made, scenario, args.out)
    log = GrowingArmLog(arm, space, header, args.out, args.kind, progress)
    return ArmSubject(log, own or None, None, progress)


def _refuse_others(kinds: Sequence[type[AnyExperiment]], kind: str) -> None:
    """Raises DisasmError for the first experiment that is not for a kind of log."""
    base = Experiment if kind == _IN_CONTACT else JointExperiment
    for each in kinds:
        if not issubclass(each, base):
            raise DisasmError(f"--experiments {each.__name__}: not for --kind {kind}")


def _experiments(name: str) -> list[type[AnyExperiment]]:
    """Returns the experiment of a name, or those of a file.

    Raises:
        DisasmError: there is none.
    """
    if not name.endswith(".py"):
        return [find_experiment(name)]
    module = import_named(name, "experiments").__name__
    known = (*registered_experiments(), *registered_joint_experiments())
    found = [kind for kind in known if kind.__module__ == module]
    if not found:
        raise DisasmError(
            f"{name}: registers no experiment; put @register_experiment above the class"
        )
    return found


@contextlib.contextmanager
def _station(
    args: argparse.Namespace, scenario: Scenario
) -> Iterator[str | StationFactory]:
    """Yields the station's name, or what gives the hardware's."""
    if args.station != "hardware":
        yield args.station
        return
    with hardware.open_station(scenario, args.hardware_config, False) as station:
        yield lambda _: station


def _announced(progress: Progress, question: str) -> bool:
    """Says what is performed next, and why."""
    progress(ProgressUpdate("diagnosing", message=question))
    return True


def _asked(question: str) -> bool:
    """Returns whether a person wants an experiment.

    Raises:
        DisasmError: nobody is there.
    """
    try:
        return input(f"{question}; perform it? [y/N] ").strip().lower() in ("y", "yes")
    except EOFError:
        raise DisasmError("nobody answers; give --yes") from None


def _write_scenario(file: Path, found: Diagnosis) -> None:
    """Writes the scenario with what was found; none is there if no name stands."""
    scenario = found.closed.scenario if found.names else None
    if scenario is None:
        file.unlink(missing_ok=True)
    else:
        write_text(file, dump_scenario(scenario))


def _text(found: Diagnosis) -> str:
    """Returns the story of a diagnosis in lines."""
    lines = [f"before the first verdict: {found.first_time:.0f} s of robot time"]
    for each in found.rounds:
        left = ", ".join(f"{name} {w:.2f}" for name, w in each.rivals.items())
        lines.append(f"left: {left}")
        if each.experiment:
            ended = f", {each.ended}" if each.ended else ""
            most = f"{each.force:.1f} N" if each.force else f"{each.torque:.1f} N m"
            time = f"{each.robot_time:.0f} s"
            lines.append(f"{each.experiment}: {time}, at most {most}{ended}")
    lines.append(f"{found.reason} ({found.robot_time:.0f} s of robot time)")
    if found.is_refuted:
        lines.append("from the library alone:")
    return "\n".join([*lines, found.closed.text])

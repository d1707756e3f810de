"""Finds which physical effect a model lacks to explain a measured log, and adds it.

The kind of log decides what is modelled: transitions of the cell or the twin, readings
of a force/torque sensor at rest, or joint torques of an arm. The model is fitted; every
effect of the library is tested on what it explains of data that were not fitted; those
that pass are added one by one. Prints what is missing, its parameters, and the error
before and after. Writes the scenario with the effects, `result.json`, and a report
that opens offline; `--export` writes a robot's files. After Ctrl-C the same command
resumes.

With --reference, those logs make the model, their effects included, and the verdict is
on what has changed since: by how much, since when, and what has not.
"""

import argparse
import dataclasses
import math
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from drake_disasm.common import options, program
from drake_disasm.common.cluster import executor_for
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import make_folder, write_json, write_text
from drake_disasm.scenario import dump_scenario, load_scenario
from drake_disasm_cli import common, data_arguments
from sysid.data_checks import DataFinding
from sysid.effect_selection.change_words import changes_mapping, changes_text
from sysid.effect_selection.changes import Changes, find_changes
from sysid.effect_selection.close_loop import ClosedLoop, close_loop
from sysid.effect_selection.output import to_mapping
from sysid.export import FORMATS, Exports, make_exports, refuse_export
from sysid.identification.split import split_episodes
from sysid.models import LogModel
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.measurements import episode_names
from sysid.monitoring.reference import KEY as REFERENCE_KEY
from sysid.monitoring.reference import Reference
from sysid.motor_constants import MotorConstants
from sysid.report import changes_page, closing_page
from sysid.scenario_parameters import read_requests
from sysid.workers import Workers

_EXAMPLES = """examples:
  drake-disasm close-loop --log out/log --scenario removal --out out/closed
  drake-disasm close-loop --log out/readings --out out/sensor     a static_wrench log
  drake-disasm close-loop --log out/arm_1 out/arm_2 --held-out arm_2 --out out/arm
  drake-disasm close-loop --log out/arm_1 --trust urdf --out out/differs
  drake-disasm close-loop --log out/arm_1 --export urdf sdf --out out/arm
  drake-disasm close-loop --reference out/march --log out/april --out out/changed
  drake-disasm close-loop --reference out/free --log out/loaded --known-payload 2.8 \\
      --out out/weighed                                 both with motor currents
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm close-loop", __doc__, _EXAMPLES)
    add = parser.add_argument
    common.add_log_argument(add)
    add(
        "--reference",
        nargs="+",
        default=[],
        type=Path,
        metavar="DIR",
        help="logs of the same robot as it was before: the verdict is on what has "
        "changed since (default: on what the model lacks)",
    )
    add(
        "--known-payload",
        type=options.above_zero,
        metavar="KG",
        help="of logs with motor currents: mass that the new logs carry at the flange "
        "and the references do not; it identifies the motor constants",
    )
    _add_model_arguments(add)
    data_arguments.add_data_arguments(add)
    add(
        "--time-budget",
        type=options.above_zero_or_inf,
        default=math.inf,
        metavar="MIN",
        help="end the search after so many minutes, with a provisional verdict, that "
        "the same command goes on from (default: none)",
    )
    add(
        "--residual-model",
        action="store_true",
        help="learn what the effects leave, too: it lowers the error within the range "
        "of the log, and explains nothing",
    )
    add(
        "--export",
        nargs="+",
        default=[],
        choices=sorted(FORMATS),
        metavar="FORMAT",
        help="write the arm of a log of joint torques, as identified: urdf, sdf, mjcf "
        "(with MuJoCo)",
    )
    common.add_import_argument(parser)
    common.add_executor_arguments(parser)
    add("--out", required=True, type=Path, metavar="DIR", help="a folder")
    return parser.parse_args(arguments)


def _add_model_arguments(add: Callable[..., object]) -> None:
    data_arguments.add_nominal_arguments(add)
    add(
        "--held-out",
        nargs="+",
        default=[],
        metavar="NAME",
        help="logs or episodes to judge by instead of fitting them (default: a quarter "
        "of the episodes of transitions; else contiguous blocks in turn)",
    )
    add(
        "--parameters",
        nargs="+",
        default=[],
        metavar="NAME|FILE",
        help="parameters of the scenario that are fitted together with the effects, as "
        "named by `drake-disasm identify` (default: none for transitions, else the "
        "model's own)",
    )
    add(
        "--trust",
        choices=("urdf",),
        help="take the URDF's masses and inertias for right, and ask what differs: a "
        "body on a link, a tilted base, friction, offsets, scales of torques (default: "
        "all base parameters are identified)",
    )
    add(
        "--huber",
        dest="huber_delta",
        type=options.above_zero_or_inf,
        metavar="K",
        help="residual, in standard deviations, beyond which the loss is linear; inf "
        "for least squares (default: 3 for transitions, else inf)",
    )


#: The learned functions, beside the scenario that names them.
_RESIDUAL_MODEL = "residual_model.npz"
#: Finished fits, for a run that is stopped.
_FITS = "fits"


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    _refuse_combinations(args)
    references = common.named_logs(args.reference) if args.reference else []
    read = (*references, *common.named_logs(args.log))
    logs, constants = data_arguments.in_torques(read, args, len(references))
    if args.held_out:  # names, which are wrong more often than anything takes time
        split_episodes(episode_names(logs), args.held_out)
    model = data_arguments.with_constants(model_of(logs, _choice(args)), constants)
    if args.export:
        refuse_export(model, args.export)
    origin = program.provenance("drake-disasm close-loop", arguments, 0)
    with (
        program.ProgressBar(unit="run") as progress,
        executor_for(args.executor, args.scheduler, args.tls) as (executor, _),
        Workers(args.workers, executor=executor, progress=progress) as workers,
    ):
        model, findings = data_arguments.checked(logs, model, args, workers)
        shared: dict[str, Any] = {
            "workers": workers,
            "progress": progress,
            "folder": args.out / _FITS,
            "time_budget": 60.0 * args.time_budget,
        }
        if references:
            changes = find_changes(model, len(episode_names(references)), **shared)
        else:
            closed = _closed(model, args, shared)
    run = _Run(origin, findings, constants)
    if references:
        _write_changes(args.out, changes, run)
        _finish(args.out, changes.closed, changes_text(changes), run)
        return 0
    exports, refusal = _exports(closed, args.export)
    known = Reference.of(
        closed,
        logs,
        _choice(args),
        args.imports,
        args.drop_flagged_rows,
        constants.values if constants else (),
    )
    _write(args.out, closed, known, run, exports)
    _finish(args.out, closed, closed.text, run)
    if refusal is not None:
        raise refusal
    if exports is not None:
        print(f"exported: {', '.join(exports.files)}")
    return 0


@dataclasses.dataclass(frozen=True)
class _Run:
    """What a verdict came from.

    Attributes:
        origin: provenance.
        findings: of the check of the data.
        constants: by which motor currents are torques, if they are.
    """

    origin: dict[str, object]
    findings: Sequence[DataFinding]
    constants: MotorConstants | None

    def to_mapping(self) -> dict[str, Any]:
        """Returns it as plain data."""
        constants = self.constants
        return {
            "data_findings": [finding.to_mapping() for finding in self.findings],
            "motor_constants": constants.to_mapping() if constants else None,
            "provenance": self.origin,
        }


def _closed(
    model: LogModel, args: argparse.Namespace, shared: dict[str, Any]
) -> ClosedLoop:
    """Returns the closed loop of the episodes that are not held out."""
    share = model.held_out_share
    train, test = split_episodes(model.measurements.names, args.held_out or share)
    return close_loop(
        model,
        train=train,
        test=test,
        huber_delta=args.huber_delta,
        learn_residual=args.residual_model,
        **shared,
    )


def _finish(folder: Path, closed: ClosedLoop, text: str, run: _Run) -> None:
    """Removes fits that no run goes on from, and prints the verdict."""
    if not closed.is_provisional:
        shutil.rmtree(folder / _FITS, ignore_errors=True)
    print(text)
    if run.constants is not None:
        print(run.constants.text)
    print(f"report: {folder / 'report.html'}")


def _refuse_combinations(args: argparse.Namespace) -> None:
    """Refuses options that mean nothing beside --reference.

    Raises:
        DisasmError: one of them is given.
    """
    if not args.reference:
        return
    for option in ("held_out", "parameters", "residual_model", "trust", "export"):
        if getattr(args, option):
            name = f"--{option.replace('_', '-')}"
            raise DisasmError(f"{name}: not with --reference; leave one of them out")
    twice = {path.resolve() for path in args.reference} & {
        path.resolve() for path in args.log
    }
    if twice:
        raise DisasmError(
            f"{min(twice)}: is a reference, and a log to compare with it; name it once"
        )


def _exports(
    closed: ClosedLoop, formats: Sequence[str]
) -> tuple[Exports | None, DisasmError | None]:
    """Returns a robot's files, or why there are none: the verdict is written anyway."""
    if not formats:
        return None, None
    try:
        return make_exports(closed, formats), None
    except DisasmError as error:
        return None, error


def _choice(args: argparse.Namespace) -> ModelChoice:
    """Returns the model that the command line asks for."""
    return ModelChoice(
        scenario=load_scenario(args.scenario) if args.scenario else None,
        requests=tuple(read_requests(args.parameters)) if args.parameters else (),
        urdf=args.urdf,
        fixed=True,
        trust_urdf=args.trust == "urdf",
    )


def _write_changes(folder: Path, changes: Changes, run: _Run) -> None:
    make_folder(folder)
    write_json(folder / "result.json", changes_mapping(changes) | run.to_mapping())
    reference = closing_page(changes.reference, run.origin)
    write_text(folder / "reference.html", reference)
    page = changes_page(changes, run.origin, run.findings)
    write_text(folder / "report.html", page)


def _write(
    folder: Path,
    closed: ClosedLoop,
    known: Reference,
    run: _Run,
    exports: Exports | None,
) -> None:
    make_folder(folder)
    learned = closed.verdict.residual_model
    if learned is not None:
        learned.functions.save(folder / _RESIDUAL_MODEL)
    scenario = closed.scenario_with_residual_model(_RESIDUAL_MODEL)
    if scenario is not None:
        write_text(folder / "scenario.yaml", dump_scenario(scenario))
    exported = None if exports is None else exports.to_mapping()
    of_run = {"export": exported, REFERENCE_KEY: known.to_mapping()}
    mapping = to_mapping(closed) | run.to_mapping() | of_run
    write_json(folder / "result.json", mapping)
    page = closing_page(closed, run.origin, run.findings, exported)
    write_text(folder / "report.html", page)
    if exports is not None:
        exports.write(folder)

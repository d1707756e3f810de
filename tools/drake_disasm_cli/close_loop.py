"""Finds which physical effect a model lacks to explain a measured log, and adds it.

The kind of log decides what is modelled: transitions of the cell or the twin, readings
of a force/torque sensor at rest, or joint torques of an arm. The model is fitted; every
effect of the library is tested on what it explains of data that were not fitted; those
that pass are added one by one. Prints what is missing, its parameters, and the error
before and after. Writes the scenario with the effects, `result.json`, and a report
that opens offline; `--export` writes a robot's files. After Ctrl-C the same command
resumes.
"""

import argparse
import math
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

from drake_disasm.common import options, program
from drake_disasm.common.cluster import executor_for
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import make_folder, write_json, write_text
from drake_disasm.logs import Log
from drake_disasm.scenario import dump_scenario, load_scenario
from drake_disasm_cli import common, data_arguments
from sysid.data_checks import DataFinding
from sysid.effect_selection.close_loop import ClosedLoop, close_loop
from sysid.effect_selection.output import to_mapping
from sysid.export import FORMATS, Exports, make_exports, refuse_export
from sysid.identification.split import split_episodes
from sysid.models import LogModel
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.measurements import episode_names
from sysid.report import closing_page
from sysid.scenario_parameters import read_requests
from sysid.workers import Workers

_EXAMPLES = """examples:
  drake-disasm close-loop --log out/log --scenario removal --out out/closed
  drake-disasm close-loop --log out/readings --out out/sensor     a static_wrench log
  drake-disasm close-loop --log out/arm_1 out/arm_2 --held-out arm_2 --out out/arm
  drake-disasm close-loop --log out/arm_1 --export urdf sdf --out out/arm
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm close-loop", __doc__, _EXAMPLES)
    add = parser.add_argument
    common.add_log_argument(add)
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
        "--huber",
        dest="huber_delta",
        type=options.above_zero_or_inf,
        metavar="K",
        help="residual, in standard deviations, beyond which the loss is linear; inf "
        "for least squares (default: 3 for transitions, else inf)",
    )


#: The learned functions, beside the scenario that names them.
_RESIDUAL_MODEL = "residual_model.npz"


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    logs = common.named_logs(args.log)
    if args.held_out:  # names, which are wrong more often than anything takes time
        split_episodes(episode_names(logs), args.held_out)
    model = _model(args, logs)
    if args.export:
        refuse_export(model, args.export)
    origin = program.provenance("drake-disasm close-loop", arguments, 0)
    fits = args.out / "fits"
    with (
        program.ProgressBar(unit="run") as progress,
        executor_for(args.executor, args.scheduler) as (executor, _),
        Workers(args.workers, executor=executor, progress=progress) as workers,
    ):
        model, findings = data_arguments.checked(logs, model, args, workers)
        share = model.held_out_share
        train, test = split_episodes(model.measurements.names, args.held_out or share)
        closed = close_loop(
            model,
            train=train,
            test=test,
            huber_delta=args.huber_delta,
            workers=workers,
            progress=progress,
            folder=fits,
            time_budget=60.0 * args.time_budget,
            learn_residual=args.residual_model,
        )
    exports, refusal = _exports(closed, args.export)
    _write(args.out, closed, findings, origin, exports)
    if not closed.is_provisional:
        shutil.rmtree(fits, ignore_errors=True)
    print(closed.text)
    print(f"report: {args.out / 'report.html'}")
    if refusal is not None:
        raise refusal
    if exports is not None:
        print(f"exported: {', '.join(exports.files)}")
    return 0


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


def _model(args: argparse.Namespace, logs: Sequence[Log]) -> LogModel:
    """Returns the model of the logs that the command line asks for."""
    choice = ModelChoice(
        scenario=load_scenario(args.scenario) if args.scenario else None,
        requests=tuple(read_requests(args.parameters)) if args.parameters else (),
        urdf=args.urdf,
        fixed=True,
    )
    return model_of(logs, choice)


def _write(
    folder: Path,
    closed: ClosedLoop,
    findings: Sequence[DataFinding],
    origin: dict[str, object],
    exports: Exports | None,
) -> None:
    make_folder(folder)
    learned = closed.verdict.residual_model
    if learned is not None:
        learned.functions.save(folder / _RESIDUAL_MODEL)
    scenario = closed.scenario_with_residual_model(_RESIDUAL_MODEL)
    if scenario is not None:
        write_text(folder / "scenario.yaml", dump_scenario(scenario))
    of_data = {"data_findings": [finding.to_mapping() for finding in findings]}
    exported = None if exports is None else exports.to_mapping()
    of_run = {"provenance": origin, "export": exported}
    write_json(folder / "result.json", to_mapping(closed) | of_data | of_run)
    page = closing_page(closed, origin, findings, exported)
    write_text(folder / "report.html", page)
    if exports is not None:
        exports.write(folder)

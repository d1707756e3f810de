"""Finds the parameters of a model from a measured log, and how certain they are.

The kind of log decides what is fitted: the digital twin to transitions of the task,
payload and bias to static readings of a force/torque sensor, rigid-body dynamics to
joint torques of an arm. Two searches, the Bees Algorithm and NLopt, check each other.
Writes the identified scenario, `result.json`, and a report that opens offline.
"""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from drake_disasm.common import options, program
from drake_disasm.common.cluster import executor_for
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import write_json, write_text
from drake_disasm.logs import Log
from drake_disasm.scenario import Scenario, dump_scenario, load_scenario
from drake_disasm_cli import common, data_arguments
from sysid.data_checks import DataFinding
from sysid.identification import (
    Identification,
    Journal,
    SearchSettings,
    Settings,
    identify,
    summary,
)
from sysid.identification.identify import HELD_OUT_SHARE
from sysid.identification.output import to_mapping
from sysid.identification.settings import METHODS
from sysid.identification.split import split_episodes
from sysid.models.from_logs import OBJECTIVES, ModelChoice, model_of
from sysid.models.measurements import episode_names
from sysid.optimise import BeesSettings
from sysid.report import report_page
from sysid.scenario_parameters import read_requests
from sysid.workers import Workers

_THESIS_CYCLES = 10
_EXAMPLES = """examples:
  drake-disasm simulate --policy admittance --explore 0.15 --episodes 11 \\
      --no-meshcat --hidden removal_turned --record out/log
  drake-disasm identify --log out/log --out out/fit \\
      --parameters contact.friction part.clearance GroovePose.ry
  drake-disasm simulate --scenario out/fit/scenario.yaml
  drake-disasm identify --log out/log --parameters bounds.yaml --out out/fit_2
  drake-disasm identify --log out/readings --out out/sensor    a static_wrench log
  drake-disasm identify --log out/arm_1 out/arm_2 --held-out arm_2 --out out/arm

A file of parameters has lines like
  contact.friction: {low: 0.0, high: 0.6}
  contact.modulus: {low: 1.0e+8, high: 1.0e+10, scale: log}
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm identify", __doc__, _EXAMPLES)
    _add_input_arguments(parser.add_argument)
    _add_search_arguments(parser.add_argument)
    common.add_import_argument(parser)
    common.add_executor_arguments(parser, "; any number gives the same bits")
    data_arguments.add_data_arguments(parser.add_argument)
    _add_judgement_arguments(parser.add_argument)
    args = parser.parse_args(arguments)
    if args.preset == "thesis" and args.cycles is None and args.budget is None:
        args.cycles = _THESIS_CYCLES
    return args


def _add_input_arguments(add: Callable[..., object]) -> None:
    common.add_log_argument(add)
    add(
        "--scenario",
        metavar="NAME|FILE",
        help="nominal scenario of the model (default: the one stated in the log)",
    )
    add(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="overrides",
        help="override one field of --scenario; repeatable",
    )
    add(
        "--parameters",
        nargs="+",
        default=[],
        metavar="NAME|FILE",
        help="what to identify: section.field, Effect.field, or a YAML file with "
        "bounds (default for sensors and arms: all there are)",
    )
    add(
        "--objective",
        choices=[name for names in OBJECTIVES.values() for name in names],
        help="what is compared: for transitions, each step simulated from its measured "
        "state (default), or whole episodes by rollout",
    )
    add("--urdf", metavar="FILE", help="the arm of a log of joints")
    data_arguments.add_motor_constants_argument(add)
    add(
        "--noise",
        action="append",
        default=[],
        metavar="CHANNEL=SIGMA",
        type=_assignment,
        help="standard deviation of a channel, SI (default: the sensor's); repeatable",
    )
    add("--out", required=True, type=Path, metavar="DIR", help="an empty folder")
    add("--resume", action="store_true", help="go on with what is in --out")


def _add_search_arguments(add: Callable[..., object]) -> None:
    add(
        "--method",
        choices=[*METHODS, "both"],
        default="both",
        help="Bees Algorithm, NLopt (CRS2), or both, compared (default)",
    )
    add(
        "--preset",
        choices=["default", "thesis"],
        default="default",
        help="thesis: table 4.2's colony in the parameters' box and on the whole log, "
        "without Gauss-Newton and with least squares",
    )
    add(
        "--cycles",
        type=options.positive,
        metavar="N",
        help="of the Bees Algorithm, instead of --budget",
    )
    add(
        "--budget",
        type=options.positive,
        metavar="N",
        help="evaluations of each method's global search (default: 400)",
    )
    add(
        "--surrogate",
        action="store_true",
        help="a Gaussian process proposes points in place of the bees' scouts",
    )
    add("--seed", type=options.seed, default=0, help="of the searches (default: 0)")


def _add_judgement_arguments(add: Callable[..., object]) -> None:
    add(
        "--held-out",
        nargs="+",
        default=[str(HELD_OUT_SHARE)],
        metavar="SHARE|NAME",
        help="episodes that judge the fit instead of being fitted: a share, or names "
        f"of logs or log/episode_0001 (default: {HELD_OUT_SHARE})",
    )
    add(
        "--huber",
        dest="huber_delta",
        type=options.above_zero_or_inf,
        metavar="K",
        help="the loss is linear for residuals beyond K standard deviations; inf for "
        "least squares as in eq. 4.8 (default: 3 for transitions, else inf)",
    )
    add(
        "--unidentifiable",
        choices=["stop", "freeze"],
        default="stop",
        help="what to do with parameters that this log does not determine (default: "
        "stop)",
    )
    add(
        "--profile",
        nargs="+",
        default=[],
        metavar="NAME",
        help="parameters whose profile likelihood is computed, too (seven fits each)",
    )


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    logs = common.named_logs(args.log)
    split_episodes(episode_names(logs), _held_out(args))  # names, before any work
    logs, constants = data_arguments.in_torques(logs, args)
    model = data_arguments.with_constants(model_of(logs, _choice(args)), constants)
    settings = _settings(args)
    origin = program.provenance("drake-disasm identify", arguments, args.seed) | _data(
        logs
    )
    with (
        program.ProgressBar("evaluation") as bar,
        executor_for(args.executor, args.scheduler, args.tls) as (executor, _),
        Workers(args.workers, executor=executor) as workers,
    ):
        journal = Journal(args.out, _identity(args, logs), args.resume)
        whole = args.objective == "rollout"
        model, findings = data_arguments.checked(logs, model, args, workers, whole)
        train, test = split_episodes(model.measurements.names, _held_out(args))
        found = identify(
            model,
            train=train,
            test=test,
            settings=settings,
            workers=workers,
            journal=journal,
            progress=bar,
        )
    _write(args.out, found, findings, origin)
    print(summary(found))
    print(f"report: {args.out / 'report.html'}")
    return 0


def _choice(args: argparse.Namespace) -> ModelChoice:
    scenario: Scenario | None = None
    if args.scenario:
        scenario = load_scenario(args.scenario, args.overrides)
    elif args.overrides:
        raise DisasmError("--set: needs the --scenario that it changes; give it")
    requests = tuple(read_requests(args.parameters)) if args.parameters else ()
    return ModelChoice(args.objective, scenario, requests, args.urdf, tuple(args.noise))


def _settings(args: argparse.Namespace) -> Settings:
    thesis = args.preset == "thesis"
    search = SearchSettings(
        evaluations=args.budget or 400,
        cycles=args.cycles,
        local_evaluations=0 if thesis else 40,
        bees=BeesSettings.thesis() if thesis else BeesSettings(),
        seed=args.seed,
        propose=_surrogate() if args.surrogate else None,
    )
    huber_delta = np.inf if thesis and args.huber_delta is None else args.huber_delta
    methods = METHODS if args.method == "both" else (args.method,)
    return Settings(
        methods, search, huber_delta, args.unidentifiable, tuple(args.profile)
    )


def _surrogate() -> Callable[..., np.ndarray]:
    from sysid.optimise.surrogate import propose  # scikit-learn takes a second

    return propose


def _held_out(args: argparse.Namespace) -> Sequence[str] | float:
    if len(args.held_out) == 1:
        try:
            share = float(args.held_out[0])
        except ValueError:
            return list(args.held_out)
        if not 0.0 <= share < 1.0:
            raise DisasmError(f"--held-out {share:g}: give a share from 0 to below 1")
        return share
    return list(args.held_out)


def _assignment(text: str) -> tuple[str, float]:
    name, separator, value = text.partition("=")
    try:
        if separator:
            return name, float(value)
    except ValueError:
        pass
    raise argparse.ArgumentTypeError(f"'{text}': write CHANNEL=NUMBER")


def _data(logs: Sequence[Log]) -> dict[str, object]:
    return {"data": {str(log.folder): log.data_hash for log in logs}}


def _identity(args: argparse.Namespace, logs: Sequence[Log]) -> dict[str, object]:
    """Returns what must be the same for a resumed run to be the same run."""
    ignored = (
        "workers", "executor", "scheduler", "tls", "resume", "out", "log", "profile",
    )  # fmt: skip
    kept = {k: v for k, v in vars(args).items() if k not in ignored}
    return {**kept, "data": [log.data_hash for log in logs]}


def _write(
    folder: Path,
    found: Identification,
    findings: Sequence[DataFinding],
    origin: dict[str, object],
) -> None:
    of_data = {"data_findings": [finding.to_mapping() for finding in findings]}
    mapping = to_mapping(found) | of_data | {"provenance": origin}
    if found.scenario:
        write_text(folder / "scenario.yaml", dump_scenario(found.scenario))
    write_json(folder / "result.json", mapping)
    write_text(folder / "report.html", report_page(found, origin, findings))

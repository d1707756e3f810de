"""Runs one of the thesis's studies, and writes its report with every seed in a table.

A study trains all combinations of its factors' levels, some seeds of each, and tests
what was learned; `--levels`, `--seeds` and `--episodes` make it smaller. All of it goes
into one folder: a training per combination, results.csv, report.md and report.html with
figures. Ctrl-C keeps what is finished; --resume goes on, bit for bit, and a finished
study's report is written anew.
"""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from drake_disasm.common import options, program
from drake_disasm.common.cluster import executor_for
from drake_disasm.common.errors import DisasmError
from drake_disasm_cli import common
from sysid.studies import STUDIES
from sysid.studies.report import as_text, write_report
from sysid.studies.runner import open_study, run_study
from sysid.studies.study import Study, StudyOptions, level_text

_EXAMPLES = """examples:
  drake-disasm study --list                       the studies and their factors
  drake-disasm study precision --levels agent=ddpg psi=0,0.0003 --seeds 3 \\
      --episodes 50 --out out/small                              a small one
  drake-disasm study precision --levels agent=ddpg psi=0,0.0003 --seeds 3 \\
      --episodes 50 --out out/small --resume                     after Ctrl-C
  drake-disasm study precision --out out/precision               at its own size
  drake-disasm study hyperparameters --compare table_a1.csv --out out/chapter5
                                     beside the thesis's own 243 trainings
  drake-disasm study precision --out /nfs/precision --executor dask \\
      --scheduler tcp://head:8786                                on a cluster
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm study", __doc__, _EXAMPLES)
    parser.add_argument(
        "name",
        nargs="?",
        default="",
        metavar="NAME",
        help=f"of the study: {', '.join(STUDIES)}",
    )
    parser.add_argument("--list", action="store_true", help="print what is studied")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for all of it")
    _add_size_arguments(parser.add_argument)
    _add_training_arguments(parser.add_argument)
    common.add_executor_arguments(parser)
    parser.add_argument(
        "--resume", action="store_true", help="continue what is in --out"
    )
    return parser.parse_args(arguments)


def _add_size_arguments(add: Callable[..., object]) -> None:
    add(
        "--levels",
        nargs="+",
        default=[],
        metavar="FACTOR=A,B",
        help="study these levels alone of a factor (default: all of all)",
    )
    add("--seeds", type=options.positive, metavar="N", help="(default: the study's)")
    add("--first-seed", type=options.seed, default=0, metavar="S", help="(default: 0)")
    add(
        "--episodes",
        type=options.positive,
        metavar="N",
        help="of each training (default: the study's)",
    )
    add(
        "--robot-episodes",
        type=options.positive,
        default=0,
        metavar="N",
        help="let agents go on learning on the robot, where a study has one "
        "(default: they are only tested there)",
    )
    add(
        "--validation",
        type=options.positive,
        metavar="N",
        help="greedy episodes of each policy (default: the study's)",
    )


def _add_training_arguments(add: Callable[..., object]) -> None:
    add(
        "--hyper",
        nargs="+",
        default=[],
        metavar="KEY=VALUE",
        help="change hyper-parameters, of all trainings",
    )
    add(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="overrides",
        help="override one field of all scenarios; repeatable",
    )
    add(
        "--diagram",
        action="store_true",
        help="train on the twin's diagram, with the scenario's contact, a process for "
        "each (default: side by side on batches of twins, with IMPACT contact)",
    )
    add("--eager", action="store_true", help="don't compile the updates")
    add(
        "--compare",
        type=Path,
        metavar="FILE",
        help="CSV of somebody else's runs, analysed beside ours (hyperparameters)",
    )


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    if args.list:
        print("\n\n".join(map(_described, STUDIES.values())))
        return 0
    study = _study(args, arguments)
    with (
        program.ProgressBar("episode", keep=True) as bar,
        executor_for(args.executor, args.scheduler, args.tls) as (executor, host),
    ):
        origin = open_study(study, args.out, args.resume)["provenance"]
        try:
            run_study(study, args.out, args.workers, executor, host, bar)
        finally:
            for table in write_report(study, args.out, origin):
                print(as_text(table), end="\n\n")
    print(f"report: {args.out / 'report.html'}")
    return 0


def _study(args: argparse.Namespace, arguments: Sequence[str]) -> Study:
    if args.name not in STUDIES:
        raise DisasmError(
            f"study '{args.name}' does not exist; choose {', '.join(STUDIES)} "
            "(--list says what each is)"
        )
    if args.out is None:
        raise DisasmError("--out: give a folder for the study")
    if args.compare and not args.compare.is_file():
        raise DisasmError(f"--compare {args.compare}: is no file")
    kind = STUDIES[args.name]
    first = args.first_seed
    chosen = StudyOptions(
        seeds=tuple(range(first, first + (args.seeds or kind.seeds))),
        levels=dict(map(_levels, args.levels)),
        episodes=args.episodes,
        validation=args.validation,
        robot_episodes=args.robot_episodes,
        changes=tuple(args.hyper),
        overrides=tuple(args.overrides),
        lockstep=not args.diagram,
        compiled=not args.eager,
        compare=args.compare,
        provenance=program.provenance("drake-disasm study", arguments, first),
    )
    return kind(chosen)


def _levels(text: str) -> tuple[str, list[str]]:
    name, separator, levels = text.partition("=")
    if not separator or not levels:
        raise DisasmError(f"--levels {text}: write it as FACTOR=A,B")
    return name, levels.split(",")


def _described(kind: type[Study]) -> str:
    lines = [f"{kind.name}: {kind.question}", f"  {kind.source}"]
    for factor in kind.factors:
        levels = ", ".join(map(level_text, factor.levels))
        lines.append(f"  {factor.heading}: {levels}")
    lines.append(f"  {kind.seeds} seeds of each, {kind.episodes} episodes")
    return "\n".join(lines)

"""Checks logs before anything is fitted to them.

Says how the data were sampled, what is wrong with them (gaps, stuck or dead channels,
units, signs, frames, delays, spikes, filters), which parameters the motion determines,
which effects it could show at all and from which size on, and what to record in
addition. `drake-disasm identify` and `close-loop` make the same check of the data.

The exit status is 0 if fits to these logs mean something, and 2 if not.
"""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from drake_disasm.common import program
from drake_disasm.common.files import write_json
from drake_disasm.logs import Episode, Log
from drake_disasm.scenario import load_scenario
from drake_disasm_cli import common, data_arguments
from sysid.data_checks import check_data, refuse
from sysid.effect_selection.effect_names import in_words
from sysid.effect_selection.excitation import Excitation, excitation_of
from sysid.models import LogModel
from sysid.models.from_logs import ModelChoice, model_of
from sysid.report.next_recordings import LimitRow, limit_rows
from sysid.workers import Workers

_EXAMPLES = """examples:
  drake-disasm check-log --log out/log
  drake-disasm check-log --log out/arm_1 out/arm_2 --urdf arm.urdf
  drake-disasm check-log --log out/log --quick            what is wrong alone
  drake-disasm check-log --log out/log --json out/check.json
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm check-log", __doc__, _EXAMPLES)
    add = parser.add_argument
    common.add_log_argument(add)
    data_arguments.add_nominal_arguments(add)
    add(
        "--quick",
        action="store_true",
        help="leave out what the motion determines and could show",
    )
    add("--json", type=Path, metavar="FILE", help="write all of it as data, too")
    common.add_import_argument(parser)
    common.add_workers_argument(parser)
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    logs = common.named_logs(args.log)
    print("\n".join(line for log in logs for line in _of_log(log)))
    logs, constants = data_arguments.in_torques(logs, args)
    model = data_arguments.with_constants(_model(args, logs), constants)
    with (
        program.ProgressBar(unit="run") as progress,
        Workers(args.workers, progress=progress) as workers,
    ):
        findings = check_data(logs, model, workers=workers)
        for finding in findings:
            print(program.with_options(f"data: {finding.text}", data_arguments.OPTIONS))
        if not findings:
            print("data: nothing is wrong with them")
        refuse(findings)
        found = None if args.quick else excitation_of(model, workers)
    if found:
        print("\n".join(_of_excitation(found)))
    if args.json:
        write_json(
            args.json,
            {
                "findings": [finding.to_mapping() for finding in findings],
                "excitation": found.to_mapping() if found else None,
                "provenance": program.provenance(
                    "drake-disasm check-log", arguments, 0
                ),
            },
        )
    return 0


def _model(args: argparse.Namespace, logs: Sequence[Log]) -> LogModel:
    scenario = load_scenario(args.scenario) if args.scenario else None
    return model_of(logs, ModelChoice(scenario=scenario, urdf=args.urdf, fixed=True))


def _of_log(log: Log) -> Iterator[str]:
    rows = sum(episode.rows for episode in log.episodes)
    yield (
        f"{log.folder}: {log.header.kind}, {len(log.episodes)} episodes, {rows} rows"
        f"{_sampling(log.episodes)}"
    )


def _sampling(episodes: Sequence[Episode]) -> str:
    """Returns duration and rate in words; nothing of readings without a time."""
    times = [e["time"] for e in episodes if "time" in e and e.rows > 1]
    if not times:
        return ""
    steps = np.concatenate([np.diff(time) for time in times])
    period = float(np.median(steps))
    duration = float(sum(time[-1] - time[0] for time in times))
    return (
        f", {duration:.4g} s at {1.0 / period:.4g} Hz, time steps of "
        f"{1e3 * steps.min():.4g} to {1e3 * steps.max():.4g} ms"
    )


def _of_excitation(found: Excitation) -> Iterator[str]:
    if found.parameters:
        open_ = [p for p in found.parameters if not p.is_determined]
        yield (
            f"parameters: {len(found.parameters) - len(open_)} of "
            f"{len(found.parameters)} are determined by this motion"
        )
        for p in open_:
            yield f"  not {p.name}: {p.value:.3g} ± {p.spread:.2g} {p.unit}"
    rows = limit_rows(found.limits)
    shown = [row for row in rows if row.least]
    yield "effects that would be found with 80 % probability, from which size on:"
    yield from (f"  {_limit_words(row)}" for row in shown)
    if found.hidden:
        yield "effects that these logs could not show, and what to record for them:"
        for kind, experiment in found.hidden.items():
            yield f"  {in_words(kind)}: {experiment or 'no recording is known'}"


def _limit_words(row: LimitRow) -> str:
    """Returns the least size of one amplitude; over joints the range of it."""
    assert row.least and row.greatest
    low, high = row.least, row.greatest
    ends = [low] if high[0] == low[0] else [low, high]
    is_of_joints = any(joint for _, joint in ends) and len(ends) > 1
    at = [f" ({joint})" if is_of_joints else "" for _, joint in ends]
    size = " to ".join(f"{e[0]:.3g}{a}" for e, a in zip(ends, at, strict=True))
    joints = dict.fromkeys(joint for joint in row.hidden if joint)
    hidden = f"; not at {', '.join(joints)}" if joints else ""
    shapes = f" ({'; '.join(row.shapes)})" if row.shapes else ""
    return f"{row.kind}.{row.field}: {size} {row.unit}{shapes}{hidden}"

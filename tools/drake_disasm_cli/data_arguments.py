"""What programs that fit logs share: the check of the data, and its options."""

import argparse
import sys
from collections.abc import Callable, Sequence
from typing import Any

from drake_disasm.common import program
from drake_disasm.logs import Log
from sysid.data_checks import (
    ACCEPTABLE,
    DataFinding,
    check_data,
    refuse,
    without_flagged_rows,
)
from sysid.models import LogModel
from sysid.workers import Workers

#: What findings recommend, for programs that do not have it themselves.
OPTIONS = {
    "drop_flagged_rows": "--drop-flagged-rows",
    "accept_findings": "--accept-findings",
}


def add_data_arguments(add: Callable[..., Any]) -> None:
    """Adds what is done about what the check of the data finds.

    Args:
        add: a parser's `add_argument`.
    """
    add(
        "--drop-flagged-rows",
        action="store_true",
        help="leave out the rows that the check of the data flags: spikes, readings "
        "that move, jumps of time and the like (default: they are named, and fitted)",
    )
    add(
        "--accept-findings",
        nargs="+",
        default=[],
        choices=ACCEPTABLE,
        metavar="KIND",
        help="go on with data that the check refuses for findings of these kinds: "
        "axes, processing, units",
    )


def add_nominal_arguments(add: Callable[..., Any]) -> None:
    """Adds what names the nominal model of logs: --scenario and --urdf."""
    add(
        "--scenario",
        metavar="NAME|FILE",
        help="the nominal model (default: the scenario that the log states)",
    )
    add("--urdf", metavar="FILE", help="the arm of a log of joints")


def checked(
    logs: Sequence[Log],
    model: LogModel,
    args: argparse.Namespace,
    workers: Workers,
    whole_episodes: bool = False,
) -> tuple[LogModel, tuple[DataFinding, ...]]:
    """Returns the model of the rows that are fitted, and what is wrong with the data.

    Says on stderr what that is.

    Args:
        logs: of the model.
        model: of all their rows.
        args: with those of `add_data_arguments`.
        workers: evaluate the model.
        whole_episodes: whether an episode with a flagged row goes as a whole.

    Raises:
        DisasmError: no fit to these data means anything, and that is not accepted.
    """
    findings = check_data(logs, model, workers=workers)
    refuse(findings, args.accept_findings)
    for finding in findings:
        print(program.with_options(f"data: {finding.text}"), file=sys.stderr)
    if args.drop_flagged_rows:
        rows = model.measurements.rows
        model = without_flagged_rows(logs, model, findings, whole_episodes)
        left_out = rows - model.measurements.rows
        print(f"data: {left_out} of {rows} rows are left out", file=sys.stderr)
    return model, findings

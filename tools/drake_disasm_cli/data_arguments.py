"""What programs that fit logs share: the check of the data, and its options."""

import argparse
import sys
from collections.abc import Callable, Sequence
from typing import Any

from drake_disasm.common import program
from drake_disasm.common.errors import DisasmError
from drake_disasm.logs import Log
from sysid.data_checks import (
    ACCEPTABLE,
    DataFinding,
    check_data,
    refuse,
    without_flagged_rows,
)
from sysid.models import LogModel
from sysid.motor_constants import (
    MotorConstants,
    constants_by_payload,
    constants_by_urdf,
    given_constants,
    has_currents,
)
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
    add_motor_constants_argument(add)


def add_motor_constants_argument(add: Callable[..., Any]) -> None:
    """Adds --motor-constants."""
    add(
        "--motor-constants",
        nargs="+",
        metavar="K|urdf",
        help="of a log with motor currents: torque by current [N m/A] of each joint; "
        "or urdf, to identify them by the URDF's masses",
    )


def in_torques(
    logs: Sequence[Log], args: argparse.Namespace, references: int = 0
) -> tuple[tuple[Log, ...], MotorConstants | None]:
    """Returns logs whose currents are torques, and by which motor constants.

    Args:
        logs: of one kind.
        args: with --motor-constants and --urdf, and perhaps --known-payload.
        references: number of logs without the known payload, which come first.

    Raises:
        DisasmError: a log with currents does not say how, or one with torques does.
    """
    payload = getattr(args, "known_payload", None)
    wanted = [("--motor-constants", args.motor_constants), ("--known-payload", payload)]
    given = [option for option, value in wanted if value is not None]
    if not has_currents(logs):
        if given:
            raise DisasmError(
                f"{given[0]}: {logs[0].folder} has no motor currents in place of "
                "torques; leave it out"
            )
        return tuple(logs), None
    if len(given) != 1:
        raise DisasmError(
            f"{logs[0].folder}: has motor currents and no torques; give "
            "--motor-constants, by joint or as urdf, or close-loop's --known-payload "
            "with --reference logs that lack it"
        )
    if payload is not None:
        constants = constants_by_payload(logs, references, payload, args.urdf)
    elif args.motor_constants == ["urdf"]:
        constants = constants_by_urdf(logs, args.urdf)
    else:
        values = [_motor_constant(text) for text in args.motor_constants]
        constants = given_constants(logs[0].header.joints, values)
    return constants.torques(logs), constants


def _motor_constant(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise DisasmError(
            f"--motor-constants {text}: give numbers in N m/A, or urdf"
        ) from None


def with_constants(model: LogModel, constants: MotorConstants | None) -> LogModel:
    """Returns a model that says what its torques rest on."""
    if constants is None:
        return model
    return model.replace(assumptions=(*model.assumptions, constants.assumption))


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

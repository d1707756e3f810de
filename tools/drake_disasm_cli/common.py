"""What the command-line programs share: arguments, and logs by name."""

import argparse
import os
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from drake_disasm.common import options, program
from drake_disasm.common.cluster import EXECUTORS
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.logs import Log, read_logs
from drake_disasm.parts import import_own
from drake_disasm.scenario import (
    Scenario,
    load_scenario,
    shipped_scenarios,
    with_hidden_effects,
)
from drake_disasm.stations import SIMULATED_STATIONS, STATIONS


def add_scenario_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds --scenario, --set and --import."""
    parser.add_argument(
        "--scenario",
        default="removal",
        metavar="NAME|FILE",
        help=f"a shipped scenario ({', '.join(shipped_scenarios())}) or a YAML file "
        "(default: removal)",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="overrides",
        help="override one field, e.g. part.clearance=0.0003, effects.0.ry=0.02 or "
        "'effects=[!SensorBias {fx: 0.5}]'; repeatable",
    )
    add_import_argument(parser)


def add_import_argument(parser: argparse.ArgumentParser) -> None:
    """Adds --import, which acts as soon as it is parsed, before anything is read."""
    parser.add_argument(
        "--import",
        action="append",
        default=[],
        type=import_own,
        metavar="FILE.py|MODULE",
        dest="imports",
        help="import effects or parts of your own (@register_effect, @register_part), "
        "which scenarios and logs may then have; repeatable",
    )


def add_station_argument(
    add: Callable[..., Any], default: str, text: str, hardware: bool = False
) -> None:
    """Adds --station.

    Args:
        add: a parser's `add_argument`.
        default: the station's name.
        text: what the help says of it.
        hardware: whether the program can run the real station, too.
    """
    add(
        "--station",
        default=default,
        metavar="|".join(STATIONS if hardware else SIMULATED_STATIONS),
        type=_station if hardware else _simulated_station,
        help=f"{text} (default: {default})",
    )


def _station(name: str) -> str:
    """Returns the name of a station, for an argument's type."""
    if name not in STATIONS:
        raise DisasmError(
            f"--station {name}: does not exist; {closest(name, list(STATIONS))}"
        )
    return name


def _simulated_station(name: str) -> str:
    if _station(name) == "hardware":
        raise DisasmError(
            "--station hardware: this program simulates; use cell or twin, or run "
            "a policy on the devices by `drake-disasm simulate --station hardware`"
        )
    return name


def add_policies_argument(add: Callable[..., Any]) -> None:
    """Adds --policy, one or more."""
    add(
        "--policy",
        nargs="+",
        required=True,
        metavar="NAME",
        help="scripted or shipped names, .npz files, FILE.py:Class or module:name",
    )


def add_log_argument(add: Callable[..., Any]) -> None:
    """Adds --log, which is required."""
    add(
        "--log",
        nargs="+",
        required=True,
        type=Path,
        metavar="DIR",
        help="folders of logs of one kind",
    )


def add_hidden_argument(add: Callable[..., Any]) -> None:
    """Adds --hidden."""
    add(
        "--hidden",
        metavar="NAME|FILE",
        help="simulate --scenario with the effects of this scenario or file of effects "
        "added, while the log states --scenario alone: a reality with effects that "
        "nobody declared",
    )


def real_scenario(args: argparse.Namespace, nominal: Scenario) -> Scenario:
    """Returns what is simulated: the nominal scenario with the effects of --hidden."""
    if not args.hidden:
        return nominal
    return with_hidden_effects(nominal, args.hidden, load_scenario(args.scenario))


def wait_for_enter(prompt: str) -> None:
    """Waits until somebody presses Enter, or Ctrl-D."""
    try:
        input(prompt)
    except EOFError:
        print()


def add_view_arguments(add: Callable[..., Any]) -> None:
    """Adds --no-meshcat, --meshcat-host and --realtime-rate.

    Args:
        add: a parser's `add_argument`.
    """
    add("--no-meshcat", action="store_true", help="run without a view, at full speed")
    add(
        "--meshcat-host",
        default="localhost",
        metavar="HOST",
        help="address that the page listens on; '*' for all (default: localhost)",
    )
    add(
        "--realtime-rate",
        type=options.nonnegative,
        metavar="X",
        help="1 is real time, 0 full speed (default: 1 if somebody watches, else 0)",
    )


def realtime_rate(args: argparse.Namespace) -> float:
    """Returns the rate at which to simulate: 1 is real time, 0 full speed."""
    if args.realtime_rate is not None:
        return float(args.realtime_rate)
    return 0.0 if args.no_meshcat or not sys.stdout.isatty() else 1.0


def add_workers_argument(parser: argparse.ArgumentParser, more: str = "") -> None:
    """Adds --workers, with more to say about it."""
    parser.add_argument(
        "--workers",
        type=options.positive,
        default=os.cpu_count() or 1,
        metavar="N",
        help=f"processes (default: one per core){more}",
    )


def add_executor_arguments(parser: argparse.ArgumentParser, more: str = "") -> None:
    """Adds --workers, --executor, --scheduler and --tls."""
    add_workers_argument(parser, more or "; jobs at a time with --executor dask")
    parser.add_argument(
        "--executor",
        default="local",
        choices=EXECUTORS,
        help="what does the work: processes of this program, or a Dask cluster whose "
        "workers see the same files (default: local)",
    )
    parser.add_argument(
        "--scheduler",
        default="",
        metavar="ADDRESS",
        help="of the Dask cluster: tcp://HOST:PORT, or tls://HOST:PORT",
    )
    parser.add_argument(
        "--tls",
        nargs=3,
        default=(),
        type=Path,
        metavar=("CA", "CERTIFICATE", "KEY"),
        help="PEM files for a scheduler tls://HOST:PORT (default: those of Dask's "
        "configuration)",
    )


def named_logs(folders: Iterable[str | Path]) -> tuple[Log, ...]:
    """Returns the logs in some folders; says on stderr what of them is left out.

    Raises:
        DisasmError: one can't be read, or they are of different kinds.
    """
    logs = read_logs(folders)
    for remark in (remark for log in logs for remark in log.remarks):
        print(program.with_options(remark), file=sys.stderr)
    return logs

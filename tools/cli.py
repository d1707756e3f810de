"""What the command-line programs share."""

import argparse
import importlib
import importlib.metadata
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import FrameType
from typing import Any

from drake_disasm.errors import DisasmError
from drake_disasm.policies import (
    SCRIPTED,
    find_policy,
    load_policy,
    make_policy,
    shipped_policies,
)
from drake_disasm.quantity import closest
from drake_disasm.scenario import Scenario, shipped_scenarios
from drake_disasm.systems.policy import Policy

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130


class _Interrupt:
    """Remembers Ctrl-C, since a KeyboardInterrupt can get lost on its way.

    Python raises it wherever it happens to be; in a callback that some library calls
    from C++, or in a finaliser, it is printed or dropped there and the run goes on.
    """

    pressed = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        self.pressed = True
        signal.default_int_handler(number, frame)


_interrupt = _Interrupt()


def stop_if_interrupted() -> None:
    """Raises KeyboardInterrupt once more if Ctrl-C was pressed; call it in a loop."""
    if _interrupt.pressed:
        raise KeyboardInterrupt


def run(main: Callable[[Sequence[str]], int]) -> None:
    """Calls a program's main and exits; bad input is one line and status 2."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupt)
    try:
        sys.exit(main(sys.argv[1:]))
    except DisasmError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(EXIT_BAD_INPUT)
    except KeyboardInterrupt:
        print("interrupted; what was finished is kept", file=sys.stderr)
        sys.exit(EXIT_INTERRUPTED)


def add_scenario_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds --scenario and --set."""
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
        help="override one field, e.g. lock.clearance=0.0003, effects.0.ry=0.02 or "
        "'effects=[!SensorBias {fx: 0.5}]'; repeatable",
    )


def add_workers_argument(parser: argparse.ArgumentParser, more: str = "") -> None:
    """Adds --workers, with more to say about it."""
    parser.add_argument(
        "--workers",
        type=positive,
        default=os.cpu_count() or 1,
        metavar="N",
        help=f"processes (default: one per core){more}",
    )


def named_policy(name: str, scenario: Scenario) -> Policy:
    """Returns a scripted or trained policy, or the callable of `package.module:name`.

    Args:
        name: of a scripted or a shipped policy, a path to an .npz, or a callable.
        scenario: that it is to act on.

    Raises:
        DisasmError: there is none of that name, or it does not fit the scenario.
    """
    if name in SCRIPTED:
        return make_policy(name)
    if path := find_policy(name):
        policy = load_policy(path)
        policy.check_fits(scenario)
        return policy
    if ":" in name:
        return _imported(name)
    known = [*SCRIPTED, *shipped_policies()]
    raise DisasmError(
        f"policy '{name}' does not exist; {closest(name, known)} or give an .npz file "
        "or module:callable"
    )


def _imported(name: str) -> Policy:
    module, _, attribute = name.partition(":")
    try:
        policy = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise DisasmError(
            f"policy {name}: {error}; write {'|'.join(SCRIPTED)}, an .npz file or "
            "module:callable"
        ) from None
    if not callable(policy):
        raise DisasmError(f"policy {name}: is not callable; it maps (12,) to (6,)")
    return policy


def positive(text: str) -> int:
    """Returns a whole number above zero, for an argument's type."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError("must be at least 1")
    return value


def provenance(program: str, arguments: Sequence[str], seed: int) -> dict[str, Any]:
    """Returns where a result is from, as plain data for a log's header."""
    packages = ("drake", "numpy", "torch", "drake_disasm")
    return {
        "program": program,
        "command": " ".join(["python", f"tools/{program}.py", *arguments]),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "seed": seed,
        "versions": {name: _version(name) for name in packages},
        "commit": _commit(),
    }


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def _commit() -> str:
    """Returns the checkout's commit, marked if the tree is not clean."""
    folder = Path(__file__).resolve().parent
    try:
        return subprocess.run(
            ["git", "describe", "--always", "--dirty", "--abbrev=12"],
            cwd=folder,
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"

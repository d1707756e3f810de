"""What every command-line program does: exit statuses, Ctrl-C, provenance."""

import importlib.metadata
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import FrameType
from typing import Any

from drake_disasm.common.errors import DisasmError

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

"""What every command-line program does: exit statuses, Ctrl-C, progress, provenance."""

import argparse
import importlib.metadata
import math
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn, Self

from tqdm import tqdm

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.progress import ProgressUpdate

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
    sys.exit(status(main, sys.argv[1:]))


def status(main: Callable[[Sequence[str]], int], arguments: Sequence[str]) -> int:
    """Returns the exit status of a program's main; errors are told on stderr."""
    try:
        return main(arguments)
    except DisasmError as error:
        print(f"error: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        print("interrupted; what was finished is kept", file=sys.stderr)
        return EXIT_INTERRUPTED


class _Parser(argparse.ArgumentParser):
    """Refuses a command line as everything else is refused: in one line."""

    def error(self, message: str) -> NoReturn:
        """Raises DisasmError."""
        raise DisasmError(f"{' '.join(message.split())}; see --help")


def argument_parser(
    name: str, description: str | None, epilog: str
) -> argparse.ArgumentParser:
    """Returns a parser whose help shows both texts line by line.

    What it refuses is a DisasmError.

    Args:
        name: of the program, without `.py`.
        description: its docstring.
        epilog: examples.
    """
    return _Parser(
        prog=f"{name}.py",
        description=description,
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


class ProgressBar:
    """Shows progress on the terminal: one bar per stage, lines above it.

    Give it to a library call as its `progress`:

        with ProgressBar(unit="episode") as progress:
            train(..., progress=progress)

    Ctrl-C is raised at the next update even where a library swallowed it.
    """

    def __init__(self, unit: str = "", keep: bool = False) -> None:
        """Shows nothing yet.

        Args:
            unit: of the work that is counted, such as "episode".
            keep: whether a finished bar stays on the terminal.
        """
        self._unit = f" {unit}" if unit else ""
        self._keep = keep
        self._bar: tqdm | None = None
        self._stage = ""

    def __call__(self, update: ProgressUpdate) -> None:
        """Shows an update."""
        stop_if_interrupted()
        if not (update.done or update.total):
            if update.message:
                tqdm.write(update.message)
            return
        bar = self._bar_of(update)
        remarks = [update.message] if update.message else []
        if math.isfinite(update.value):
            remarks.insert(0, f"{update.value:.4g}")
        bar.set_postfix_str(", ".join(remarks), refresh=False)
        bar.update(update.done - bar.n)

    def close(self) -> None:
        """Ends the bar."""
        if self._bar is not None:
            self._bar.close()
        self._bar = None

    def _bar_of(self, update: ProgressUpdate) -> tqdm:
        """Returns the stage's bar; a new one where the stage is new."""
        if self._bar is None or update.stage != self._stage:
            self.close()
            self._stage = update.stage
            self._bar = tqdm(desc=update.stage, unit=self._unit, leave=self._keep)
        self._bar.total = update.total or None
        return self._bar

    def __enter__(self) -> Self:
        """Returns the bar."""
        return self

    def __exit__(self, *_: object) -> None:
        """Ends the bar."""
        self.close()


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

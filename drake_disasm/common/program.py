"""What every command-line program does: exit status, signals, progress, provenance."""

import argparse
import importlib.metadata
import math
import os
import re
import select
import shlex
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, ClassVar, NoReturn, Self

from tqdm import tqdm

from drake_disasm.common import drake_warnings, stopping
from drake_disasm.common.errors import DisasmError, DisasmWarning
from drake_disasm.common.progress import ProgressUpdate

EXIT_BAD_INPUT = 2
EXIT_UNREAD = 141

_LINE_PERIOD = 30.0  # s, between lines of progress where stderr is no terminal
_ARGUMENT = re.compile(r"`([a-z_]+)`")


def run(main: Callable[[Sequence[str]], int]) -> None:
    """Calls a program's main and exits; bad input is one line and status 2."""
    stopping.handle_signals()
    warnings.formatwarning = _one_line_for_ours(warnings.formatwarning)
    drake_warnings.keep_back()
    code = status(main, sys.argv[1:])
    summary = drake_warnings.summary()
    if summary and not stopping.is_stopping():  # which is one line
        print(summary, file=sys.stderr)
    sys.exit(code)


def _one_line_for_ours(usual: Callable[..., str]) -> Callable[..., str]:
    """Returns a `warnings.formatwarning` that tells our warnings as errors are told."""

    def told(message: Warning | str, category: type[Warning], *rest: Any) -> str:
        """Returns a warning as text."""
        if issubclass(category, DisasmWarning):
            return f"warning: {message}\n"
        return usual(message, category, *rest)

    return told


def status(main: Callable[[Sequence[str]], int], arguments: Sequence[str]) -> int:
    """Returns the exit status of a program's main; errors are told on stderr."""
    try:
        found = main(arguments)
        sys.stdout.flush()
        return found
    except BrokenPipeError:
        if not _is_unread(sys.stdout.fileno()):
            raise
        # Whoever read it has seen enough (`| head`). At exit Python would flush again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_UNREAD
    except DisasmError as error:
        print(f"error: {with_options(str(error))}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        return stopping.report()
    except Exception:
        if stopping.is_stopping():
            return stopping.report()
        raise


def with_options(message: str, more: Mapping[str, str] | None = None) -> str:
    """Returns a message in which a library's arguments are the program's options.

    What a library calls `held_out` is --held-out to whoever typed the command.

    Args:
        message: of a library.
        more: options of other programs, by the names of the arguments.
    """
    names = {**(more or {}), **_Parser.option_names}
    return _ARGUMENT.sub(lambda found: names.get(found[1], found[0]), message)


def _is_unread(descriptor: int) -> bool:
    """Returns whether a stream's other end is closed."""
    poll = select.poll()
    poll.register(descriptor, 0)
    return any(event & select.POLLERR for _, event in poll.poll(0))


class _Parser(argparse.ArgumentParser):
    """Refuses a command line as everything else is refused: in one line.

    Attributes:
        option_names: by the names of their values, of the parser that was last used.
    """

    option_names: ClassVar[dict[str, str]] = {}

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Returns what argparse does; remembers the options for messages."""
        _Parser.option_names = {
            action.dest: action.option_strings[-1]
            for action in self._actions
            if action.option_strings
        }
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        """Raises DisasmError."""
        raise DisasmError(f"{' '.join(message.split())}; see --help")


class _Verbose(argparse.Action):
    """Shows Drake's warnings from here on."""

    def __call__(self, *_: object) -> None:
        drake_warnings.show()


def argument_parser(
    name: str, description: str | None, epilog: str
) -> argparse.ArgumentParser:
    """Returns a parser whose help shows both texts line by line.

    What it refuses is a DisasmError.

    Args:
        name: as it is typed, such as "drake-disasm simulate".
        description: its docstring.
        epilog: examples.
    """
    parser = _Parser(
        prog=name,
        description=description,
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--verbose",
        action=_Verbose,
        nargs=0,
        help="show Drake's warnings about model files (default: their number)",
    )
    return parser


class ProgressBar:
    """Shows progress on stderr: one bar per stage, lines above it.

    Give it to a library call as its `progress`:

        with ProgressBar(unit="episode") as progress:
            train(..., progress=progress)

    Where stderr is no terminal but a file, a bar would be written to it thousands of
    times: there a line says how far it is, twice a minute at most.

    Ctrl-C or SIGTERM is raised at the next update even where a library swallowed it.
    """

    def __init__(self, unit: str = "", keep: bool = False) -> None:
        """Shows nothing yet.

        Args:
            unit: of the work that is counted, such as "episode".
            keep: whether a finished bar stays on the terminal, or the last line of a
                stage is written in any case.
        """
        self._unit = f" {unit}" if unit else ""
        self._keep = keep
        self._bar: tqdm | None = None
        self._stage = ""
        self._line = ""
        self._is_terminal = sys.stderr.isatty()
        self._next_line = time.monotonic() + _LINE_PERIOD

    def __call__(self, update: ProgressUpdate) -> None:
        """Shows an update."""
        stopping.stop_if_interrupted()
        if not (update.done or update.total):
            if update.message:
                tqdm.write(update.message)
            return
        if update.stage != self._stage:
            self.close()
            self._stage = update.stage
        remarks = [update.message] if update.message else []
        if math.isfinite(update.value):
            remarks.insert(0, f"{update.value:.4g}")
        if self._is_terminal:
            self._draw(update, ", ".join(remarks))
        else:
            self._note(update, remarks)

    def close(self) -> None:
        """Ends the bar."""
        if self._bar is not None:
            self._bar.close()
        self._bar = None
        if self._line and self._keep:
            self._write()

    def _draw(self, update: ProgressUpdate, remarks: str) -> None:
        """Moves the stage's bar; a new one where the stage is new."""
        if self._bar is None:
            self._bar = tqdm(desc=update.stage, unit=self._unit, leave=self._keep)
        self._bar.total = update.total or None
        self._bar.set_postfix_str(remarks, refresh=False)
        self._bar.update(update.done - self._bar.n)

    def _note(self, update: ProgressUpdate, remarks: Sequence[str]) -> None:
        """Keeps an update as a line, and writes it if the last one is long ago."""
        count = f"{update.done}/{update.total}" if update.total else f"{update.done}"
        self._line = f"{update.stage}: " + ", ".join([count + self._unit, *remarks])
        if time.monotonic() >= self._next_line:
            self._write()

    def _write(self) -> None:
        print(self._line, file=sys.stderr, flush=True)
        self._line = ""
        self._next_line = time.monotonic() + _LINE_PERIOD

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
        "command": shlex.join([*program.split(), *arguments]),
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

"""Reads damaged files and datagrams: nothing but the documented error may come.

Each case is damaged at random, or by design (nesting, aliases, long numbers, wrong
types, NaN), and read in another process under a watchdog. Prints a table as Markdown,
row by row; exits with 1 if anything but a DisasmError came, or a refusal took two
seconds.
"""

import argparse
import contextlib
import dataclasses
import multiprocessing
import resource
import tempfile
import time
import zlib
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.common import options, program
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from drake_disasm.common.quantity import closest
from drake_disasm.common.text import clipped

READERS = (
    *("log_csv", "log_parquet", "log_unfinished", "scenario", "policy", "checkpoint"),
    *("hardware", "parameters", "results"),
    *("import_csv", "import_npz", "import_npy", "import_mat", "import_parquet"),
    *("import_ur", "import_join", "import_calibration"),
    *("import_lerobot", "import_mcap", "import_ros2", "import_ros1", "import_map"),
    *("import_orientations", "import_xlsx"),
)
CODECS = (
    *("hex_sample", "hex_request", "robotiq_status", "robotiq_command"),
    "iiwa_status",
)
SLOW = 2.0  # s of the processor's time
_MOST_FAILURES = 100  # at the next end of the process the rest is left out
_HANGS = 60.0  # s, on a machine that is busy
_MEMORY = 4 * 2**30  # bytes that reading may take
_HEAD = (
    "| reader | tried | accepted | refused | other exceptions | slowest refusal |\n"
    "|---|---|---|---|---|---|"
)
_EXAMPLES = """examples:
  python benchmarks/fuzz.py --files 1000 --datagrams 10000 --seed 1
  python benchmarks/fuzz.py --only scenario --seed 1 --case 4711   that one, here
"""


@dataclasses.dataclass
class Row:
    """What came of a reader's cases.

    Attributes:
        name: of the reader.
        tried, accepted, refused: cases.
        failures: those that gave another exception, hung, ended the process, or were
            refused too slowly or in several lines: number and what came.
        slowest: refusal [s of the processor's time].
    """

    name: str
    tried: int = 0
    accepted: int = 0
    refused: int = 0
    failures: list[tuple[int, str]] = dataclasses.field(default_factory=list)
    slowest: float = 0.0

    @property
    def text(self) -> str:
        """The row of the table, in Markdown."""
        others = self.tried - self.accepted - self.refused
        return (
            f"| {self.name} | {self.tried} | {self.accepted} | {self.refused} | "
            f"{others} | {self.slowest:.2f} s |"
        )

    def add(self, number: int, found: str, seconds: float) -> None:
        """Counts a case by what was found of it."""
        self.tried += 1
        if found == "accepted":
            self.accepted += 1
            return
        if found != "refused":
            self.failures.append((number, found))
            return
        self.refused += 1
        self.slowest = max(self.slowest, seconds)
        if seconds >= SLOW:
            self.failures.append((number, f"refused after {seconds:.1f} s"))


@dataclasses.dataclass(frozen=True)
class Job:
    """Cases that a process reads.

    Attributes:
        name: of the reader.
        seed: of the damage.
        numbers: of the cases.
    """

    name: str
    seed: int
    numbers: range


#: Reads cases in another process; see `read_cases`.
Worker = Callable[[Job, str, Connection], None]


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("python benchmarks/fuzz.py", __doc__, _EXAMPLES)
    add = parser.add_argument
    names = ", ".join((*READERS, *CODECS))
    usual = {"files": (1000, "reader"), "datagrams": (10_000, "codec")}
    for option, (count, what) in usual.items():
        text = f"cases per {what} (default: {count})"
        add(f"--{option}", type=options.positive, default=count, metavar="N", help=text)
    add("--seed", type=options.seed, default=0, metavar="S", help="(default: 0)")
    add("--only", default="", metavar="NAME,...", help=f"of {names}")
    add("--case", type=options.count, metavar="N", help="read this one in this process")
    args = parser.parse_args(arguments)
    args.only = args.only.split(",") if args.only else [*READERS, *CODECS]
    for name in args.only:
        if name not in (*READERS, *CODECS):
            known = closest(name, [*READERS, *CODECS])
            raise DisasmError(f"--only {clipped(name)}: no such reader; {known}")
    return args


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    if args.case is not None:
        with _temporary() as folder, _for_temporary_files(folder):
            for name in args.only:
                print(f"{name}: {_read_here(name, args.seed, args.case)}")
        return 0
    rows = []
    print(_HEAD, flush=True)
    with program.ProgressBar(unit="case") as progress:
        for name in args.only:
            count = args.files if name in READERS else args.datagrams
            rows.append(fuzz(name, args.seed, count, progress))
            print(rows[-1].text, flush=True)
    for row in rows:
        for number, what in row.failures[:10]:
            print(f"--only {row.name} --seed {args.seed} --case {number}: {what}")
    return int(any(row.failures for row in rows))


def fuzz(
    name: str,
    seed: int,
    count: int,
    progress: Progress = ignore_progress,
    worker: Worker | None = None,
    patience: float = _HANGS,
) -> Row:
    """Reads a number of damaged cases; returns what came of them.

    Args:
        name: of the reader.
        seed: of the damage; with the case's number it says all.
        count: cases.
        progress: updated after each.
        worker: reads them in the other process, instead of `read_cases`.
        patience: that one case is given [s].
    """
    row = Row(name)
    while row.tried < count and len(row.failures) < _MOST_FAILURES:
        job = Job(name, seed, range(row.tried, count))
        for number, found, seconds in _watched(job, worker or read_cases, patience):
            row.add(number, found, seconds)
            progress(ProgressUpdate(name, row.tried, count))
    return row


def _watched(
    job: Job, worker: Worker, patience: float
) -> Iterator[tuple[int, str, float]]:
    """Yields number, verdict and time of cases, up to one that ends the process."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    folder = _temporary()
    arguments = (job, folder.name, theirs)
    process = context.Process(target=worker, args=arguments, daemon=True)
    process.start()
    theirs.close()
    number = job.numbers.start
    try:
        ours.recv()  # it has imported everything; that takes its time
        for number in job.numbers:
            if not ours.poll(patience):
                yield number, f"hung for {patience:g} s", patience
                return
            yield number, *ours.recv()
    except EOFError:
        process.join()
        yield number, f"ended the process (exit status {process.exitcode})", 0.0
    finally:
        process.kill()
        process.join()
        folder.cleanup()


def _temporary() -> "tempfile.TemporaryDirectory[str]":
    """Returns a folder in memory, where there is one."""
    memory = Path("/dev/shm")
    parent = memory if memory.is_dir() else None
    return tempfile.TemporaryDirectory(prefix="fuzz_", dir=parent)


@contextlib.contextmanager
def _for_temporary_files(folder: str) -> Iterator[None]:
    """Has temporary files in a folder, for as long as it is there."""
    before, tempfile.tempdir = tempfile.tempdir, folder
    try:
        yield
    finally:
        tempfile.tempdir = before


def read_cases(job: Job, folder: str, sender: Connection) -> None:
    """Reads cases and sends what came of each; runs in a process of its own.

    Args:
        job: which cases.
        folder: for files.
        sender: gets anything when it is ready, then verdict and time [s] of each.
    """
    tempfile.tempdir = folder
    subject = _subject(job.name)
    _limit_memory()
    sender.send("ready")
    for number in job.numbers:
        content = subject.make(_random(job.name, job.seed, number))
        begun = time.process_time()
        found = verdict(subject, content)
        sender.send((found, time.process_time() - begun))


def verdict(subject: Any, content: Any) -> str:
    """Returns what comes of reading: accepted, refused, or what else it raised."""
    try:
        subject.read(content)
    except DisasmError as error:
        lines, length = str(error).splitlines(), len(str(error))
        return "refused" if len(lines) == 1 and length < 1000 else "refused at length"
    except BaseException as error:
        return f"{type(error).__name__}: {clipped(str(error), 200)}"
    return "accepted"


def _read_here(name: str, seed: int, number: int) -> str:
    """Reads one case; what it raises gets out, but for the documented error."""
    subject = _subject(name)
    content = subject.make(_random(name, seed, number))
    print(clipped(repr(content), 2000))
    try:
        return f"accepted: {clipped(repr(subject.read(content)))}"
    except DisasmError as error:
        return f"refused: {error}"


def _subject(name: str) -> Any:
    from fuzz_subjects import SUBJECTS  # Drake and PyTorch, in the other process only

    return SUBJECTS[name]()


def _random(name: str, seed: int, number: int) -> np.random.Generator:
    return np.random.default_rng([seed, zlib.crc32(name.encode()), number])


def _limit_memory() -> None:
    """Makes what would fill the machine a MemoryError of this process."""
    with open("/proc/self/statm") as file:
        now = int(file.read().split()[0]) * resource.getpagesize()
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (now + _MEMORY, hard))


if __name__ == "__main__":
    program.run(main)

"""Runners look for what is hidden in worlds, and are judged.

A world is a simulated cell with hydroelastic contact, and one effect in it or none; a
runner gets its model, without the effect, and seconds of its robot. Groups of worlds:
`pairs` (an effect that logs of removals leave ambiguous with another, 100), `null`
(nothing is hidden, 20), `missing` (an effect that the library lacks, 20), `parts` (all
of these on three parts, 60), `held_out` (pairs again, 140; no rule was chosen on those
from 94 on).

A runner is a function of `diagnosis/runners.py` (ours, passive, by_chance), or one of
your own: MODULE:FUNCTION, in a module that Python finds, with the arguments and the
result of `diagnosis.answer.Runner`.

Right is an answer that names what is hidden, and nothing beside or in doubt; of a world
whose effect the library lacks one that says so, with what it depends on, and names
nothing. A false name is one that is not hidden, said beyond doubt.
"""

import argparse
import dataclasses
import importlib
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

sys.path.insert(0, str(Path(__file__).parents[1]))

from results import Cell, add_results_argument, markdown, write_result

from diagnosis import runners
from diagnosis.answer import Answer, Runner
from diagnosis.worlds import GROUPS, World, draw
from drake_disasm.common import options
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.executors import WorkerPool
from drake_disasm.common.finished_work import FinishedWork
from drake_disasm.common.program import ProgressBar, argument_parser, run
from drake_disasm.common.progress import Progress, ProgressUpdate
from drake_disasm.effects import Effect
from drake_disasm.learning.statistics import wilson_interval

_PROGRAM = "benchmarks/diagnosis/judge.py"
_EXAMPLES = """examples:
  python benchmarks/diagnosis/judge.py pairs --runner ours --worlds 14
  python benchmarks/diagnosis/judge.py pairs --runner ours passive by_chance \\
      --seconds-of ours
  PYTHONPATH=. python benchmarks/diagnosis/judge.py parts --runner mine:look
"""
_COLUMNS = (
    *("worlds", "runner", "number", "right", "95 % interval [%]"),
    *("right name among those left", "worlds with a false name"),
    *("robot time, median [s]", "greatest [s]", "greatest force [N]"),
    *("cut short", "against the first: better, worse, p"),
)


@dataclasses.dataclass(frozen=True)
class _Job:
    """A world, and who looks for what is hidden in it."""

    runner: str
    group: str
    number: int
    seconds: float
    folder: str

    @property
    def key(self) -> list[str | int]:
        """Of its answer."""
        return [self.runner, self.group, self.number]


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    add = parser.add_argument
    add("group", choices=list(GROUPS), help="of worlds")
    add(
        "--runner",
        nargs="+",
        default=["ours"],
        metavar="NAME",
        help="who is judged; the others are compared with the first (default: ours)",
    )
    add(
        "--worlds",
        nargs="+",
        type=options.count,
        metavar="N",
        help="the first N, those from N up to M, or these three and more "
        "(default: all of the group)",
    )
    add(
        "--seconds",
        type=options.above_zero,
        default=300.0,
        metavar="S",
        help="of the robot in each world (default: 300)",
    )
    add(
        "--seconds-of",
        metavar="NAME",
        help="runner, named before: the others get what it used in each world",
    )
    add(
        "--workers",
        type=options.positive,
        default=os.cpu_count() or 1,
        metavar="N",
        help="processes (default: one for each core)",
    )
    add(
        "--out",
        type=Path,
        default=Path("out/diagnosis"),
        metavar="DIR",
        help="keeps logs and answers; a run that was stopped goes on from there "
        "(default: out/diagnosis)",
    )
    add("--each", action="store_true", help="print a line for each world, too")
    add_results_argument(parser)
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> int:
    """Judges runners and prints the table; returns the exit status."""
    args = parse(arguments)
    for name in args.runner:
        _runner(name)  # an unknown one is refused before hours of work
    numbers = _numbers(args.group, args.worlds or [])
    kept = FinishedWork(args.out / "answers")
    found: dict[str, list[Answer]] = {}
    with ProgressBar(unit="world") as progress:
        for name in args.runner:
            first = dict(zip(numbers, found.get(args.seconds_of, ()), strict=False))
            jobs = [_job(args, name, number, first.get(number)) for number in numbers]
            found[name] = _answers(jobs, args.workers, kept, progress)
    worlds = [draw(args.group, number) for number in numbers]
    if args.each:
        for name, answers in found.items():
            for world, answer in zip(worlds, answers, strict=True):
                print(f"{name}: {_line(world, answer)}")
    rows = _rows(args.group, worlds, found)
    print(markdown(_COLUMNS, rows))
    title = "What is hidden in a cell, found by experiments"
    write_result(args.results, title, _COLUMNS, rows, _PROGRAM, arguments)
    return 0


def _numbers(group: str, worlds: Sequence[int]) -> Sequence[int]:
    """Returns the numbers of the worlds that are asked for.

    Raises:
        DisasmError: the group has none of a number, or no number is asked for.
    """
    every = range(GROUPS[group][1])
    few = range(*worlds) if 0 < len(worlds) < 3 else worlds or every
    if not few:
        raise DisasmError("--worlds: asks for none; give a number above 0, or two")
    if beyond := [number for number in few if number not in every]:
        raise DisasmError(
            f"--worlds: {group} has those from 0 to {every[-1]}, and no {beyond[0]}"
        )
    return few


def _job(
    args: argparse.Namespace, name: str, number: int, first: Answer | None
) -> _Job:
    seconds = first.robot_time if first else args.seconds
    folder = args.out.resolve() / name.replace(":", "_") / f"{args.group}_{number}"
    return _Job(name, args.group, number, seconds, str(folder))


def _answers(
    jobs: Sequence[_Job], workers: int, kept: FinishedWork, progress: Progress
) -> list[Answer]:
    """Returns the answers to jobs; those that are kept are not asked for again."""
    left = [job for job in jobs if kept.get(job.key) is None]
    with WorkerPool(workers, progress=progress) as pool:
        for job, plain in pool.run(_asked, left):
            kept.keep(job.key, plain)
    return [Answer.of_plain(kept.get(job.key)) for job in jobs]


def _asked(job: _Job, progress: Progress) -> dict[str, Any]:
    """Returns a runner's answer as plain data; that it was refused is one, too."""
    try:
        answer = _runner(job.runner)(
            draw(job.group, job.number), Path(job.folder), job.seconds
        )
    except DisasmError as error:
        answer = Answer((), open=("refused",), text=str(error))
    progress(ProgressUpdate(job.runner, 1, 1))
    return dataclasses.asdict(answer)


def _runner(name: str) -> Runner:
    """Returns the runner of a name.

    Raises:
        DisasmError: there is none.
    """
    module, _, function = name.rpartition(":")
    try:
        place = importlib.import_module(module) if module else runners
        found: Runner = getattr(place, function)
    except (ImportError, AttributeError) as error:
        raise DisasmError(
            f"--runner {name}: {error}; take ours, passive, by_chance or "
            "MODULE:FUNCTION"
        ) from None
    return found


def is_right(world: World, answer: Answer) -> bool:
    """Returns whether an answer is as right as the library allows."""
    if answer.open or (answer.is_unknown and not world.effects):
        return False
    if not world.is_in_library:
        return not answer.names and answer.is_unknown and bool(answer.depends_on)
    return set(answer.names) == set(world.hidden)


def _rows(
    group: str, worlds: Sequence[World], found: dict[str, list[Answer]]
) -> list[tuple[Cell, ...]]:
    """Returns a row for each runner, and of `pairs` for each pair."""
    first = next(iter(found.values()))
    rows = [
        _row(group, name, worlds, answers, first) for name, answers in found.items()
    ]
    pairs = dict.fromkeys(world.pair for world in worlds if world.pair)
    for pair in pairs if len(pairs) > 1 else ():
        own = [i for i, world in enumerate(worlds) if world.pair == pair]
        for name, answers in found.items():
            those = [worlds[i] for i in own]
            said, best = ([some[i] for i in own] for some in (answers, first))
            rows.append(_row(" or ".join(pair), name, those, said, best))
    return rows


def _row(
    what: str,
    name: str,
    worlds: Sequence[World],
    answers: Sequence[Answer],
    first: Sequence[Answer],
) -> tuple[Cell, ...]:
    pairs = list(zip(worlds, answers, strict=True))
    right = [is_right(*pair) for pair in pairs]
    low, high = wilson_interval(sum(right), len(right))
    among = [set(w.hidden) <= {*a.names, *a.open} for w, a in pairs if w.hidden]
    false = [bool(set(a.names) - set(w.hidden)) for w, a in pairs]
    times = [answer.robot_time for answer in answers]
    best = [is_right(*pair) for pair in zip(worlds, first, strict=True)]
    return (
        what,
        name,
        len(right),
        sum(right),
        f"{100 * low:.0f} to {100 * high:.0f}",
        f"{sum(among)} of {len(among)}" if among else "",
        sum(false),
        round(float(np.median(times))),
        round(max(times)),
        round(max(answer.force for answer in answers), 1),
        sum(bool(answer.cut_short) for answer in answers),
        _paired(right, best) if right != best else "",
    )


def _paired(right: Sequence[bool], first: Sequence[bool]) -> str:
    """Returns in how many worlds a runner is better than the first, and worse.

    With the two-sided p of the exact test of McNemar (1947).
    """
    better = sum(a and not b for a, b in zip(right, first, strict=True))
    worse = sum(b and not a for a, b in zip(right, first, strict=True))
    p = binomtest(better, better + worse).pvalue
    return f"{better}, {worse}, {p:.2g}"


def _text(effect: Effect) -> str:
    """Returns an effect with what of it is not zero."""
    values = {k: v for k, v in dataclasses.asdict(effect).items() if v}
    said = ", ".join(f"{name}={value:g}" for name, value in values.items())
    return f"{type(effect).__name__}({said})"


def _line(world: World, answer: Answer) -> str:
    """Returns what was hidden and what was said."""
    hidden = ", ".join(map(_text, world.effects)) or "nothing"
    said = " and ".join(answer.names) or "nothing"
    doubt = f", in doubt {', '.join(answer.open)}" if answer.open else ""
    unknown = f", unknown: {', '.join(answer.depends_on)}" if answer.is_unknown else ""
    verdict = "right" if is_right(world, answer) else "wrong"
    return (
        f"{world.name}: {hidden}: {verdict}: {said}{doubt}{unknown} "
        f"({answer.robot_time:.0f} s)"
    )


if __name__ == "__main__":
    run(main)

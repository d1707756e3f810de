"""Verdicts on many logs: kept in a file as they come, counted, and shown as a table."""

import argparse
import dataclasses
import itertools
import json
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from results import add_results_argument, write_result

from drake_disasm.common import options
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import make_folder
from drake_disasm.learning.statistics import wilson_interval
from sysid.effect_selection.verdict import Verdict
from sysid.validation.blind_tests import named_with_ties

#: What was said of a log: its ending, the names, and whatever else.
Answer = dict[str, Any]

_COLUMNS = ("logs", "what is counted", "number", "of", "95 % interval [%]", "endings")


@dataclasses.dataclass(frozen=True)
class Count:
    """How many answers are of a kind.

    Attributes:
        logs: which, in words.
        what: is counted.
        right: number of answers of that kind.
        answers: all of them.
    """

    logs: str
    what: str
    right: int
    answers: Sequence[Answer]

    @property
    def cells(self) -> list[str | int]:
        """The row of a table, with Wilson's interval."""
        low, high = wilson_interval(self.right, len(self.answers))
        endings = Counter(str(each["ending"]) for each in self.answers)
        said = ", ".join(f"{n} {ending}" for ending, n in endings.most_common())
        interval = f"{100 * low:.1f} to {100 * high:.1f}"
        return [self.logs, self.what, self.right, len(self.answers), interval, said]


def of_verdict(found: Verdict) -> Answer:
    """Returns a verdict's ending, and where its effects stand.

    `names` are confirmed or ambiguous, `ties` are the rivals of each; `suggested` ones
    are neither.
    """
    names, ties = named_with_ties(found)
    return {
        "ending": found.ending,
        "names": list(names),
        "ties": [list(own) for own in ties],
        "suggested": list(found.suggested),
    }


def no_verdict(ending: str, text: str = "") -> Answer:
    """Returns the answer to a log that has no verdict, with the reason."""
    return {"ending": ending, "names": [], "ties": [], "suggested": [], "text": text}


def said(found: Answer) -> set[str]:
    """Returns the names in an answer and in its ambiguous sets, one by one."""
    texts = [*found["names"], *itertools.chain(*found["ties"])]
    return {name for text in texts for name in text.split(" and ")}


def add_arguments(parser: argparse.ArgumentParser, logs: int, out: str) -> None:
    """Adds --logs, --out and --results to a program's parser.

    Args:
        parser: of the program.
        logs: their number, by default.
        out: name of the folder under out/ that keeps the answers, by default.
    """
    parser.add_argument(
        "--logs",
        type=options.positive,
        default=logs,
        metavar="N",
        help=f"how many of each kind (default: {logs})",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("out", out),
        metavar="DIR",
        help="keeps logs and answers; a run that was stopped goes on from there "
        f"(default: out/{out})",
    )
    add_results_argument(parser)


def read_answers(path: Path) -> list[Answer]:
    """Returns the answers in a file, a line each; none if it is not there.

    Raises:
        DisasmError: a line is no answer.
    """
    lines = path.read_text().splitlines() if path.exists() else []
    try:
        return [dict(json.loads(line)) for line in lines]
    except (ValueError, TypeError):
        raise DisasmError(
            f"{path}: a line is no JSON object; delete the file to ask anew"
        ) from None


def complete(path: Path, count: int, answer: Callable[[int], Answer]) -> list[Answer]:
    """Returns so many answers; those that a file lacks are found and added to it.

    Args:
        path: of the file.
        count: answers.
        answer: to the log of a number.
    """
    known = {each["number"] for each in read_answers(path)}
    make_folder(path.parent)
    with path.open("a") as stream:
        for number in (n for n in range(count) if n not in known):
            found = {"number": number} | answer(number)
            print(json.dumps(found), file=stream, flush=True)
    return [each for each in read_answers(path) if each["number"] < count]


def report(
    counts: Sequence[Count],
    title: str,
    program: str,
    arguments: Sequence[str],
    results: Path | None,
) -> None:
    """Prints counts as Markdown, and writes them for the manual.

    Args:
        counts: the rows.
        title: caption of the table.
        program: such as "benchmarks/null_alarms.py".
        arguments: of its command line.
        results: file, as `--results` gives it.
    """
    rows = [count.cells for count in counts]
    lines = [_COLUMNS, ["---"] * len(_COLUMNS), *rows]
    print("\n".join(f"| {' | '.join(map(str, line))} |" for line in lines))
    write_result(results, title, _COLUMNS, rows, program, arguments)

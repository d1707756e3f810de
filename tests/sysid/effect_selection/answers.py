"""What closing the loop said of many logs: kept as it comes, and counted."""

import json
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from drake_disasm.learning.statistics import wilson_interval

#: What was said of a log: its ending, the names, and whatever else.
Answer = dict[str, object]


def read_answers(path: Path) -> list[Answer]:
    """Returns the answers in a file, a line each; none if it is not there."""
    lines = path.read_text().splitlines() if path.exists() else []
    return [json.loads(line) for line in lines]


def complete(path: Path, count: int, answer: Callable[[int], Answer]) -> list[Answer]:
    """Returns so many answers; those that a file lacks are found and added to it.

    Args:
        path: of the file.
        count: answers.
        answer: to the log of a number.
    """
    known = {each["number"] for each in read_answers(path)}
    with path.open("a") as stream:
        for number in (n for n in range(count) if n not in known):
            found = {"number": number} | answer(number)
            print(json.dumps(found), file=stream, flush=True)
    return read_answers(path)


def counted(name: str, what: str, right: int, answers: list[Answer]) -> str:
    """Returns how many of some answers are of a kind, with Wilson's interval."""
    low, high = wilson_interval(right, len(answers))
    endings = dict(Counter(str(each["ending"]) for each in answers))
    return (
        f"{name}: {right} of {len(answers)} {what} "
        f"(95 %: {100 * low:.1f} to {100 * high:.1f} %); {endings}"
    )

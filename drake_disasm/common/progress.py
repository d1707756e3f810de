"""How long-running library calls report their progress to whoever called them."""

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class ProgressUpdate:
    """What a long-running call reports while it runs.

    Attributes:
        stage: what is being done, such as "simulating" or "training".
        done: units of work finished in this stage, counted from its start.
        total: units of work in this stage; 0 if it is not known.
        message: with a count (`done` or `total`), a remark that is shown next to it;
            without one, a line of its own.
        value: figure of merit so far, such as the objective or the reward; NaN for
            none.
    """

    stage: str
    done: int = 0
    total: int = 0
    message: str = ""
    value: float = math.nan


#: Receives progress updates. It may raise, KeyboardInterrupt for one, to stop the call.
Progress = Callable[[ProgressUpdate], None]


def ignore_progress(update: ProgressUpdate) -> None:
    """Does nothing with a progress update: the default of library calls."""

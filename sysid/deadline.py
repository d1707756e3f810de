"""Work that ends when its time is over: what is left is left out."""

import math
import time
from collections.abc import Iterator


def parts_until(
    deadline: float, count: int, size: int, is_whole: bool = True
) -> Iterator[slice]:
    """Yields which pieces of work to do together, until the time is over.

    All of them without a deadline; with one, the first part whatever the time is.

    Args:
        deadline: by `time.monotonic` [s]; infinite for none.
        count: pieces of work.
        size: of a part, after which the time is looked at.
        is_whole: whether they are one part if there is no deadline.
    """
    step = size if deadline < math.inf or not is_whole else max(1, count)
    for begin in range(0, count, step):
        yield slice(begin, begin + step)
        if time.monotonic() > deadline:
            return

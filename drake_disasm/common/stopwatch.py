"""How long a part of a diagram takes, added up."""

import time
from collections.abc import Callable
from typing import Self


class Stopwatch:
    """Adds up the time that is spent in its `with` blocks.

    Attributes:
        total: so far [s].
        clock: by which; whoever reads the total may set its own.
    """

    def __init__(self) -> None:
        self.total, self._begun = 0.0, 0.0
        self.clock: Callable[[], float] = time.monotonic

    def start(self) -> None:
        """Begins a block."""
        self._begun = self.clock()

    def stop(self) -> None:
        """Ends the block."""
        self.total += self.clock() - self._begun

    def __enter__(self) -> Self:
        """Begins."""
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Ends."""
        self.stop()

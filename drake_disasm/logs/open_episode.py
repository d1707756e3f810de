"""An episode that is being recorded: its rows are kept as they come."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs.columns import flat_columns
from drake_disasm.logs.unfinished import RowFile


class OpenEpisode:
    """An episode whose rows are on the disk as they come (`LogWriter.begin_episode`).

    As a context manager it closes itself; what leaves the block by an exception is
    marked as cut off, with the exception as the reason.
    """

    def __init__(
        self,
        kind: str,
        begin: Callable[[list[str]], RowFile],
        end: Callable[[str | None], Path | None],
    ) -> None:
        """Writes nothing yet.

        Args:
            kind: of the log.
            begin: makes the file for rows with these columns, after a check of them.
            end: keeps what is in the file.
        """
        self._kind, self._begin, self._end = kind, begin, end
        self._file: RowFile | None = None

    def append(
        self, row: Mapping[str, ArrayLike], step: Mapping[str, ArrayLike]
    ) -> None:
        """Adds a row, which is kept from then on however the program ends.

        Args:
            row: quantity to value or vector: what was measured.
            step: of the step that led here, which belongs to the row before: action,
                reward; all zero in the first row.

        Raises:
            DisasmError: the columns break the format, or can't be written.
        """
        rows = {k: np.asarray(v)[np.newaxis] for k, v in {**row, **step}.items()}
        cells = {k: v[0] for k, v in flat_columns(self._kind, rows).items()}
        if self._file is None:
            self._file = self._begin(list(cells))
        self._file.append(cells)

    def close(self, cut_off: str | None = None) -> Path | None:
        """Turns the rows into an episode; again it does nothing.

        Args:
            cut_off: why the episode was ended from outside, if it was: the last row
                is `truncated` then, and the log's header has the reason.

        Returns:
            The episode's file; None if there are too few rows for one.

        Raises:
            DisasmError: the rows break the format, or can't be written; they stay on
                the disk, for the next start.
        """
        if self._file is None:
            return None
        self._file.close()
        self._file = None
        return self._end(cut_off)

    def __enter__(self) -> Self:
        """Returns the episode."""
        return self

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        """Closes it, with an error's text as the reason."""
        if error is None:
            self.close()
            return
        reason = _reason(error)
        try:
            self.close(reason)
        except DisasmError as unwritten:
            raise DisasmError(f"{reason}; besides, {unwritten}") from error


def _reason(error: BaseException) -> str:
    """Returns an error as the reason of a cut, on one line."""
    if isinstance(error, KeyboardInterrupt):
        return str(error) or "interrupted by Ctrl-C"
    text = str(error) if isinstance(error, DisasmError) else repr(error)
    return " ".join(text.split())

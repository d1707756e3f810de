"""Tables are read by this thread alone, as far as Python's memory goes."""

import io
import threading
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.logs.tables import FILE_FORMATS, read_table, write_table


class _Content(bytes):
    """The content of a file, whose parts note which threads let go of them last."""

    let_go: list[str]

    def partition(self, separator: bytes) -> tuple[bytes, bytes, bytes]:
        before, found, after = super().partition(separator)
        return before, found, _content(after, self.let_go)

    def __del__(self) -> None:
        self.let_go.append(threading.current_thread().name)


def _content(data: bytes, let_go: list[str]) -> _Content:
    content = _Content(data)
    content.let_go = let_go
    return content


@pytest.mark.parametrize("file_format", FILE_FORMATS)
def test_no_other_thread_lets_go_of_pythons_memory(file_format: str) -> None:
    """One that does while the interpreter ends aborts the process."""
    stream = io.BytesIO()
    columns = {f"column_{i}": np.arange(100.0) for i in range(80)}
    write_table(columns, file_format, stream)
    let_go: list[str] = []
    for _ in range(100):
        content = _content(stream.getvalue(), let_go)
        read_table(content, Path(f"table.{file_format}"), ())
        del content
    assert len(let_go) >= 100 and set(let_go) == {threading.current_thread().name}

"""Writing files atomically, and reading them within limits."""

import json
import os
import signal
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from drake_disasm.common import files
from tests.refusals import refusal


def test_ctrl_c_waits_for_a_file_that_is_being_written(tmp_path):
    path = tmp_path / "data.npz"

    def write(stream):
        os.kill(os.getpid(), signal.SIGINT)
        np.savez(stream, values=np.arange(3))

    with pytest.raises(KeyboardInterrupt):
        files.write_atomically(path, write)
    with np.load(path) as data:
        assert data["values"].tolist() == [0, 1, 2]
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)


def test_what_can_t_be_written_leaves_nothing(tmp_path) -> None:
    def fail(stream):
        stream.write(b"half")
        raise ValueError

    with pytest.raises(ValueError):
        files.write_atomically(tmp_path / "data.npz", fail)
    assert not list(tmp_path.iterdir())
    assert "; make the folder" in refusal(files.write_text, tmp_path / "no/text", "")
    (tmp_path / "file").touch()
    assert "; check" in refusal(files.write_text, tmp_path / "file/text", "")


def test_text_json_and_figures_come_back(tmp_path):
    files.write_text(tmp_path / "text", "20 µm\n")
    files.write_json(tmp_path / "json", {"a": [1, 0.1]})
    files.write_figure(tmp_path / "png", Figure(figsize=(1, 1)))
    assert (tmp_path / "text").read_text("utf-8") == "20 µm\n"
    assert json.loads((tmp_path / "json").read_text()) == {"a": [1, 0.1]}
    assert (tmp_path / "png").read_bytes().startswith(b"\x89PNG")
    assert len(list(tmp_path.iterdir())) == 3


def test_pipes_devices_folders_and_large_files_are_refused(tmp_path):
    """Opened as a file is, a pipe waits for a writer and /dev/zero never ends."""
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero"), Path("/dev/null")):
        assert "is no regular file" in refusal(files.read_bytes, path, "copy it", 100)
    assert "Is a directory" in refusal(files.read_bytes, tmp_path, "copy it", 9)
    assert "No such" in refusal(files.read_bytes, tmp_path / "no", "copy it", 9)
    assert "null" in refusal(files.read_bytes, tmp_path / "a\0", "copy it", 9)
    large = tmp_path / "a"
    large.write_bytes(bytes(100))
    assert len(files.read_bytes(large, "copy it", 100)) == 100
    assert "more than" in refusal(files.read_bytes, large, "copy it", 99)
    large.write_bytes(b"\xff\xfe")
    assert "UTF-8" in refusal(files.read_text, large, "copy it", 99)


@pytest.mark.parametrize(
    "text", ["[1]", "{", '{"a": 1, "b": {}}', "[" * 10**5, '{"a": ' + "9" * 5000 + "}"]
)
def test_damaged_json_is_refused(tmp_path, text):
    (tmp_path / "a").write_text(text)
    example = {"a": 0, "b": {"c": 0.0}}
    message = refusal(files.read_json, tmp_path / "a", "copy it", example)
    assert "is damaged" in message and message.endswith("; copy it")
    (tmp_path / "a").write_text('{"a": 1, "b": {"c": 2}, "more": 3}')
    assert files.read_json(tmp_path / "a", "", example)["more"] == 3

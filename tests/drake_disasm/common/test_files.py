"""Writing files atomically."""

import json
import os
import signal

import numpy as np
import pytest
from matplotlib.figure import Figure

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import (
    write_atomically,
    write_figure,
    write_json,
    write_npz,
    write_text,
)


def test_ctrl_c_waits_for_a_file_that_is_being_written(tmp_path):
    path = tmp_path / "data.npz"

    def write(stream):
        os.kill(os.getpid(), signal.SIGINT)
        np.savez(stream, values=np.arange(3))

    with pytest.raises(KeyboardInterrupt):
        write_atomically(path, write)
    with np.load(path) as data:
        assert data["values"].tolist() == [0, 1, 2]
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)


def test_nothing_is_left_of_what_failed(tmp_path):
    def fail(stream):
        stream.write(b"half")
        raise ValueError

    with pytest.raises(ValueError):
        write_atomically(tmp_path / "data.npz", fail)
    assert not list(tmp_path.iterdir())


def test_text_json_arrays_and_figures_come_back(tmp_path):
    write_text(tmp_path / "text", "20 µm\n")
    write_json(tmp_path / "json", {"a": [1, 0.1]})
    write_npz(tmp_path / "npz", a=np.arange(3), b=np.eye(2))
    write_figure(tmp_path / "png", Figure(figsize=(1, 1)))
    assert (tmp_path / "text").read_text("utf-8") == "20 µm\n"
    assert json.loads((tmp_path / "json").read_text()) == {"a": [1, 0.1]}
    with np.load(tmp_path / "npz") as data:
        assert data["a"].tolist() == [0, 1, 2] and (data["b"] == np.eye(2)).all()
    assert (tmp_path / "png").read_bytes().startswith(b"\x89PNG")
    assert len(list(tmp_path.iterdir())) == 4


def test_a_folder_that_does_not_exist_is_named_with_a_remedy(tmp_path):
    with pytest.raises(DisasmError, match=r"no/text: cannot be written .*; check"):
        write_text(tmp_path / "no" / "text", "")

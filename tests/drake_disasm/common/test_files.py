"""Writing files whole or not at all."""

import os
import signal

import numpy as np
import pytest

from drake_disasm.common.files import write_atomically


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

"""The contact's equations on a GPU give what they give on the host."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from drake_disasm.common.arrays import to_numpy
from drake_disasm.twin import ImpactStep
from tests.drake_disasm.twin.test_step import TURNED, H, states

#: The kernel in Numba's emulation of a GPU, thread after thread.
EMULATED = """
import sys
import numpy as np
from drake_disasm.twin import turning
from drake_disasm.twin.on_gpu import kernel
from tests.drake_disasm.twin.test_step import COUNT, H, TURNED, states

E, R_GnB = turning(states()[0][:, 3:])
rows = (*states(), E, np.linalg.inv(E), R_GnB)
after, wrench = np.full((2, COUNT, 6), np.nan)
is_solved = np.zeros(COUNT, bool)
kernel[2, 32](TURNED.table, H, rows, after, wrench, is_solved)
np.savez(sys.argv[1], after=after, wrench=wrench, is_solved=is_solved)
"""


def test_each_thread_does_what_the_host_does(tmp_path):
    emulation = {"NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1"}
    subprocess.run(
        [sys.executable, "-c", EMULATED, tmp_path / "found.npz"],
        cwd=Path(__file__).parents[3],
        env={**os.environ, **emulation},
        check=True,
    )
    found, expected = (
        np.load(tmp_path / "found.npz"),
        ImpactStep.of(TURNED, H, *states()),
    )
    assert expected.wrench.any() and found["is_solved"].all()
    np.testing.assert_allclose(found["after"], expected.v, atol=1e-14)
    np.testing.assert_allclose(found["wrench"], expected.wrench, atol=1e-10)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no GPU")
def test_a_gpu_finds_what_the_host_finds():
    host = ImpactStep.of(TURNED, H, *states())
    there = (torch.asarray(each, device="cuda") for each in states())
    gpu = ImpactStep.of(TURNED, H, *there)
    assert gpu.v.device.type == "cuda"
    np.testing.assert_allclose(to_numpy(gpu.v), host.v, atol=1e-12)
    np.testing.assert_allclose(to_numpy(gpu.wrench), host.wrench, atol=1e-8)
    np.testing.assert_array_equal(to_numpy(gpu.is_solved), host.is_solved)

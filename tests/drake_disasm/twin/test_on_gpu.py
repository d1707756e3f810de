"""The plant's steps on a GPU are those on the host."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from drake_disasm.common.arrays import to_numpy
from drake_disasm.scenario import load_scenario
from drake_disasm.twin.batch import with_impact
from drake_disasm.twin.episodes import TwinBatch
from drake_disasm.twin.plant import Plant, PlantState

#: The kernel in Numba's emulation of a GPU, thread after thread.
EMULATED = """
import sys
import numpy as np
from drake_disasm.twin.on_gpu import kernel

given = np.load(sys.argv[1])
state, count = given["state"], len(given["state"])
newest, is_solved = np.empty_like(state), np.zeros(count, bool)
tables = tuple(given[name] for name in ("conditions", "body", "arm"))
kernel[2, 32](tables, float(given["h"]), 3, given["rate"], state, newest, is_solved)
np.savez(sys.argv[1], state=state, newest=newest, is_solved=is_solved)
"""
COUNT, STEPS = 40, 3


def pushed() -> tuple[Plant, PlantState, np.ndarray]:
    """Returns plants of bolts in a turned groove, their states, and their commands."""
    scenarios = [with_impact(load_scenario("removal_turned"))] * COUNT
    batch = TwinBatch(scenarios, np.zeros(0))
    episodes = batch.begin(range(COUNT), scenarios)
    plant, state = batch.twins(episodes).plant_at_A, episodes.state
    random = np.random.default_rng(0)
    rate = random.uniform(-1, 1, (COUNT, 6)) * [0.03, 0.01, 0.01, 0.0, 0.1, 0.0]
    return plant, plant.advance(state, rate, 60).state, rate


def test_each_thread_does_what_the_host_does(tmp_path: Path) -> None:
    plant, state, rate = pushed()
    file, joined = tmp_path / "arrays.npz", (state.arm, state.q, state.v, state.qd)
    np.savez(
        file,
        conditions=plant.conditions.table,
        body=plant.body.table,
        arm=plant.arm.table,
        h=plant.arm.h,
        state=np.hstack(joined),
        rate=rate,
    )
    emulation = {"NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1"}
    subprocess.run(
        [sys.executable, "-c", EMULATED, file],
        cwd=Path(__file__).parents[3],
        env={**os.environ, **emulation},
        check=True,
    )
    found, expected = np.load(file), plant.advance(state, rate, STEPS)
    assert np.abs(expected.outside).max() > 0.1 and found["is_solved"].all()
    np.testing.assert_allclose(found["state"][:, 12:18], expected.state.q, atol=1e-13)
    np.testing.assert_allclose(found["newest"][:, 24:], expected.outside, atol=1e-8)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no GPU")
def test_a_gpu_does_what_the_host_does() -> None:
    plant, state, rate = pushed()
    host = plant.advance(state, rate, STEPS)
    parts = (state.arm, state.q, state.v, state.qd)
    there = PlantState(*(torch.asarray(part, device="cuda") for part in parts))
    gpu = plant.advance(there, torch.asarray(rate, device="cuda"), STEPS)
    assert gpu.state.q.device.type == "cuda"
    np.testing.assert_allclose(to_numpy(gpu.state.q), host.state.q, atol=1e-12)
    np.testing.assert_allclose(to_numpy(gpu.outside), host.outside, atol=1e-6)
    np.testing.assert_array_equal(to_numpy(gpu.is_solved), host.is_solved)

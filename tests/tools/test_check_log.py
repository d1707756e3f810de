"""tools/check_log.py: what is wrong with a log, and what it could show."""

import json
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.logs import LogHeader, LogWriter, flat_columns
from tests.sysid.real_data import write_slide
from tests.tools.programs import run_program


def _slide(folder: Path, **changes: np.ndarray) -> Path:
    """Writes a log of a carriage of 95 kg with dry friction."""
    random, time = np.random.default_rng(0), 0.005 * np.arange(3000)
    w = 2.0 * np.pi * np.array([0.3, 0.7, 1.1])[:, None]
    q, v = 0.05 * np.sin(w * time).sum(0), 0.05 * (w * np.cos(w * time)).sum(0)
    vd = -0.05 * (w**2 * np.sin(w * time)).sum(0)
    tau = 95.0 * vd + 20.0 * np.tanh(v / 0.02) + random.standard_normal(len(time))
    columns = {"time": time, "q": q, "v": v, "vd": vd, "tau": tau} | changes
    header = LogHeader(
        "joint_motion", "move", {}, joints=("slide",),
        urdf=str(write_slide(folder.parent / "slide.urdf")),
    )  # fmt: skip
    arrays = {n: a if n == "time" else a[:, None] for n, a in columns.items()}
    with LogWriter(folder, header) as writer:
        writer.write_episode(flat_columns("joint_motion", arrays))
    return folder


def test_a_log_is_described_with_what_it_could_show(tmp_path: Path) -> None:
    log = _slide(tmp_path / "log")
    run = run_program(
        "check_log", str(log), "--workers=1", "--json", str(tmp_path / "check.json")
    )
    assert run.returncode == 0, run.stderr
    assert "1 episodes, 3000 rows" in run.stdout and "200 Hz" in run.stdout
    assert "data: nothing is wrong" in run.stdout
    assert "parameters: 1 of 1 are determined" in run.stdout
    found = json.loads((tmp_path / "check.json").read_text())
    [mass] = found["excitation"]["parameters"]
    assert mass["value"] == pytest.approx(95.0, rel=0.2)
    limits = {
        (x["effect"], x["field"]): x["amplitude"]
        for x in found["excitation"]["would_have_been_found"]
    }
    friction = limits["JointCoulombFriction.slide", "size"]
    assert 0.0 < friction < 20.0  # what is there would have been found


def test_a_dead_channel_is_refused(tmp_path: Path) -> None:
    log = _slide(tmp_path / "log", tau=np.zeros(3000))
    run = run_program("check_log", str(log), "--workers=1")
    assert run.returncode == 2 and "slide" in run.stderr
    assert len(run.stderr.strip().splitlines()) == 1


def test_a_quick_check_leaves_the_excitation_out(tmp_path: Path) -> None:
    run = run_program("check_log", str(_slide(tmp_path / "log")), "--quick")
    assert run.returncode == 0 and "parameters" not in run.stdout

"""tools/excite.py: a motion, its data, its picture; bad input."""

import csv
import json

import numpy as np
import pytest

from tests.tools.programs import run_program

_URDF = "--urdf=package://disasm_models/iiwa14/iiwa14.urdf"


def test_a_motion_is_written_with_what_it_will_tell(tmp_path):
    run = run_program(
        "excite", _URDF, "--joints", "iiwa_joint_6", "iiwa_joint_7", "--iterations=1",
        "--rate=50", "--duration=4", "--out", str(tmp_path / "motion"),
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert "JointCoulombFriction.iiwa_joint_7.size: 95 % interval of" in run.stdout
    with (tmp_path / "motion/motion.csv").open() as stream:
        table = list(csv.DictReader(stream))
    assert list(table[0]) == ["time", "q.0", "q.1", "v.0", "v.1", "vd.0", "vd.1"]
    assert len(table) == 201 and float(table[-1]["time"]) == pytest.approx(4.0)
    data = json.loads((tmp_path / "motion/design.json").read_text())
    assert data["designed"]["criterion"] < data["random"]["criterion"]
    assert data["provenance"]["command"].startswith("drake-disasm excite")
    assert all(np.max(share) <= 1.0 for name, share in data["used"].items())
    assert (tmp_path / "motion/motion.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--effects", "JointCoulombFrictoin"], "JointCoulombFriction"),
        (["--harmonics=2"], "--harmonics"),
        (["--joints", "elbow"], "elbow"),
        (["--urdf=none.urdf"], "none.urdf"),
    ],
)
def test_bad_input_is_one_line_before_any_work(arguments, message, tmp_path):
    run = run_program("excite", _URDF, *arguments, "--out", str(tmp_path / "motion"))
    assert run.returncode != 0
    assert message in run.stderr.strip().splitlines()[-1]
    assert not (tmp_path / "motion").exists()


@pytest.mark.slow
def test_a_scenarios_arm_keeps_its_tool_off_the_bench(tmp_path):
    run = run_program(
        "excite", "--scenario=removal", "--joints", "iiwa_joint_6", "iiwa_joint_7",
        "--iterations=1", "--rate=50", "--duration=6", "--out", tmp_path / "motion",
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert '<link name="bench">' in (tmp_path / "motion/arm.urdf").read_text()
    data = json.loads((tmp_path / "motion/design.json").read_text())
    assert data["clearance"] > 0.0

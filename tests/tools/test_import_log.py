"""tools/import_log.py: what it shows, writes and refuses; a real record."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_disasm.cell.parsing import movable_joints
from drake_disasm.logs import LogHeader, LogWriter, flat_columns, read_log
from tests.sysid.real_data import real_folder, write_arm, write_slide
from tests.tools.inputs import SLIDE
from tests.tools.programs import assert_one_line, run_program


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """Returns a recording of two joints."""
    time = 0.004 * np.arange(3000)
    q = np.stack([np.sin(2.0 * time), 0.4 * np.sin(5.1 * time)], axis=1)
    q = np.round(q / 1e-4) * 1e-4
    path = tmp_path / "run.npz"
    np.savez(path, time=time, q=q, tau=np.gradient(q, 0.004, axis=0))
    return path


def test_a_recording_whose_names_tell_nothing_is_shown(tmp_path: Path) -> None:
    table = tmp_path / "run.csv"
    np.savetxt(table, np.random.default_rng(0).normal(size=(20, 3)), delimiter=",")
    look = ("import-log", table, "--show", "--save-map", tmp_path / "map.yaml")
    run = run_program(*look)
    assert run.returncode == 0, run.stderr
    assert "column_2: " in run.stdout and "no map is guessed: " in run.stdout
    template = (tmp_path / "map.yaml").read_text()
    filled = template.replace("q: {from: []", "q: {from: [column_1]")
    filled = filled.replace("TIME", "column_0").replace("joints: []", "joints: [a]")
    (tmp_path / "map.yaml").write_text(filled)
    assert run_program(*look[:3], "--map", tmp_path / "map.yaml").returncode == 0
    refused = run_program("import-log", table, "--out", tmp_path / "log")
    assert_one_line(refused, ["run.csv", "--show", "--save-map"])


def test_what_could_not_be_read_is_printed_and_kept(tmp_path: Path) -> None:
    time = 0.01 * np.arange(600)
    rows = [f"{t:.2f},{np.sin(t):.6f},{np.cos(t):.6f}" for t in time]
    rows[9] = "0.09,n/a,1"
    (tmp_path / "run.csv").write_text("\n".join(["A run", "time,q,tau", *rows]))
    run = run_program("import-log", tmp_path / "run.csv", "--out", tmp_path / "log")
    notes = [
        "1 line above the table skipped",
        "q: 1 cell is no number: 'n/a' in line 12",
    ]
    assert run.stdout.splitlines()[:2] == [f"run.csv: {note}" for note in notes]
    assert "1 row without numbers left out" in run.stdout
    origin: Any = read_log(tmp_path / "log").header.provenance["import"]
    assert origin["notes"] == [f"run.csv: {note}" for note in notes]
    run = run_program("import-log", tmp_path / "run.csv", "--show")
    assert all(note in run.stdout for note in notes)


def test_a_recording_becomes_a_log(table: Path, tmp_path: Path) -> None:
    run = run_program("import_log", str(table), "--out", str(tmp_path / "log"))
    assert run.returncode == 0, run.stderr
    assert "low-pass of" in run.stdout and "rounded" in run.stdout
    log = read_log(tmp_path / "log")
    assert set(log.episodes[0].columns) >= {"time", "q.0", "v.0", "vd.1", "tau.1"}
    assert (tmp_path / "log/import.png").read_bytes().startswith(b"\x89PNG")
    again = run_program("import_log", str(table), "--out", str(tmp_path / "log"))
    assert_one_line(again, ["is not empty"])


def test_torques_at_rest_go_from_a_table_to_a_verdict(tmp_path: Path) -> None:
    """The load is the same in all poses: friction per load can do the same."""
    urdf, table = tmp_path / "lift.urdf", tmp_path / "poses.csv"
    urdf.write_text(SLIDE.replace('xyz="1 0 0"', 'xyz="0 0 1"'))
    random = np.random.default_rng(0)
    q = random.uniform(-0.5, 0.5, 60)
    tau = 95.0 * 9.81 + 20.0 * np.sign(np.diff(q, prepend=q[0]))
    tau += random.standard_normal(60)
    rows = np.column_stack([np.arange(60), q, tau])
    np.savetxt(table, rows, delimiter=",", header="order,q,tau", comments="")
    kind = ("--kind", "joint_torque_static", "--urdf", urdf)
    shown = run_program("import-log", table, *kind, "--show")
    assert "order: {from: order}" in shown.stdout and "tau, slide" in shown.stdout
    log, out = tmp_path / "log", tmp_path / "out"
    assert run_program("import-log", table, *kind, "--out", log).returncode == 0
    checked = run_program("check-log", "--log", log, "--workers=1")
    assert "data: nothing is wrong" in checked.stdout, checked.stderr
    closed = run_program("close-loop", "--log", log, "--out", out, "--workers=1")
    assert closed.returncode == 0, closed.stderr
    found = json.loads((out / "result.json").read_text())
    assert found["effects"] == found["ambiguous"] and "CoulombFric" in found["text"]
    assert "each pose reached from both sides, with two payloads" in closed.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["none.csv", "--show"], "none.csv: does not exist"),
        (["TABLE"], "--out: give a folder"),
        (["TABLE", "--out", "x", "--urdf", "none.urdf", "--joints", "a"], "none.urdf"),
    ],
)
def test_bad_input_is_one_line(
    table: Path, tmp_path: Path, arguments: list[str], said: str
) -> None:
    named = {"TABLE": str(table), "x": str(tmp_path / "x")}
    run = run_program("import_log", *[named.get(a, a) for a in arguments])
    assert_one_line(run, [said])
    assert not (tmp_path / "x").exists()


def test_a_table_of_a_log_of_ours_has_the_logs_urdf(tmp_path: Path) -> None:
    arm = "package://disasm_models/iiwa14/iiwa14.urdf"
    joints = movable_joints(arm)
    q = 0.1 * np.sin(np.linspace(0.0, 6.0, 600))[:, None] * np.ones(len(joints))
    header = LogHeader("joint_response", "swing", {}, joints=tuple(joints), urdf=arm)
    time = 0.01 * np.arange(len(q))
    table = {"time": time, "q_commanded": q, "q": q, "tau": 3.0 * q}
    with LogWriter(tmp_path / "ours", header) as writer:
        writer.write_episode(flat_columns("joint_response", table))
    source = tmp_path / "ours" / "episode_0000.parquet"
    run = run_program("import_log", str(source), "--out", str(tmp_path / "log"))
    assert run.returncode == 0, run.stderr
    found = read_log(tmp_path / "log").header
    assert found.urdf == arm and found.joints == tuple(joints)


def _result(folder: Path) -> dict[str, Any]:
    """Returns what a program says in a folder's result.json."""
    return dict(json.loads((folder / "result.json").read_text()))


@pytest.mark.slow
def test_a_real_record_is_closed_from_its_raw_file(tmp_path: Path) -> None:
    source = real_folder("emps") / "DATA_EMPS.mat"
    fields = {
        "kind": "joint_motion",
        "joints": ["slide"],
        "time": {"from": "t"},
        "columns": {"q": {"from": "qm"}, "tau": {"from": "vir", "scale": "gtau"}},
    }
    (tmp_path / "map.yaml").write_text(json.dumps(fields))
    urdf = write_slide(tmp_path / "emps.urdf")
    run = run_program(
        "import_log", str(source), "--map", str(tmp_path / "map.yaml"),
        "--urdf", str(urdf), "--out", str(tmp_path / "log"),
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    closed = run_program(
        "close_loop", "--log", str(tmp_path / "log"), "--out", str(tmp_path / "closed"),
        "--workers", "1",
    )  # fmt: skip
    assert closed.returncode == 0, closed.stderr
    result = _result(tmp_path / "closed")
    assert result["errors"]["relative"]["after"] <= 0.03
    assert "ArmDelay" in result["effects"]


@pytest.mark.slow
def test_a_bag_of_an_arm_ends_in_the_truth(tmp_path: Path) -> None:
    example = Path(__file__).parents[2] / "examples/record_bag.py"
    bag, log = str(tmp_path / "bag"), str(tmp_path / "log")
    subprocess.run([sys.executable, example, bag], check=True)
    arm = "package://disasm_models/iiwa14/iiwa14.urdf"
    run = run_program("import_log", bag, "--urdf", arm, "--out", log)
    assert run.returncode == 0, run.stderr
    late = float(run.stdout.split("is off by ")[1].split(" ms")[0])
    assert late == pytest.approx(-12.0, abs=1.0)
    closed = run_program(
        "close_loop", "--log", log, "--out", str(tmp_path / "closed"), "--workers", "1"
    )
    assert closed.returncode == 0, closed.stderr
    values = _result(tmp_path / "closed")["parameters"]
    for joint, size in ((2, 4.0), (4, 2.5)):
        found = values[f"JointCoulombFriction.iiwa_joint_{joint}.size"]["value"]
        assert found == pytest.approx(size, rel=0.1)


@pytest.mark.slow
def test_a_verdict_on_few_blocks_does_not_claim_to_be_all(tmp_path: Path) -> None:
    """Its positions contradict its velocities for a while."""
    source = real_folder("kuka_lwr4") / "recording_1.npz"
    arm = str(write_arm(tmp_path / "arm.urdf"))
    run = run_program(
        "import_log", str(source), "--urdf", arm, "--out", str(tmp_path / "log")
    )
    assert run.returncode == 0, run.stderr
    closed = run_program(
        "close_loop", "--log", str(tmp_path / "log"), "--out", str(tmp_path / "closed"),
        "--workers", "1",
    )  # fmt: skip
    assert closed.returncode == 0, closed.stderr
    result = _result(tmp_path / "closed")
    assert result["ending"] == "partly"
    assert any("Friction" in name for name in result["confirmed"])


def test_recordings_of_other_people_s_robots_come_in(tmp_path: Path) -> None:
    """By commands alone; see ../shared/data/cases/README.md for the right answers."""
    cases, ur = real_folder("cases"), real_folder("ur10e")
    arm = ["--urdf", str(ur / "ur10e.urdf")]
    run = run_program(
        "import_log", str(ur / "unloaded.csv"), "--preset", "rtde", *arm,
        "--out", str(tmp_path / "ur"),
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    scales = read_log(tmp_path / "ur").header.provenance["import"]["map"]["columns"]
    # Both of the authors' sets are 8.5 to 15 N m/A; wrists have the same motor.
    assert all(8.5 < constant < 15.0 for constant in scales["tau"]["scale"])
    bag = cases / "bag_two_publishers/joint_states.bag"
    run = run_program("import_log", str(bag), *arm, "--show")
    assert "effort.elbow_joint" in run.stdout and "q.2, elbow_joint" in run.stdout
    coarse = cases / "coarse_stamps"
    run = run_program(
        "import_log", str(coarse / "run.csv"), "--map", str(coarse / "map.yaml"),
        "--out", str(tmp_path / "coarse"),
    )  # fmt: skip
    assert_one_line(run, ["--rate 125"])
    late = cases / "jittery_stamps"
    run = run_program(
        "import_log", str(late / "run.csv"), "--map", str(late / "map.yaml"),
        "--out", str(tmp_path / "late"),
    )  # fmt: skip
    assert "about 500 Hz; even times are taken" in run.stdout

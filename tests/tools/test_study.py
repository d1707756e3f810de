"""tools/study.py: a study from its command line, and what it refuses."""

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.tools.programs import assert_one_line, run_program

_SMALL = [
    "--levels", "agent=ddpg", "psi=0", "--seeds=1", "--episodes=2", "--validation=1",
    "--hyper", "hidden=[8]", "--set", "task.steps=4", "--eager", "--workers=1",
]  # fmt: skip


def test_a_study_writes_its_report_and_resumes(tmp_path: Path) -> None:
    arguments = ["precision", *_SMALL, "--out", str(tmp_path / "out")]
    first = run_program("study", *arguments)
    assert first.returncode == 0, first.stderr
    assert "Trainings in which at least one episode succeeds" in first.stdout
    assert "drake-disasm study precision" in (tmp_path / "out/report.md").read_text()
    listed = run_program("study", "--list").stdout
    assert "precision: " in listed and "actor_rate: 0.005, 0.05, 0.5" in listed
    again = run_program("study", *arguments, "--resume")
    assert again.returncode == 0 and again.stdout == first.stdout


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 60 kB; skips the test where none may be mounted."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=60k", "tmpfs", str(folder)]
    try:
        subprocess.run(mount, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no file system may be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.slow
def test_a_disk_that_fills_up_loses_nothing(small_disk: Path, tmp_path: Path) -> None:
    arguments = ["precision", *_SMALL, "--episodes=6", "--out"]
    full = run_program("study", *arguments, str(small_disk / "out"))
    assert full.returncode == 2 and "No space left on device" in full.stderr
    assert "check the disk's space" in full.stderr.splitlines()[-1]
    grow = ["mount", "-o", "remount,size=60m", str(small_disk)]
    subprocess.run(grow, check=True)
    on = run_program("study", *arguments, str(small_disk / "out"), "--resume")
    assert on.returncode == 0, on.stderr
    run_program("study", *arguments, str(tmp_path / "out"))
    table = "results.csv"
    expected = (tmp_path / "out" / table).read_bytes()
    assert (small_disk / "out" / table).read_bytes() == expected


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["precise", "--out", "x"], "study 'precise' does not exist"),
        (["precision"], "--out: give a folder"),
        (["precision", "--out", "x", "--levels", "psi"], "write it as FACTOR=A,B"),
        (["precision", "--out", "x", "--compare", "none.csv"], "none.csv: is no file"),
        (["precision", "--out", "x", "--scheduler", "a:1"], "--executor dask"),
    ],
)
def test_bad_input_is_refused_before_work_starts(
    arguments: list[str], said: str, tmp_path: Path
) -> None:
    arguments = [str(tmp_path / a) if a == "x" else a for a in arguments]
    run = run_program("study", *arguments)
    assert_one_line(run, [said])
    assert not (tmp_path / "x").exists()

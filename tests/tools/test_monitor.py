"""tools/monitor.py, as a user runs it."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.progress import running, wait_until
from tests.sysid.monitoring.days import write_day, write_reference
from tests.tools.inputs import write_slide_log
from tests.tools.programs import assert_one_line, command, interrupt, run_program

LIBRARY = ("SensorBias", "SensorDrift", "SensorGain", "SensorMounting", "PayloadError")


@pytest.fixture(scope="module")
def closed(tmp_path_factory):
    """Output of the closed loop of days in good order."""
    return write_reference(tmp_path_factory.mktemp("reference"))


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Runs the program to its end."""
    return run_program("monitor", *arguments)


def _days(folder: Path, biases: list[float], first: int = 0) -> Path:
    for number, bias in enumerate(biases, start=first):
        write_day(folder / f"day_{number}", number, bias)
    return folder


def test_an_alarm_ends_it_and_the_same_command_goes_on(closed, tmp_path):
    days = _days(tmp_path / "days", [0.0])
    arguments = ("--reference", closed, "--log", days, "--false-alarm-every", 20)
    arguments += ("--out", tmp_path / "out", "--on-alarm", f"cat > {tmp_path}/alarm")
    quiet = run(*arguments)
    assert quiet.returncode == 0, quiet.stderr
    [line] = quiet.stdout.splitlines()
    assert json.loads(line)["role"] == "judged"
    assert not (tmp_path / "alarm").exists()

    _days(days, [0.3] * 6, first=1)
    alarm = run(*arguments)
    assert alarm.returncode == 3, alarm.stderr
    lines = [json.loads(text) for text in alarm.stdout.splitlines()]
    assert lines[0]["number"] == 2 and lines[-1]["alarm"]
    assert lines[-1]["suspects"][0]["name"] == "SensorBias"
    assert "alarm: suspected: an offset of the sensor" in alarm.stderr
    assert lines[-1]["command"] in alarm.stderr
    kept = (tmp_path / "out" / "episodes.jsonl").read_text()
    assert kept == quiet.stdout + alarm.stdout
    wait_until(lambda: _is_whole(tmp_path / "alarm"))
    assert json.loads((tmp_path / "alarm").read_text()) == lines[-1]
    assert "Alarm at episode" in (tmp_path / "out" / "report.html").read_text()

    again = run(*arguments)
    assert again.returncode == 3 and not again.stdout
    further = run(*arguments, "--keep-going")
    assert len(further.stdout.splitlines()) == 7 - len(lines) - 1


def _is_whole(path: Path) -> bool:
    return path.exists() and path.read_text().endswith("\n")


def test_bad_input_is_refused_in_one_line(closed, tmp_path):
    (tmp_path / "days").mkdir()
    arguments = ("--reference", closed, "--out", tmp_path / "out", "--log")
    assert_one_line(run(*arguments, tmp_path / "none"), ["is no folder"])
    assert_one_line(run(*arguments, tmp_path / "days"), ["has no log yet", "--follow"])
    write_slide_log(tmp_path / "days" / "slide")
    words = ["no episode could be judged", "kind is joint_motion"]
    assert_one_line(run(*arguments, tmp_path / "days"), words)
    new = ("--reference", closed, "--log", tmp_path / "days", "--out")
    assert_one_line(run(*new, tmp_path / "new"), ["kind is joint_motion"])
    assert not (tmp_path / "new").exists()
    other = ("--reference", tmp_path, "--log", tmp_path / "days")
    assert_one_line(run(*other), ["result.json", "close-loop"])
    assert_one_line(
        run(*arguments, tmp_path / "days", "--false-alarm-every", 1), ["above one"]
    )


@pytest.mark.slow
def test_it_follows_until_an_alarm_or_ctrl_c(closed, tmp_path):
    days, out = _days(tmp_path / "days", [0.0]), tmp_path / "out"
    arguments = ("--reference", closed, "--log", days, "--follow", "--out", out)
    arguments += ("--false-alarm-every", 20)
    interrupt(lambda: (out / "report.html").exists(), "monitor", *arguments)
    shutil.copytree(days / "day_0", days / "half")
    (days / "half" / "episode_0000.parquet").write_bytes(b"PAR1")
    with running(command("monitor", *arguments), stdout=subprocess.PIPE) as process:
        for number in range(1, 9):
            write_day(days / f"day_{number}", number, 0.3)
        found, _ = process.communicate()
    assert process.returncode == 3
    lines = [json.loads(line) for line in found.splitlines()]
    assert lines[-1]["alarm"]
    assert not any(line["log"].endswith("half") for line in lines)

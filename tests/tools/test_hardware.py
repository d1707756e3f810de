"""simulate.py --station hardware, and fake_cell.py."""

import dataclasses
import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from drake import lcmt_iiwa_command
from pydrake.common.yaml import yaml_dump_typed
from pydrake.lcm import DrakeLcm

from drake_disasm.logs import read_log
from drake_disasm.stations.hardware_config import HardwareConfig, load_hardware_config
from tests.progress import running, wait_until
from tests.tools.programs import command, run_program

_PORT = 20_000 + os.getpid() % 20_000  # nobody else's: tests run beside each other
_LCM = f"udpm://239.255.76.67:{_PORT}?ttl=0"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--station", "hardware"), "--hardware-config FILE"),
        (("--dry-run",), "--dry-run: is for --station hardware"),
        (
            ("--station", "hardware", "--hardware-config", "nowhere.yaml"),
            "nowhere.yaml",
        ),
        (("--station", "hardware", "--episodes", "2"), "--episodes"),
        (("--station", "hardware", "--dry-run", "--html", "x.html"), "--html"),
        (("--station", "hardware", "--dry-run", "--record", "x"), "--record"),
        (("--station", "simulated"), "--station simulated: does not exist; known: "),
        (("--model", "twin"), "--model twin: is --station twin now"),
    ],
)
def test_refuses_what_hardware_cannot_do(arguments: tuple[str], words: str) -> None:
    result = run_program("simulate", *arguments)
    assert result.returncode == 2 and words in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.fixture
def fake(tmp_path: Path) -> Iterator[Path]:
    """Plays a cell in real time; yields the file by which it is found."""
    _skip_without_multicast()
    config = tmp_path / "fake.yaml"
    cell = command("fake_cell", "--config", config, "--lcm-url", _LCM)
    streams = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL}
    with running(cell, **streams) as process:
        wait_until(config.exists, process)
        yield config
        process.send_signal(signal.SIGINT)
        assert process.wait() == 130


def _skip_without_multicast() -> None:
    lcm, got = DrakeLcm(_LCM), []
    lcm.Subscribe("PROBE", got.append)
    for _ in range(10):
        lcm.Publish("PROBE", b"-")
        lcm.HandleSubscriptions(500)
        if got:
            return
    pytest.skip("LCM's multicast does not come back on this machine")


_PIPES = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
_POLICY = """
import numpy as np

calls = 0

def to_and_fro(state):
    global calls
    calls += 1
    return np.array([3e-4 if calls % 2 else -3e-4, 0, 0, 0, 0, 0])
"""


def _lines(path: Path) -> int:
    return path.read_text().count("\n") if path.exists() else 0


@pytest.fixture
def moving(fake: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The command that moves the arm to and fro, and keeps a log of it.

    For minutes, and where a busy machine stands still it goes on.
    """
    config = load_hardware_config(fake)
    safety = dataclasses.replace(
        config.safety, stale_arm=1.0, stale_sensor=1.0, stale_gripper=5.0,
        late_command=5.0, max_force=25.0,
    )  # fmt: skip
    patient = dataclasses.replace(config, safety=safety)
    fake.write_text(yaml_dump_typed(patient, schema=HardwareConfig))
    (tmp_path / "slow_policy.py").write_text(_POLICY)
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{os.environ.get('PYTHONPATH', '')}")
    return command(
        "simulate", "--station", "hardware", "--hardware-config", fake,
        "--policy", "slow_policy:to_and_fro", "--set", "task.steps=1000",
        "--no-meshcat",
        "--record", tmp_path / "log", "--resume",
    )  # fmt: skip


@pytest.mark.slow
def test_no_row_is_lost_however_a_run_is_stopped(
    moving: list[str], tmp_path: Path
) -> None:
    folder, seen = tmp_path / "log", []
    stops = ((signal.SIGKILL, -9), (signal.SIGTERM, 143), (signal.SIGINT, 130))
    for number, (stop, status) in enumerate(stops):
        rows = folder / f".episode_{number:04d}.unfinished.csv"
        with running(moving, **_PIPES) as process:
            wait_until(lambda rows=rows: _lines(rows) > 6, process)
            seen.append(_lines(rows) - 1)
            process.send_signal(stop)
            output, errors = process.communicate()
        assert process.returncode == status, errors
        assert ("episode 0 was cut off" in output) == (number == 1)
    log = read_log(folder)
    assert [note["cut_off"] for note in log.header.notes.values()] == [
        "the program was killed", "terminated", "interrupted by Ctrl-C"
    ]  # fmt: skip
    assert len(log.episodes) == 3
    for episode, count in zip(log.episodes, seen, strict=True):
        assert episode.rows >= count and episode["truncated"][-1]


@pytest.mark.slow
def test_one_program_alone_commands_the_robot(
    fake: Path, moving: list[str], tmp_path: Path
) -> None:
    rows = tmp_path / "log" / ".episode_0000.unfinished.csv"
    hardware = ("simulate", "--station", "hardware", "--hardware-config", fake)
    with running(moving, **_PIPES) as process:
        wait_until(lambda: _lines(rows) > 3, process)
        for more, does in (
            ((), "commands this robot"),
            (("--dry-run",), "has the sensor's stream"),
        ):
            second = run_program(*hardware, "--no-meshcat", *more)
            assert second.returncode == 2
            assert f"another program {does} (" in second.stderr
            assert f": simulate.py (pid {process.pid}, " in second.stderr
        then = _lines(rows)
        wait_until(lambda: _lines(rows) > then + 1, process)
        lcm, message = DrakeLcm(_LCM), lcmt_iiwa_command()
        lcm.Publish("IIWA_COMMAND", message.encode())
        _, errors = process.communicate()
    assert process.returncode == 2
    reason = "a command that is not ours came on IIWA_COMMAND from "
    assert reason in errors
    assert reason in read_log(tmp_path / "log").header.notes[0]["cut_off"]


@pytest.mark.slow
def test_a_dry_run_shows_the_devices_and_commands_nothing(fake: Path) -> None:
    dry_run = command(
        "simulate", "--station", "hardware", "--hardware-config", fake, "--dry-run"
    )
    with running(dry_run, stdout=subprocess.PIPE) as process:
        assert process.stdout
        lines = [process.stdout.readline() for _ in range(8)]
        os.kill(process.pid, signal.SIGINT)
        assert process.wait() == 130
    for name in ("iiwa", "gripper", "ft_sensor"):
        assert any(f"{name:10} READY" in line for line in lines), lines


@pytest.mark.slow
def test_the_bolt_comes_out_in_real_time(fake: Path, tmp_path: Path) -> None:
    # The learned policy hits the groove's end so hard that it is held, now and then.
    result = run_program(
        "simulate", "--station", "hardware", "--hardware-config", fake,
        "--policy", "admittance", "--record", tmp_path / "log",
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    assert "1 of 1 episodes succeeded" in result.stdout
    assert read_log(tmp_path / "log").episodes[0]["terminated"][-1]

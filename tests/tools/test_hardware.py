"""simulate.py --station hardware, and fake_cell.py."""

import contextlib
import os
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
import yaml
from pydrake.lcm import DrakeLcm

from drake_disasm.logs import read_log
from tests.progress import running, wait_until
from tests.tools.programs import assert_one_line, command, run_program

_PORT = 20_000 + os.getpid() % 20_000  # nobody else's: tests run beside each other
_LCM = f"udpm://239.255.76.67:{_PORT}?ttl=0"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--station", "hardware"), "--hardware-config FILE"),
        (("--dry-run",), "--dry-run: is for --station hardware"),
        (("--station", "hardware", "--episodes", "2"), "--episodes"),
        (("--station", "hardware", "--dry-run", "--record", "x"), "--record"),
        (("--station", "simulated"), "--station simulated: does not exist; known: "),
    ],
)
def test_refuses_what_hardware_cannot_do(arguments: tuple[str], words: str) -> None:
    assert_one_line(run_program("simulate", *arguments), [words])


@pytest.fixture
def fake(tmp_path: Path) -> Iterator[Path]:
    """Plays a cell in real time; yields the file by which it is found."""
    _skip_without_multicast()
    config = tmp_path / "fake.yaml"
    # In real time on a slow machine, too.
    quick = ("--set", "simulation.cell_time_step=0.005")
    cell = command("fake_cell", "--hardware-config", config, "--lcm-url", _LCM, *quick)
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


_UNFINISHED = ".episode_*.unfinished.csv"


def _lines(path: Path) -> int:
    return path.read_text().count("\n") if path.exists() else 0


@contextlib.contextmanager
def _in_motion(
    run: Sequence[str], folder: Path, lines: int
) -> Iterator[tuple[subprocess.Popen[str], Path]]:
    """Yields a program, and its episode's rows once there are so many lines of them.

    Begins again where a busy machine let the fake cell stand still: that is a hold.
    """
    while True:
        before = set(folder.glob(_UNFINISHED))

        def rows(before: set[Path] = before) -> Path:
            """The new episode's, if they are there."""
            return max(set(folder.glob(_UNFINISHED)) - before, default=folder / "none")

        with running(run, **_PIPES) as process:
            while process.poll() is None and _lines(rows()) < lines:
                time.sleep(0.02)
            if process.poll() is None:
                yield process, rows()
                return
            _, errors = process.communicate()
            assert "has stopped sending" in errors


def _make_patient(config_file: Path, **safety: float) -> None:
    """On a busy machine the fake cell stands still, and so does the station."""
    config = yaml.safe_load(config_file.read_text())
    config["safety"] |= {f"stale_{device}": 1.0 for device in ("arm", "sensor")}
    config["safety"] |= {"stale_gripper": 5.0, "late_command": 5.0, "max_lag": 60.0}
    config["safety"] |= safety
    config["ready_timeout"] = 600.0
    config_file.write_text(yaml.safe_dump(config))


@pytest.fixture
def moving(fake: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The command that moves the arm to and fro, and keeps a log of it.

    For minutes, and where a busy machine stands still it goes on.
    """
    _make_patient(fake, max_force=25.0)
    (tmp_path / "slow_policy.py").write_text(_POLICY)
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{os.environ.get('PYTHONPATH', '')}")
    return command(
        "simulate", "--station", "hardware", "--hardware-config", fake,
        "--policy", "slow_policy:to_and_fro", "--set", "task.steps=1000",
        "--no-meshcat", "--record", tmp_path / "log", "--resume",
    )  # fmt: skip


@pytest.mark.slow
def test_no_row_is_lost_however_a_run_is_stopped(
    moving: list[str], tmp_path: Path
) -> None:
    folder, seen = tmp_path / "log", []
    stops = ((signal.SIGKILL, -9), (signal.SIGTERM, 143), (signal.SIGINT, 130))
    for stop, status in stops:
        with _in_motion(moving, folder, 7) as (process, rows):
            seen.append(_lines(rows) - 1)
            process.send_signal(stop)
            _, errors = process.communicate()
        assert process.returncode == status, errors
    log = read_log(folder)
    cut = {n: note["cut_off"] for n, note in log.header.notes.items()}
    assert cut.keys() == set(range(len(log.episodes)))
    stopped = {n: why for n, why in cut.items() if "stopped sending" not in why}
    assert list(stopped.values()) == [
        "the program was killed", "terminated", "interrupted by Ctrl-C"
    ]  # fmt: skip
    for number, count in zip(stopped, seen, strict=True):
        episode = log.episodes[number]
        assert episode.rows >= count and episode["truncated"][-1]


@pytest.mark.slow
def test_a_dry_run_shows_the_devices_and_commands_nothing(fake: Path) -> None:
    dry_run = command(
        "simulate", "--station", "hardware", "--hardware-config", fake, "--dry-run"
    )
    with running(dry_run, stdout=subprocess.PIPE) as process:
        assert process.stdout
        missing, said = {"iiwa", "gripper", "ft_sensor"}, ""
        while missing:  # a busy machine lets the fake cell stand still, at first
            line = process.stdout.readline()
            said += line
            assert line, missing
            missing -= {name for name in missing if f"{name:10} READY" in line}
        os.kill(process.pid, signal.SIGINT)
        process.stdout.read()
        assert process.wait() == 130
    assert "arm: position control" in said and "commands may lead the joints by" in said


@pytest.mark.slow
def test_the_bolt_comes_out_in_real_time(fake: Path, tmp_path: Path) -> None:
    _make_patient(fake)
    # The learned policy hits the groove's end so hard that it is held, now and then.
    result = run_program(
        "simulate", "--station", "hardware", "--hardware-config", fake,
        "--policy", "admittance", "--record", tmp_path / "log",
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    assert "1 of 1 episodes succeeded" in result.stdout
    assert read_log(tmp_path / "log").episodes[0]["terminated"][-1]

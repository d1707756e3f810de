"""simulate.py --station hardware, and fake_cell.py."""

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from pydrake.lcm import DrakeLcm

from drake_disasm.logs import read_log
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
    process = subprocess.Popen(
        command("fake_cell", "--config", config, "--lcm-url", _LCM),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + 60
    while not config.exists():
        assert time.monotonic() < deadline and process.poll() is None
        time.sleep(0.05)
    yield config
    process.send_signal(signal.SIGINT)
    assert process.wait(30) == 130


def _skip_without_multicast() -> None:
    lcm, got = DrakeLcm(_LCM), []
    lcm.Subscribe("PROBE", got.append)
    lcm.Publish("PROBE", b"-")
    lcm.HandleSubscriptions(500)
    if not got:
        pytest.skip("LCM's multicast does not come back on this machine")


@pytest.mark.slow
def test_a_dry_run_shows_the_devices_and_commands_nothing(fake: Path) -> None:
    process = subprocess.Popen(
        command(
            "simulate", "--station", "hardware", "--hardware-config", fake, "--dry-run"
        ),
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout
    lines = [process.stdout.readline() for _ in range(8)]
    os.kill(process.pid, signal.SIGINT)
    assert process.wait(30) == 130
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

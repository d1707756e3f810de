"""benchmarks/benchmark.py: its keys and its files, not its figures."""

import json
import math
import subprocess
import sys
from pathlib import Path

import benchmark
import pytest


def _benchmark(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, benchmark.__file__, *arguments]
    return subprocess.run(command, capture_output=True, text=True)


def _figures(folder: Path, keys: list[str]) -> tuple[dict[str, float], str]:
    """Returns the figures that the program writes, which are those asked for."""
    file = folder / "figures.json"
    done = _benchmark("--only", *keys, "--json", str(file))
    assert done.returncode == 0, done.stderr
    figures = json.loads(file.read_text())
    assert set(figures) == set(keys)
    assert all(key in done.stdout for key in keys)
    return figures, done.stdout


def test_only_and_json(tmp_path: Path) -> None:
    figures, printed = _figures(tmp_path, ["policy_inference_us"])
    assert figures["policy_inference_us"] > 0.0
    assert "the network in torch" in printed


@pytest.mark.slow
def test_the_twins_keys(tmp_path: Path) -> None:
    keys = ["twin_reset_ms", "twin_steps_per_s", "twin_python_share"]
    figures, _ = _figures(tmp_path, keys)
    assert figures["twin_reset_ms"] > 0.0
    # From below there is no bound: on a busy machine a share of times can be negative.
    assert -math.inf < figures["twin_python_share"] < 1.0


def test_unknown_key_is_one_line() -> None:
    done = _benchmark("--only", "twin_reset")
    assert done.returncode == 2
    assert "error: --only twin_reset: no such figure" in done.stderr
    assert "twin_reset_ms" in done.stderr


@pytest.mark.parametrize("name", ["simulate", "train", "identify"])
def test_programs_whose_memory_is_measured_are_there(name: str) -> None:
    assert Path(benchmark.tool(name)[-1]).is_file()


@pytest.mark.slow
def test_the_objectives_keys(tmp_path: Path) -> None:
    keys = ["objective_883_s", "objective_1776_s", "objective_883_one_core_s"]
    figures, printed = _figures(tmp_path, keys)
    assert min(figures.values()) > 0.0
    assert "the thesis's 10 minutes" in printed

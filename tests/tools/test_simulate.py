"""tools/simulate.py: what it prints and writes, and how it refuses bad input."""

import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.logs import read_log
from drake_disasm.policies import (
    LearnedPolicy,
    Network,
    Straight,
    TaskView,
    save_policy,
)
from drake_disasm.scenario import load_scenario, scenario_from_mapping
from tests.progress import running, wait_until
from tests.tools.programs import Runner, assert_one_line, command

TWIN = ("--station", "twin")


@pytest.mark.slow
def test_default_run_takes_the_bolt_out(simulate: Runner) -> None:
    done = simulate()
    assert done.returncode == 0, done.stderr
    assert "success (the bolt is out)" in done.stdout
    assert "1 of 1 episodes succeeded" in done.stdout


def test_record_writes_a_log_that_describes_itself(
    simulate: Runner, tmp_path: Path
) -> None:
    done = simulate(
        *TWIN, "--scenario", "removal_turned", "--episodes", "2", "--record", "log"
    )
    assert done.returncode == 0, done.stderr
    assert "success (the bolt is out)" in done.stdout
    assert "2 of 2 episodes succeeded" in done.stdout
    log = read_log(tmp_path / "log")
    assert len(log.episodes) == 2
    assert all(55 < episode.rows <= 151 for episode in log.episodes)
    scenario = scenario_from_mapping(dict(log.header.scenario or {}))
    assert scenario == load_scenario("removal_turned")
    last = log.episodes[0]
    assert last["terminated"][-1] and not last["truncated"][-1]


def test_bad_scenario_is_one_line(simulate: Runner, tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text("lock: {clearence: 0.0004}")
    words = ["mine.yaml", "clearence", "clearance"]
    assert_one_line(simulate("--scenario", "mine.yaml"), words)


def test_page_that_cannot_be_written_is_refused_before_the_run(
    simulate: Runner, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("no folder")
    done = simulate(*TWIN, "--html", "file/page.html")
    assert_one_line(done, ["file", "no such folder"])
    assert "episode" not in done.stdout


def _trained(path: Path) -> Path:
    """Writes a policy that has learned to correct `straight` by nothing at all."""
    network = Network((np.zeros((6, 12), np.float32),), (np.zeros(6, np.float32),))
    view = TaskView(np.ones(12), np.full(6, 1e-4), Straight())
    save_policy(path, LearnedPolicy(network, view))
    return path


def test_trained_policy_is_given_as_a_file(simulate: Runner, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    _trained(tmp_path / "out/mine.npz")
    run = (*TWIN, "--scenario", "chapter4")  # whose steps the policy has
    done = simulate(*run, "--policy", "out/mine.npz", "--record", "a")
    assert done.returncode == 0, done.stderr
    assert simulate(*run, "--policy", "straight", "--record", "b").returncode == 0
    a, b = (read_log(tmp_path / name) for name in ("a", "b"))
    assert a.data_hash == b.data_hash
    assert a.header.provenance["policy"] == "out/mine.npz"


@pytest.mark.parametrize(
    ("action", "word"), [("[float('nan')] * 6", "finite"), ("[0.0] * 5", "6 numbers")]
)
def test_bad_policy_stops_the_episode_and_keeps_the_log(
    simulate: Runner, tmp_path: Path, action: str, word: str
) -> None:
    (tmp_path / "mine.py").write_text(
        f"def act(s):\n    return [1e-3, 0, 0, 0, 0, 0] if s[0] < 5e-3 else {action}\n"
    )
    done = simulate(*TWIN, "--policy", "mine:act", "--record", "log")
    assert_one_line(done, [word])
    (episode,) = read_log(tmp_path / "log").episodes
    assert 5 <= episode.rows <= 8
    assert not episode["terminated"].any() and not episode["truncated"].any()


def test_interrupt_prints_what_was_done(tmp_path: Path) -> None:
    run = command(
        "simulate", "--no-meshcat", *TWIN, "--episodes=1000", "--record=log",
        "--set", "task.steps=5",
    )  # fmt: skip
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with running(run, cwd=tmp_path, **streams) as process:
        third = tmp_path / "log/episode_0002.parquet"
        wait_until(third.exists, process)
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate()
    assert process.returncode == 130 and "episodes succeeded" in output
    episodes = read_log(tmp_path / "log").episodes
    whole = [e["terminated"][-1] or e["truncated"][-1] for e in episodes]
    assert len(whole) >= 3 and all(whole)


def test_resume_ends_with_the_same_episodes(simulate: Runner, tmp_path: Path) -> None:
    run = (*TWIN, "--policy=straight", "--set", "task.steps=9", "--episodes")
    assert simulate(*run, "2", "--record", "whole").returncode == 0
    assert simulate(*run, "1", "--record", "broken").returncode == 0
    done = simulate(*run, "2", "--record", "broken", "--resume")
    assert done.returncode == 0, done.stderr
    assert "0 of 1 episodes" in done.stdout
    whole, broken = (read_log(tmp_path / name) for name in ("whole", "broken"))
    assert broken.data_hash == whole.data_hash
    assert_one_line(simulate("--resume"), ["--resume", "--record"])

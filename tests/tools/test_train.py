"""Training from the command line: what it leaves behind, and being killed."""

import json
import os
import random
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_disasm.logs import read_log
from drake_disasm.policies import load_policy
from tests.progress import running, wait_until
from tests.tools.programs import assert_one_line, command, interrupt, run_program

#: A training of seconds: short episodes, a small network, nothing compiled.
SMALL = [
    "--scenario=chapter3", "--set", "task.steps=8", "--preset=chapter3", "--eager",
    "--validation=2", "--hyper", "hidden=[8]", "batch=8", "exploration=0.0002",
]  # fmt: skip
_HYPER = SMALL[SMALL.index("--hyper") :]
_SHOWN = [*_HYPER, "demonstrations=0.5"]


def _command(out: Path, *arguments: str) -> list[str]:
    return command("train", *SMALL, "--out", out, *arguments)


def _train(out: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return run_program("train", *SMALL, "--out", out, *arguments, cwd=out.parent)


def _finished(out: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    run = _train(out, *arguments)
    assert run.returncode == 0, run.stderr
    return run


def _content(folder: Path) -> dict[str, Any]:
    """Returns everything that two equal trainings must share."""
    policy = load_policy(folder / "policy.npz")
    log = read_log(folder / "log")
    result = json.loads((folder / "result.json").read_text())
    result.pop("seconds")
    return {
        "weights": [w.tobytes() for w in policy.network.weights],
        "biases": [b.tobytes() for b in policy.network.biases],
        "episodes": (folder / "episodes.csv").read_bytes(),
        "log": log.data_hash,
        "result": result,
    }


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("train") / "whole"
    _finished(out, "--episodes=6", "--seeds=2", "--workers=1")
    return out


def test_everything_is_left_behind(undisturbed: Path) -> None:
    for name in ("training.json", "summary.json", "learning_curve.png"):
        assert (undisturbed / name).stat().st_size > 0
    for seed in ("seed_000", "seed_001"):
        assert len(read_log(undisturbed / seed / "log").episodes) == 6
        policy = load_policy(undisturbed / seed / "policy.npz")
        assert policy.description.evaluation["episodes"] == 2
        assert policy.description.provenance["seed"] == int(seed[-1])
    summary = json.loads((undisturbed / "summary.json").read_text())
    assert summary["seeds"] == [0, 1] and len(summary["P"]) == 2


def test_a_log_of_the_cell_holds_what_was_chosen_not_what_was_executed(
    tmp_path: Path,
) -> None:
    small = ("--episodes=1", "--station=cell", "--validation=1", "--psi=0.0003")
    _finished(tmp_path / "out", *small)
    log = read_log(tmp_path / "out/seed_000/log")
    assert log.header.scenario is not None
    assert log.header.scenario["imprecision"] == 0.0003
    episode = log.episodes[0]
    assert log.header.joints and episode["q"].shape[1] == 7
    moved = np.abs(episode["action"] - episode["action_executed"])
    assert moved[:-1, :3].max() > 1e-5 and moved[:, 3:].max() == 0.0


def test_a_batch_of_twins_can_be_trained_on(tmp_path: Path) -> None:
    _finished(tmp_path / "out", "--envs=3", "--episodes=6")
    log = read_log(tmp_path / "out/seed_000/log")
    assert [episode.rows for episode in log.episodes] == [9] * 6
    assert log.header.scenario["contact"]["model"] == "impact"


@pytest.mark.slow
def test_seeds_in_a_pool_are_the_same(undisturbed: Path, tmp_path: Path) -> None:
    _finished(tmp_path / "pool", "--episodes=6", "--seeds=2", "--workers=2")
    for seed in ("seed_000", "seed_001"):
        assert _content(tmp_path / "pool" / seed) == _content(undisturbed / seed)


def test_a_training_that_was_stopped_goes_on_bit_for_bit(
    undisturbed: Path, tmp_path: Path
) -> None:
    """Ctrl-C keeps what is finished; being killed is a slow proof."""
    out = tmp_path / "stopped"
    is_time = (out / "seed_000/log/episode_0001.parquet").exists
    interrupt(is_time, "train", *SMALL, "--out", out, "--episodes=6")
    assert not (out / "seed_000/result.json").exists()
    assert (out / "seed_000/checkpoint.npz").exists()
    _finished(out, "--episodes=6", "--resume")
    assert _content(out / "seed_000") == _content(undisturbed / "seed_000")
    written = (out / "seed_000/policy.npz").stat().st_mtime_ns
    _finished(out, "--episodes=6", "--resume")  # it is finished: nothing is done
    assert (out / "seed_000/policy.npz").stat().st_mtime_ns == written


@pytest.mark.slow
def test_twenty_kills_at_random_moments(tmp_path: Path) -> None:
    """Each restarted run is killed again, until twenty have been."""
    arguments = ["--episodes=150"]
    _finished(tmp_path / "whole", *arguments)
    out, moments = tmp_path / "killed", random.Random(7)
    for number in range(20):
        resume = ["--resume"] if (out / "training.json").exists() else []
        program = _command(out, *arguments, *resume)
        with running(program, stderr=subprocess.DEVNULL) as process:
            wait_until((out / "training.json").exists, process)
            more = _episodes(out) + 2
            wait_until(lambda more=more: _episodes(out) >= more, process)
            time.sleep(moments.uniform(0.0, 0.1))  # any moment will do
            assert process.poll() is None, f"finished before kill {number}"
            process.kill()
    assert not (out / "seed_000/result.json").exists()
    _finished(out, *arguments, "--resume")
    assert _content(out / "seed_000") == _content(tmp_path / "whole/seed_000")


def _episodes(out: Path) -> int:
    return len(list(out.glob("seed_000/log/episode_*")))


@pytest.mark.slow
def test_ctrl_c_of_a_pool_keeps_what_is_finished(tmp_path: Path) -> None:
    out = tmp_path / "out"
    program = _command(out, "--episodes=5000", "--seeds=2")
    with running(program, stderr=subprocess.PIPE, start_new_session=True) as process:
        wait_until((out / "seed_000/log/episode_0001.parquet").exists, process)
        os.killpg(process.pid, signal.SIGINT)
        _, errors = process.communicate()
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert len(read_log(out / "seed_000/log").episodes) >= 2
    assert (out / "seed_000/checkpoint.npz").exists()


def test_learning_from_logs_alone(undisturbed: Path, tmp_path: Path) -> None:
    logs = [str(undisturbed / f"seed_00{i}/log") for i in (0, 1)]
    out = tmp_path / "offline"
    _finished(out, "--episodes=5", "--updates=50", "--log", *logs)
    result = json.loads((out / "seed_000/result.json").read_text())
    assert result["updates"] == 50 and "training" not in result
    assert result["validation"]["episodes"] == 2
    assert not (out / "seed_000/log").exists()
    policy = load_policy(out / "seed_000/policy.npz")
    expected = {path: read_log(path).data_hash for path in logs}
    assert policy.description.provenance["data"] == expected


def test_demonstrations_are_mixed_in(undisturbed: Path, tmp_path: Path) -> None:
    out = tmp_path / "shown"
    logs = str(undisturbed / "seed_000/log")
    _finished(out, "--episodes=2", "--demonstrations", logs, *_SHOWN)
    policy = load_policy(out / "seed_000/policy.npz")
    assert policy.description.hyperparameters["demonstrations"] == 0.5


def test_a_training_goes_on_from_another(undisturbed: Path, tmp_path: Path) -> None:
    """On another model, with the networks that the same seed came to."""
    out, start = tmp_path / "on", f"--start-from={undisturbed}"
    settings = ["--episodes=1", "--first-seed=1", "--psi=0.0003"]
    _finished(out, *settings, start)
    policy = load_policy(out / "seed_001/policy.npz")
    assert list(policy.description.provenance["start"]) == [str(undisturbed)]
    _finished(tmp_path / "rehearsed", *settings, start, *_SHOWN)
    _finished(tmp_path / "new", *settings)
    went_on, rehearsed, new = (
        _content(tmp_path / name / "seed_001") for name in ("on", "rehearsed", "new")
    )
    assert went_on["log"] == rehearsed["log"] != new["log"]
    assert went_on["weights"] != rehearsed["weights"]


def test_a_start_that_does_not_fit_is_named(undisturbed: Path, tmp_path: Path) -> None:
    start = f"--start-from={undisturbed}"
    for arguments, message in (
        (["--seeds=3"], "has not finished seed 2"),
        ([*_HYPER, "force_scale=9"], "was trained with force_scale 5.0, not 9.0"),
        (["--set", "task.period=0.2"], "was trained with task.period 0.1, not 0.2"),
    ):
        assert_one_line(_train(tmp_path / "on", start, *arguments), [message])
        assert not (tmp_path / "on").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--psi=0.3"], "imprecision: 0.3 m is out of range"),
        (["--hyper", "gama=1"], "did you mean 'gamma'"),
        (["--hyper", "demonstrations=0.5"], "--demonstrations"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], message: str, tmp_path: Path
) -> None:
    assert_one_line(_train(tmp_path / "out", *arguments), [message])


def test_a_taken_folder_and_resuming_with_something_else_are_refused(
    undisturbed: Path,
) -> None:
    run = _train(undisturbed, "--episodes=6", "--seeds=2")
    assert_one_line(run, ["--resume"])
    for arguments, difference in (
        (["--episodes=7"], "config.episodes (6, not 7)"),
        (["--episodes=6", "--psi=0.0001"], "scenario.imprecision (0.0, not 0.0001)"),
    ):
        assert_one_line(_train(undisturbed, "--resume", *arguments), [difference])

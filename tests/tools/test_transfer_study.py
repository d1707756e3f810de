"""tools/transfer_study.py: the whole of table 4.3 at a size of seconds."""

import json
import os
import signal
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_disasm.logs import read_log
from drake_disasm.mdp import REWARD_TERMS
from drake_disasm.policies import load_policy
from tests.progress import running, wait_until
from tests.tools.programs import command, run_program

_SMALL = [
    "--preset=chapter3", "--eager", "--validation=2", "--workers=1",
    "--episodes=2", "--stand-in-episodes=3", "--seeds=2",
    "--hyper", "hidden=[8]", "batch=8", "exploration=0.0002",
]  # fmt: skip
_TASK = "task: {success: travelled, steps: 6}\n"


@pytest.fixture(scope="module")
def scenarios(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Returns scenario files: the twin before and after, and the stand-in."""
    folder = tmp_path_factory.mktemp("scenarios")
    texts = {
        "before": _TASK,
        "after": _TASK + "effects: [!GroovePose {ry: 0.02}]\n",
        "stand-in": _TASK + "effects: [!GroovePose {ry: 0.025}]\n",
    }
    for name, text in texts.items():
        (folder / f"{name}.yaml").write_text(f"name: {name}\n{text}")
    return {name: folder / f"{name}.yaml" for name in texts}


def _arguments(scenarios: dict[str, Path], out: Path, *more: str) -> list[str]:
    named = [f"--{name}={path}" for name, path in scenarios.items()]
    return [*named, *_SMALL, "--out", str(out), *more]


def _run(arguments: list[str]) -> subprocess.CompletedProcess[str]:
    return run_program("transfer_study", *arguments)


@pytest.fixture(scope="module")
def study(
    scenarios: dict[str, Path], tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, str]:
    """Returns the folder of a finished study in the twin, and what it printed."""
    out = tmp_path_factory.mktemp("study") / "out"
    run = _run(_arguments(scenarios, out, "--station=twin"))
    assert run.returncode == 0, run.stderr
    return out, run.stdout


def _branches(out: Path) -> dict[str, dict[str, Any]]:
    rows = json.loads((out / "result.json").read_text())["branches"]
    return {row["folder"]: row for row in rows}


def _reward(episode: Any) -> float:
    return sum(np.nansum(episode[f"reward.{term}"]) for term in REWARD_TERMS)


def test_P_is_the_mean_reward_over_the_training_in_the_stand_in(
    study: tuple[Path, str],
) -> None:
    out, printed = study
    branches = _branches(out)
    assert list(branches) == ["untrained", "from_before", "from_after"]
    for name, row in branches.items():
        for seed, P in zip((0, 1), row["P"], strict=True):
            log = read_log(out / name / f"seed_{seed:03d}" / "log")
            assert len(log.episodes) == 3
            assert log.header.scenario is not None
            assert log.header.scenario["name"] == "stand-in"
            rewards = [_reward(episode) for episode in log.episodes]
            assert np.mean(rewards) == pytest.approx(P, rel=1e-9)
    assert "-11.34" in printed and "19.80, 10.66" in printed
    assert (out / "transfer.png").read_bytes().startswith(b"\x89PNG")


def test_each_agent_goes_on_from_its_own_twin(study: tuple[Path, str]) -> None:
    out, _ = study
    for before, after in (("twin_before", "from_before"), ("twin_after", "from_after")):
        for seed in ("seed_000", "seed_001"):
            policy = load_policy(out / after / seed / "policy.npz")
            start = policy.description.provenance["start"]
            assert list(start) == [str(out / before)]
            assert (out / after / seed / "deployed.json").exists()
    untrained = load_policy(out / "untrained/seed_000/policy.npz")
    assert "start" not in untrained.description.provenance
    P = [row["P"] for row in _branches(out).values()]
    assert len({tuple(p) for p in P}) == 3


def test_resuming_a_finished_study_changes_nothing(
    study: tuple[Path, str], scenarios: dict[str, Path]
) -> None:
    out, printed = study
    before = (out / "from_after/seed_001/policy.npz").read_bytes()
    assert _run(_arguments(scenarios, out, "--station=twin")).returncode == 2
    again = _run(_arguments(scenarios, out, "--station=twin", "--resume"))
    assert again.returncode == 0 and again.stdout == printed
    assert (out / "from_after/seed_001/policy.npz").read_bytes() == before


@pytest.mark.slow
def test_an_interrupted_study_goes_on_to_the_same_result(
    study: tuple[Path, str], scenarios: dict[str, Path], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    arguments = _arguments(scenarios, out, "--station=twin")
    begun = out / "untrained/seed_000/log/episode_0001.parquet"
    words = command("transfer_study", *arguments)
    with running(words, stderr=subprocess.PIPE) as process:
        wait_until(begun.exists, process)
        os.kill(process.pid, signal.SIGINT)
        _, errors = process.communicate()
    assert process.returncode == 130 and "Traceback" not in errors
    run = _run([*arguments, "--resume"])
    assert run.returncode == 0, run.stderr
    assert _branches(out) == _branches(study[0])


def test_a_scenario_that_is_missing_is_one_line(
    scenarios: dict[str, Path], tmp_path: Path
) -> None:
    bad = scenarios | {"after": tmp_path / "nowhere.yaml"}
    run = _run(_arguments(bad, tmp_path / "out"))
    assert run.returncode == 2 and "nowhere.yaml" in run.stderr
    assert not (tmp_path / "out").exists()

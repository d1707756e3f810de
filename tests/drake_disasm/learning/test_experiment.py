"""Experiments on disk: resumed across a change of names, and damage is one line."""

import dataclasses
import json
from pathlib import Path

import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.experiment import (
    Experiment,
    open_experiment,
    read_result,
    write_summary,
)
from drake_disasm.learning.hyperparameters import preset
from drake_disasm.learning.run import read_episodes
from drake_disasm.learning.warm_start import check_start
from drake_disasm.scenario import load_scenario
from tests.refusals import refused


@pytest.fixture
def experiment() -> Experiment:
    return Experiment(load_scenario("chapter3"), "twin", "best", preset("best"))


def test_an_experiment_that_says_model_is_resumed(experiment, tmp_path):
    open_experiment(experiment, tmp_path, resume=False)
    path = tmp_path / "training.json"
    content = json.loads(path.read_text())
    content["model"] = content.pop("station")  # as older versions call it
    path.write_text(json.dumps(content | {"provenance": {"seed": 7}}))
    resumed = open_experiment(experiment, tmp_path, resume=True)
    assert resumed.station == "twin" and resumed.provenance == {"seed": 7}
    other = Experiment(experiment.scenario, "cell", "best", experiment.config)
    with refused("another station (twin, not cell)"):
        open_experiment(other, tmp_path, resume=True)


FIGURES = {"episodes": 2, "successes": 1, "performance": 1.0, "mean_force": 1.0}
FIGURES |= {"peak_force": 2.0, "steps": 5.5}
RESULT = {"seed": 0, "validation": FIGURES, "training": FIGURES, "first_success": None}


@pytest.mark.parametrize("content", [
    "[]",
    json.dumps(RESULT)[:-9],
    json.dumps(RESULT | {"seed": "x"}),
    json.dumps(RESULT | {"training": 3}),
    json.dumps(RESULT | {"validation": FIGURES | {"steps": None}}),
])  # fmt: skip
def test_damaged_results_are_one_line(content: str, tmp_path: Path) -> None:
    path = tmp_path / "seed_000" / "result.json"
    path.parent.mkdir()
    path.write_text(json.dumps(RESULT))
    assert read_result(path) == RESULT
    path.write_text(content)
    with pytest.raises(DisasmError, match=r"result.json: is damaged .*; delete it"):
        write_summary(tmp_path)


@pytest.mark.parametrize("content", ["{", '{"config": {}, "scenario": 1}'])
def test_a_damaged_training_is_one_line(content, experiment, tmp_path):
    (tmp_path / "seed_000").mkdir()
    (tmp_path / "seed_000" / "result.json").touch()
    (tmp_path / "training.json").write_text(content)
    started = dataclasses.replace(experiment, start=str(tmp_path))
    for call in (
        lambda: check_start(started, [0]),
        lambda: open_experiment(experiment, tmp_path, resume=True),
    ):
        with pytest.raises(DisasmError, match=r"training.json: is damaged"):
            call()


@pytest.mark.parametrize("content", [
    b"episode,reward\n0,1\n",
    b"reward,outcome\n1,success,3\n",
    b"reward,outcome\nx,success\n",
    b"reward,outcome\n1,2\n",
    b'reward,outcome\n1,"suc',
    b"reward,outcome\n1," + b"x" * 200_000,
    b"\xff\xfe",
])  # fmt: skip
def test_damaged_episodes_are_one_line(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "episodes.csv"
    path.write_bytes(b"reward,outcome,note\n1,success,a\n")
    assert read_episodes(path) == [{"reward": 1.0, "outcome": "success", "note": "a"}]
    path.write_bytes(content)
    with refused("episodes.csv: is ", "; delete it"):
        read_episodes(path)

"""Experiments on disk: what was begun before a name changed can be resumed."""

import json
from pathlib import Path

import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.experiment import Experiment, open_experiment
from drake_disasm.learning.hyperparameters import preset
from drake_disasm.scenario import load_scenario


@pytest.fixture
def experiment() -> Experiment:
    return Experiment(load_scenario("sliding"), "twin", "best", preset("best"))


def _begin_as_of_old(experiment: Experiment, folder: Path) -> None:
    """Leaves a folder behind in which the station is called "model"."""
    open_experiment(experiment, folder, resume=False)
    path = folder / "training.json"
    content = json.loads(path.read_text())
    content["model"] = content.pop("station")
    content["provenance"] = {"seed": 7}
    path.write_text(json.dumps(content))


def test_an_experiment_that_says_model_is_resumed(
    experiment: Experiment, tmp_path: Path
) -> None:
    _begin_as_of_old(experiment, tmp_path)
    resumed = open_experiment(experiment, tmp_path, resume=True)
    assert resumed.station == "twin" and resumed.provenance == {"seed": 7}


def test_another_station_is_named(experiment: Experiment, tmp_path: Path) -> None:
    _begin_as_of_old(experiment, tmp_path)
    other = Experiment(experiment.scenario, "cell", "best", experiment.config)
    with pytest.raises(DisasmError, match=r"another station \(twin, not cell\)"):
        open_experiment(other, tmp_path, resume=True)

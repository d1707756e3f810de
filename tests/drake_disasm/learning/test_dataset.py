"""What a log teaches: the same transitions as having been there."""

import dataclasses
from pathlib import Path

import numpy as np

from drake_disasm.learning.dataset import remember
from drake_disasm.learning.hyperparameters import preset
from drake_disasm.learning.replay import Replay
from drake_disasm.learning.training import Training, TrainingSpec, action_map
from drake_disasm.logs import LogHeader, LogWriter, flat_columns, read_log
from drake_disasm.logs.transitions import observations
from drake_disasm.scenario import load_scenario

SCENARIO = load_scenario("chapter3", ["imprecision=0.0002", "task.steps=12"])


def test_a_log_teaches_what_was_lived_through(tmp_path: Path) -> None:
    changes = {"hidden": [4], "base": "admittance", "exploration": 0.0002}
    config = dataclasses.replace(preset("chapter3"), **changes)
    training = Training(TrainingSpec(SCENARIO, "twin", config, 3, compiled=False))
    header = LogHeader("transitions", "chapter3", {}, period=0.1)
    writer = LogWriter(tmp_path / "log", header)
    for _ in range(2):
        _, recorder = training.run_episode()
        writer.write_episode(flat_columns("transitions", recorder.columns()))
    memory = Replay(100)
    for episode in read_log(tmp_path / "log").episodes:
        actions, end = episode["action"][:-1], bool(episode["terminated"][-1])
        chosen = action_map(SCENARIO, config)
        seen = observations(episode)
        remember(memory, seen, actions, end, SCENARIO, chosen, config)
    lived, read = training.replay.contents()[0], memory.contents()[0]
    np.testing.assert_allclose(read, lived, atol=2e-5)


def test_an_action_out_of_reach_is_cut_to_the_nearest() -> None:
    config, memory = preset("chapter3"), Replay(5)
    actions = np.array([[0.009, -0.009, 0.0015, 0, 0, 0]])
    chosen = action_map(SCENARIO, config)
    remember(memory, np.zeros((2, 12)), actions, False, SCENARIO, chosen, config)
    np.testing.assert_allclose(memory.contents()[0][0, 12:15], [1.0, -1.0, 0.5])

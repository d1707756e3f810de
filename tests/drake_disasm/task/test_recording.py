"""Rows on hardware as they come: what ends an episode, and what is kept of it."""

import numpy as np
import pytest
from fault_runs import in_lockstep

from drake_disasm.logs import LogWriter, read_log
from drake_disasm.scenario import load_scenario
from drake_disasm.stations.fake_cell.cell import FakeCell
from drake_disasm.stations.hardware import HoldError
from drake_disasm.task.episode import run_episode
from drake_disasm.task.recording import EpisodeRecorder, transitions_header

STEPS = 3
ROWS = ".episode_0000.unfinished.csv"


def test_what_was_measured_is_kept_with_the_reason_of_the_end(tmp_path):
    cells: list[FakeCell] = []
    seen: list[int] = []

    def policy(_: np.ndarray) -> np.ndarray:
        cells[0].hex.fault = "jump" if len(seen) == STEPS else ""
        seen.append((tmp_path / ROWS).read_text().count("\n") - 1)
        return np.array([1e-3, 0, 0, 0, 0, 0])

    scenario = load_scenario("removal")
    writer = LogWriter(tmp_path, transitions_header(scenario, "hardware", {}))
    with in_lockstep(scenario, policy) as (simulation, _, cell):
        cells.append(cell)
        with pytest.raises(HoldError), writer.begin_episode() as episode:
            recorder = EpisodeRecorder(simulation, episode)
            run_episode(simulation, 0, recorder)
    assert seen[:STEPS] == [1, 2, 3]
    log = read_log(tmp_path)
    assert "the robot is held: force " in log.header.notes[0]["cut_off"]
    kept = log.episodes[0]
    assert kept.rows == STEPS + 1 == recorder.steps + 1
    for name, values in recorder.columns().items():
        end = -1 if name == "truncated" else None
        np.testing.assert_array_equal(kept[name][:end], values[:end])
    assert kept["truncated"][-1] and not kept["terminated"].any()
    np.testing.assert_allclose(kept["action"][:STEPS, 0], 1e-3)
    assert not kept["action"][-1].any()

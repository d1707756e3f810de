"""Rows on hardware as they come: what ends an episode, and what is kept of it."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fault_runs import in_lockstep

from drake_disasm.common.errors import DisasmError
from drake_disasm.fakes.cell import FakeCell
from drake_disasm.logs import LogWriter, read_log
from drake_disasm.scenario import load_scenario
from drake_disasm.task.episode import run_episode
from drake_disasm.task.recording import EpisodeRecorder, transitions_header

STEPS = 3
ROWS = ".episode_0000.unfinished.csv"


def _rows_on_disk(folder: Path) -> int:
    return max(0, (folder / ROWS).read_text().count("\n") - 1)


def _interrupted(_: FakeCell) -> None:
    raise KeyboardInterrupt


def _jumps(cell: FakeCell) -> None:
    cell.hex.fault = "jump"


@pytest.mark.parametrize(("happens", "error", "reason"), [
    (_interrupted, KeyboardInterrupt, "interrupted by Ctrl-C"),
    (_jumps, DisasmError, "the robot is held: force "),
])  # fmt: skip
def test_what_was_measured_is_kept_with_the_reason_of_the_end(
    happens: Callable[[FakeCell], None],
    error: type[BaseException],
    reason: str,
    tmp_path: Path,
) -> None:
    cells: list[FakeCell] = []
    seen: list[int] = []

    def policy(_: np.ndarray) -> np.ndarray:
        """Moves, and has something happen after some steps."""
        if len(seen) == STEPS:
            happens(cells[0])
        seen.append(_rows_on_disk(tmp_path))
        return np.array([1e-3, 0, 0, 0, 0, 0])

    scenario = load_scenario("removal")
    writer = LogWriter(tmp_path, transitions_header(scenario, "hardware", {}))
    with in_lockstep(scenario, policy) as (simulation, _, cell):
        cells.append(cell)
        with pytest.raises(error), writer.begin_episode() as episode:
            recorder = EpisodeRecorder(simulation, episode)
            run_episode(simulation, 0, recorder)
    assert seen[:STEPS] == [1, 2, 3]
    log = read_log(tmp_path)
    assert reason in log.header.notes[0]["cut_off"]
    kept = log.episodes[0]
    assert kept.rows == STEPS + 1 == recorder.steps + 1
    for name, values in recorder.columns().items():
        end = -1 if name == "truncated" else None
        np.testing.assert_array_equal(kept[name][:end], values[:end])
    assert kept["truncated"][-1] and not kept["terminated"].any()
    np.testing.assert_allclose(kept["action"][:STEPS, 0], 1e-3)
    assert not kept["action"][-1].any()

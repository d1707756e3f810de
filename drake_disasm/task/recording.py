"""Recording episodes in the layout of a log, and whole logs of them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.cell.arm_model import arm_joints
from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from drake_disasm.logs.columns import flat_columns
from drake_disasm.logs.header import LogHeader
from drake_disasm.logs.open_episode import OpenEpisode
from drake_disasm.logs.reader import Log, read_log
from drake_disasm.logs.writer import LogWriter
from drake_disasm.mdp import REWARD_TERMS, Outcome
from drake_disasm.scenario import Scenario, scenario_to_mapping
from drake_disasm.task.episode import run_episode
from drake_disasm.task.simulation import StepResult, TaskSimulation

_NO_STEP: dict[str, Any] = {
    "action": np.zeros(6),
    "action_executed": np.zeros(6),
} | {f"reward.{name}": np.float64(0.0) for name in REWARD_TERMS}

#: By the scenario's `ft_sensor.place`.
_WRENCH_FROM = {
    "wrist": "a sensor in the wrist",
    "part": "a sensor under the fixed part",
    "none": "an estimate without a sensor",
}


class EpisodeRecorder:
    """Collects an episode's rows in the layout of a `transitions` log.

    Row k holds what was measured at the start of step k and the action taken
    from it; the last row is what was measured at the end, with no action.
    """

    def __init__(
        self, simulation: TaskSimulation, episode: OpenEpisode | None = None
    ) -> None:
        """Collects nothing yet.

        Args:
            simulation: whose episode it is.
            episode: gets each row at once, too.
        """
        self._simulation, self._episode = simulation, episode
        self._rows: list[dict[str, Any]] = []

    def measure(self) -> None:
        """Opens a row with what is measured now."""
        self._open_row(Outcome.RUNNING, _NO_STEP)

    def acted(self, result: StepResult) -> None:
        """Completes the newest row with the step just done, and opens the next."""
        simulation, systems = self._simulation, self._simulation.systems
        step = {
            "action": simulation.action(),
            "action_executed": simulation.evaluate(
                systems.pose_target, "action_executed"
            ),
        } | {
            f"reward.{name}": np.float64(value)
            for name, value in result.reward_terms.items()
        }
        self._rows[-1] |= step
        self._open_row(result.outcome, step)

    def _open_row(self, outcome: Outcome, step: Mapping[str, Any]) -> None:
        """Adds a row of the present measurements, to which a step has led."""
        row = self._measured() | {
            "terminated": np.bool_(outcome.terminated),
            "truncated": np.bool_(outcome.truncated),
        }
        self._rows.append(row | _NO_STEP)
        if self._episode:
            self._episode.append(row, step)

    def _measured(self) -> dict[str, Any]:
        simulation, systems = self._simulation, self._simulation.systems
        return {
            "time": np.float64(simulation.time),
            "X_GB_measured": simulation.evaluate(systems.processor, "X_GB"),
            "X_GB_commanded": simulation.evaluate(
                systems.pose_target, "X_GB_commanded"
            ),
            "wrench": simulation.observation()[6:],
            "ft_sensor": simulation.evaluate(systems.station, "ft_sensor.wrench"),
            "q": simulation.joint_positions(),
        } | {
            f"extra.{parameter}": np.float64(value)
            for parameter, value in simulation.drawn.items()
        }

    @property
    def steps(self) -> int:
        """Whole steps recorded."""
        return max(0, len(self._rows) - 1)

    def columns(self) -> dict[str, np.ndarray]:
        """Returns the quantities, each (T + 1,) or (T + 1, n)."""
        names = self._rows[0].keys()
        return {name: np.stack([row[name] for row in self._rows]) for name in names}


def transitions_header(
    scenario: Scenario, station: str, provenance: Mapping[str, Any]
) -> LogHeader:
    """Returns the header of a log of transitions that a station has measured.

    Args:
        scenario: that the log states.
        station: "cell" or "hardware", which have joints, or "twin".
        provenance: where the log is from; the station is added, and what the wrench is
            from.
    """
    simulated = {
        "simulated": station != "hardware",
        "station": station,
        "wrench_from": _WRENCH_FROM[scenario.ft_sensor.place],
    }
    return LogHeader(
        kind="transitions",
        task=scenario.name,
        provenance={**provenance, **simulated},
        period=scenario.task.period,
        joints=() if station == "twin" else arm_joints(scenario.arm),
        scenario=scenario_to_mapping(scenario),
    )


def record_transitions(
    folder: Path,
    simulation: TaskSimulation,
    transitions: int,
    seed: int = 0,
    progress: Progress = ignore_progress,
) -> Log:
    """Records whole episodes until there are at least so many transitions.

    Args:
        folder: an empty one, or one to be made.
        simulation: with a policy.
        transitions: to record.
        seed: of the first episode; the next ones count on.
        progress: gets the number of transitions after each episode.
    """
    header = transitions_header(simulation.scenario, simulation.station_name, {})
    done = 0
    with LogWriter(folder, header) as writer:
        while done < transitions:
            recorder = EpisodeRecorder(simulation)
            done += run_episode(simulation, seed, recorder).steps
            progress(ProgressUpdate("recording", done, max(done, transitions)))
            writer.write_episode(flat_columns("transitions", recorder.columns()))
            seed += 1
    return read_log(folder)

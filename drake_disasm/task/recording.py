"""Logs of simulated episodes: their header, and recording a number of them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drake_disasm.logs.columns import flat_columns
from drake_disasm.logs.header import LogHeader
from drake_disasm.logs.reader import Log, read_log
from drake_disasm.logs.writer import LogWriter
from drake_disasm.scenario import Scenario, scenario_to_mapping
from drake_disasm.task.episode import EpisodeRecorder, run_episode
from drake_disasm.task.simulation import TaskSimulation

_JOINTS = tuple(f"iiwa_joint_{i}" for i in range(1, 8))


def transitions_header(
    scenario: Scenario, model: str, provenance: Mapping[str, Any]
) -> LogHeader:
    """Returns the header of a log of simulated transitions.

    Args:
        scenario: that the log states.
        model: "cell", which has joints, or "twin".
        provenance: where the log is from, beside its being simulated.
    """
    return LogHeader(
        kind="transitions",
        task=scenario.name,
        provenance={**provenance, "simulated": True, "model": model},
        period=scenario.task.period,
        joints=_JOINTS if model == "cell" else (),
        scenario=scenario_to_mapping(scenario),
    )


def record_transitions(
    folder: Path, simulation: TaskSimulation, transitions: int, seed: int = 0
) -> Log:
    """Records whole episodes until there are at least so many transitions.

    Args:
        folder: an empty one, or one to be made.
        simulation: with a policy.
        transitions: to record.
        seed: of the first episode; the next ones count on.
    """
    header = transitions_header(simulation.scenario, simulation.model, {})
    with LogWriter(folder, header) as writer:
        while transitions > 0:
            recorder = EpisodeRecorder(simulation)
            transitions -= run_episode(simulation, seed, recorder).steps
            writer.write_episode(flat_columns("transitions", recorder.columns()))
            seed += 1
    return read_log(folder)

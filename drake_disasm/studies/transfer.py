"""Does closing the loop help the policy? (thesis 4.4.2, table 4.3)

Agents are trained on the twin as first identified and on the twin after closing the
loop. Each, and an untrained one, is then trained in a stand-in for the robot: a
simulation with effects that the first twin lacks. P is the mean episodic reward over
that second training, so it rewards good policies and fast learning.

folder/
  twin_before/ twin_after/                trainings on the twins (see learning/run.py)
  untrained/ from_before/ from_after/     trainings in the stand-in
  from_*/seed_*/deployed.json             greedy episodes there before that training
  result.json  transfer.png
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.common.files import write_json
from drake_disasm.common.progress import Progress
from drake_disasm.learning.evaluation import evaluate, summed_up
from drake_disasm.learning.experiment import (
    Experiment,
    read_evaluation,
    read_result,
)
from drake_disasm.learning.learning_curve import plot_learning_curves
from drake_disasm.learning.run import read_episodes
from drake_disasm.learning.training import Purpose, seed_for
from drake_disasm.policies import load_policy
from drake_disasm.scenario import Scenario
from drake_disasm.studies.results import aligned, mean_interval
from drake_disasm.task.simulation import TaskSimulation


@dataclasses.dataclass(frozen=True)
class Branch:
    """One agent in the stand-in, by where it was trained before.

    Attributes:
        folder: of its training in the stand-in.
        start: folder of its training on a twin; empty for none.
        label: in tables and figures.
        thesis: P of its counterpart in the thesis (table 4.3), on a robot.
    """

    folder: str
    start: str
    label: str
    thesis: str


BRANCHES = (
    Branch("untrained", "", "without transfer", "-1.86"),
    Branch("from_before", "twin_before", "twin as first identified", "-11.34"),
    Branch("from_after", "twin_after", "twin, loop closed", "19.80, 10.66"),
)


@dataclasses.dataclass(frozen=True)
class TransferStudy:
    """What is compared.

    Attributes:
        before, after: scenarios of the twin, before and after closing the loop.
        stand_in: scenario of the simulation in place of the robot.
        station: "cell" or "twin", of the stand-in.
        common: everything else of the trainings; its scenario and station are unused.
        episodes: of each training in the stand-in.
        rehearsal: share of each batch there that comes from the replay memory of its
            twin; without it the new memory is so narrow that the agent unlearns.
        folder: for all of it.
    """

    before: Scenario
    after: Scenario
    stand_in: Scenario
    station: str
    common: Experiment
    episodes: int
    rehearsal: float
    folder: Path

    def experiments(self) -> dict[str, Experiment]:
        """Returns each training by its folder, in an order in which they can run."""
        twins = {"twin_before": self.before, "twin_after": self.after}
        trained = {
            name: dataclasses.replace(self.common, scenario=scenario, station="twin")
            for name, scenario in twins.items()
        }
        return trained | {b.folder: self._in_stand_in(b) for b in BRANCHES}

    def _in_stand_in(self, branch: Branch) -> Experiment:
        config = dataclasses.replace(
            self.common.config,
            episodes=self.episodes,
            demonstrations=self.rehearsal if branch.start else 0.0,
        )
        return dataclasses.replace(
            self.common,
            scenario=self.stand_in,
            station=self.station,
            config=config,
            start=str(self.folder / branch.start) if branch.start else "",
        )


@dataclasses.dataclass(frozen=True)
class Deployment:
    """A policy from a twin, to be evaluated in the stand-in before further training.

    Attributes:
        experiment: of the training there that starts from it.
        seed: of both trainings.
        folder: of this seed of that training.
    """

    experiment: Experiment
    seed: int
    folder: Path


def deploy(job: Deployment, progress: Progress) -> None:
    """Evaluates the policy before further training, unless that was done.

    Args:
        job: the policy and where it acts.
        progress: called after each episode.
    """
    path = job.folder / "deployed.json"
    if path.exists():
        return
    trained = Path(job.experiment.start) / job.folder.name / "policy.npz"
    policy, scenario = load_policy(trained), job.experiment.scenario
    policy.check_fits(scenario)
    simulation = TaskSimulation(scenario, job.experiment.station, policy)
    count = range(job.experiment.validation)
    seeds = [seed_for(job.seed, Purpose.VALIDATION, i) for i in count]
    figures = summed_up(evaluate(simulation, seeds, progress=progress))
    job.folder.mkdir(parents=True, exist_ok=True)
    write_json(path, dataclasses.asdict(figures))


def results(folder: Path) -> list[dict[str, Any]]:
    """Returns the figures of each branch over the seeds that are finished.

    Returns:
        For each of BRANCHES that has a finished seed: folder, label, thesis, seeds,
        and with one entry per seed P, first_success (number of the episode, or None)
        and success (share of the episodes) of the training; P and success of greedy
        episodes after it (greedy, greedy_success) and before it (deployed,
        deployed_success; empty without transfer).
    """
    found = []
    for branch in BRANCHES:
        paths = sorted((folder / branch.folder).glob("seed_*/result.json"))
        if paths:
            found.append(_figures(branch, paths))
    return found


def _figures(branch: Branch, paths: Sequence[Path]) -> dict[str, Any]:
    ends = [read_result(path, online=True) for path in paths]
    deployed = [p.with_name("deployed.json") for p in paths if branch.start]
    first = [read_evaluation(path) for path in deployed]
    return {
        "folder": branch.folder,
        "label": branch.label,
        "thesis": branch.thesis,
        "seeds": [end["seed"] for end in ends],
        "P": [end["training"]["performance"] for end in ends],
        "first_success": [end["first_success"] for end in ends],
        "success": [_share(end["training"]) for end in ends],
        "greedy": [end["validation"]["performance"] for end in ends],
        "greedy_success": [_share(end["validation"]) for end in ends],
        "deployed": [figures["performance"] for figures in first],
        "deployed_success": [_share(figures) for figures in first],
    }


def _share(figures: dict[str, Any]) -> float:
    return figures["successes"] / figures["episodes"]


_HEADER = (
    "",
    "P",
    "each seed",
    "success",
    "first success",
    "greedy before: P, success",
    "greedy after: P, success",
    "thesis: P",
)


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Returns the figures of `results` as a table for a terminal."""
    return "\n".join(aligned([_HEADER, *map(_cells, rows)]))


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    return (
        row["label"],
        f"{np.mean(row['P']):.1f}",
        ", ".join(f"{P:.1f}" for P in row["P"]),
        _percent(row["success"]),
        ", ".join(str(first or "-") for first in row["first_success"]),
        _greedy(row, "deployed"),
        _greedy(row, "greedy"),
        row["thesis"],
    )


@dataclasses.dataclass(frozen=True)
class PairedDifference:
    """By how much P is higher with the loop closed, seed by seed.

    Attributes:
        against: label of the branch that it is compared with.
        seeds: that both have, two at least.
        mean: of the differences of P.
        interval: 95 %, by Student's t.
    """

    against: str
    seeds: tuple[int, ...]
    mean: float
    interval: tuple[float, float]

    @property
    def text(self) -> str:
        """The difference in one line."""
        low, high = self.interval
        return (
            f"P with the loop closed, less that {self.against}: {self.mean:+.1f} "
            f"(95 %: {low:+.1f} to {high:+.1f}; {len(self.seeds)} seeds in pairs)"
        )


def paired_differences(rows: Sequence[dict[str, Any]]) -> list[PairedDifference]:
    """Returns what closing the loop adds to P, against each other branch.

    Args:
        rows: as of `results`.
    """
    by_folder = {row["folder"]: row for row in rows}
    closed = by_folder.pop("from_after", None)
    if closed is None:
        return []
    of_closed = dict(zip(closed["seeds"], closed["P"], strict=True))
    found = []
    for row in by_folder.values():
        others = dict(zip(row["seeds"], row["P"], strict=True))
        seeds = tuple(seed for seed in of_closed if seed in others)
        if len(seeds) < 2:
            continue
        mean, interval = mean_interval([of_closed[s] - others[s] for s in seeds])
        found.append(PairedDifference(row["label"], seeds, mean, interval))
    return found


def _percent(shares: Sequence[float]) -> str:
    return f"{100 * np.mean(shares):.0f} %"


def _greedy(row: dict[str, Any], name: str) -> str:
    if not row[name]:
        return "-"
    return f"{np.mean(row[name]):.1f}, {_percent(row[f'{name}_success'])}"


def write_results(folder: Path, provenance: dict[str, Any]) -> str:
    """Writes result and figure of the finished trainings; returns them as a table."""
    rows = results(folder)
    if not rows:
        return "no training in the stand-in is finished yet"
    differences = paired_differences(rows)
    data = {
        "branches": rows,
        "closed_loop_adds": [dataclasses.asdict(each) for each in differences],
        "provenance": provenance,
    }
    write_json(folder / "result.json", data)
    curves = {
        row["label"]: [
            read_episodes(path)
            for path in sorted((folder / row["folder"]).glob("seed_*/episodes.csv"))
        ]
        for row in rows
    }
    plot_learning_curves(curves, folder / "transfer.png")
    return "\n".join([table(rows), *(each.text for each in differences)])

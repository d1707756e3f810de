"""Several seeds of one training, in one folder.

folder/
  training.json        scenario, hyper-parameters, provenance
  seed_000/ ...        one training each (see run.py)
  summary.json         figures over the seeds that are finished
  learning_curve.png
"""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_json, write_json
from drake_disasm.common.finished_work import is_resumed, refuse_difference
from drake_disasm.learning.hyperparameters import Hyperparameters
from drake_disasm.learning.run import read_episodes
from drake_disasm.learning.statistics import wilson_interval
from drake_disasm.learning.training import TrainingSpec
from drake_disasm.scenario import Scenario, scenario_to_mapping
from drake_disasm.twin.refusals import make_like

#: Episodes at a time from which on their rows are not logged.
MOST_RECORDED = 1024
_AGAIN = "delete it, and resume the training"
_FIGURES = ("episodes", "successes", "performance", "mean_force", "peak_force", "steps")
_EVALUATION = dict.fromkeys(_FIGURES, 0.0)
_RESULT: dict[str, Any] = {"seed": 0, "validation": _EVALUATION}
_ONLINE: dict[str, Any] = {"training": _EVALUATION, "first_success": None}


@dataclasses.dataclass(frozen=True)
class Experiment:
    """What all seeds of a training have in common.

    Attributes:
        scenario, station, config, compiled, threads, envs, device, others: as in
            TrainingSpec.
        lockstep: whether seeds are trained side by side, on a batch of twins.
        preset: name of the hyper-parameters that `config` started from.
        validation: greedy episodes after each training, for its result.
        logs: folders to learn from without acting, with the hash of what is in
            them; empty to act.
        updates: gradient updates on those; 0 for one per transition.
        demonstrations: folders of logs to mix into each batch, and hashes.
        start: folder of a training whose agents, seed by seed, these continue from
            (see warm_start.py); empty to start anew.
        provenance: command, date, versions, commit.
    """

    scenario: Scenario
    station: str
    preset: str
    config: Hyperparameters
    compiled: bool = True
    threads: int = 1
    validation: int = 10
    logs: dict[str, str] = dataclasses.field(default_factory=dict)
    updates: int = 0
    demonstrations: dict[str, str] = dataclasses.field(default_factory=dict)
    start: str = ""
    provenance: dict[str, Any] = dataclasses.field(default_factory=dict)
    envs: int = 1
    lockstep: bool = False
    device: str = "numpy"
    others: tuple[Scenario, ...] = ()

    def __post_init__(self) -> None:
        """Refuses what does not go together.

        Raises:
            DisasmError: says what to give instead.
        """
        several, on_twin = self.envs > 1, self.station == "twin"
        if self.lockstep and (several or self.logs or not on_twin):
            raise DisasmError(
                "lockstep: agents side by side have one environment each, on a batch "
                "of twins; leave out `envs`, `station` and logs to learn from, or "
                "`lockstep`"
            )
        if several and not on_twin:
            raise DisasmError(
                f"envs: station '{self.station}' has no batch; give `station` twin, or "
                "one of `envs`"
            )
        if several and self.logs:
            raise DisasmError(
                f"envs: {self.envs} episodes at a time, but learning from logs runs "
                "none; leave `envs` out"
            )
        if self.device != "numpy" and not (several or self.logs):
            raise DisasmError(
                f"device: '{self.device}' computes for many episodes at a time; give "
                "`envs`, or leave `device` out"
            )
        make_like(self.device)
        self._refuse_other_tasks()

    def _refuse_other_tasks(self) -> None:
        """Refuses further tasks that one agent can't learn with the first."""
        if not self.others:
            return
        if self.logs or self.demonstrations:
            raise DisasmError(
                "also: logs are of one task; leave out the further scenarios, or logs "
                "to learn from"
            )
        ways = {scenario.part.way for scenario in (self.scenario, *self.others)}
        if len(ways) > 1 and self.config.axes != "stage":
            raise DisasmError(
                f"also: parts that leave by {' and '.join(sorted(ways))} need one view "
                "of their stages; give the hyper-parameter axes=stage"
            )
        for other in self.others:
            if other.task.period != self.scenario.task.period:
                raise DisasmError(
                    f"also: '{other.name}' has task.period {other.task.period:g}, not "
                    f"{self.scenario.task.period:g} s; set it to the same"
                )

    @property
    def is_recorded(self) -> bool:
        """Whether each episode's rows go into a log; of many they would fill a disk."""
        if self.logs or self.others:  # a log has one scenario
            return False
        return self.envs < MOST_RECORDED

    @property
    def is_batched(self) -> bool:
        """Whether it learns on a batch of twins, whose contact is IMPACT."""
        return self.envs > 1 or self.lockstep

    def spec(self, seed: int) -> TrainingSpec:
        """Returns one seed's training."""
        return TrainingSpec(
            self.scenario,
            self.station,
            self.config,
            seed,
            self.compiled,
            self.threads,
            self.envs,
            self.device,
            self.others,
        )

    def to_mapping(self) -> dict[str, Any]:
        """Returns it as plain data."""
        mapping = {
            field.name: getattr(self, field.name) for field in dataclasses.fields(self)
        }
        mapping["scenario"] = scenario_to_mapping(self.scenario)
        mapping["others"] = [scenario_to_mapping(other) for other in self.others]
        mapping["config"] = dataclasses.asdict(self.config)
        return mapping


def open_experiment(experiment: Experiment, folder: Path, resume: bool) -> Experiment:
    """Creates the folder, or finds the same experiment in it, and returns it.

    Raises:
        DisasmError: the folder holds something and `resume` is false, or it holds
            another experiment; names the first difference.
    """
    path = folder / "training.json"
    wanted = json.loads(json.dumps(experiment.to_mapping()))
    if not is_resumed(folder, path.name, "a training", resume):
        write_json(path, wanted)
        return experiment
    found = _with_station(read_training(folder, {"provenance": {}}))
    del wanted["provenance"]
    refuse_difference(folder, found, wanted)
    return dataclasses.replace(experiment, provenance=found["provenance"])


def _with_station(found: dict[str, Any]) -> dict[str, Any]:
    """Returns a training's plain data; an older one called the station "model".

    And it had one environment, no device, a process for each seed, one task, and the
    groove's axes.
    """
    if "model" in found:
        found["station"] = found.pop("model")
    if isinstance(found.get("config"), dict):
        found["config"] = {"axes": "groove"} | found["config"]
    added = {"envs": 1, "lockstep": False, "device": "numpy", "others": []}
    return added | found


def read_training(folder: Path, example: dict[str, Any]) -> dict[str, Any]:
    """Returns what the seeds of a training have in common, as plain data.

    Args:
        folder: of the training.
        example: what is needed of it, as in `plain_data.check_like`.

    Raises:
        DisasmError: it can't be read, or is damaged.
    """
    return read_json(folder / "training.json", "give a new folder", example)


def read_evaluation(path: Path) -> dict[str, Any]:
    """Returns the figures of an `Evaluation` from a JSON file.

    Raises:
        DisasmError: they can't be read, or are damaged.
    """
    return read_json(path, _AGAIN, _EVALUATION)


def seed_folder(folder: Path, seed: int) -> Path:
    """Returns the folder of one seed in that of all of them."""
    return folder / f"seed_{seed:03d}"


def read_result(path: Path, online: bool = False) -> dict[str, Any]:
    """Returns the content of a seed's `result.json`.

    Args:
        path: of the file.
        online: whether it must be of a training that acted.

    Raises:
        DisasmError: it can't be read, or is damaged.
    """
    result = read_json(path, _AGAIN, _RESULT)
    if online or "training" in result:
        return read_json(path, _AGAIN, _RESULT | _ONLINE)
    return result


def write_summary(folder: Path) -> str:
    """Writes summary and learning curve of the finished seeds; returns them as text."""
    results = [read_result(path) for path in sorted(folder.glob("seed_*/result.json"))]
    if not results:
        return "no seed is finished yet"
    summary = _summarised(results)
    write_json(folder / "summary.json", summary)
    seeds = [read_episodes(p) for p in sorted(folder.glob("seed_*/episodes.csv"))]
    if all(len(episodes) > 1 for episodes in seeds):
        from drake_disasm.learning.learning_curve import plot_learning_curves

        name = read_training(folder, {"config": {"algorithm": ""}, "preset": ""})
        label = f"{name['config']['algorithm']}, {name['preset']}"
        plot_learning_curves({label: seeds}, folder / "learning_curve.png")
    return _table(results, summary)


def _summarised(results: list[dict[str, Any]]) -> dict[str, Any]:
    """Returns success of trainings, first successes, P and validation over seeds."""
    summary: dict[str, Any] = {"seeds": [r["seed"] for r in results]}
    if all("training" in r for r in results):
        first = [r["first_success"] for r in results]
        won = sum(f is not None for f in first)
        summary["trained"] = won
        summary["trained_interval"] = wilson_interval(won, len(results))
        summary["first_success"] = first
        summary["P"] = [r["training"]["performance"] for r in results]
    for name in ("successes", "performance", "mean_force", "peak_force", "steps"):
        summary[f"validation_{name}"] = [r["validation"][name] for r in results]
    summary["validation_episodes"] = results[0]["validation"]["episodes"]
    return summary


def _table(results: list[dict[str, Any]], summary: dict[str, Any]) -> str:
    """Returns one line per seed and one for all, for a terminal."""
    lines = [
        "seed  first success  training P  validation: success   reward  steps  "
        "mean F  peak F"
    ]
    for r in results:
        v, training = r["validation"], r.get("training", {})
        first, P = r.get("first_success"), training.get("performance")
        lines.append(
            f"{r['seed']:4d}  {'-' if first is None else first:>13}  "
            f"{'-' if P is None else f'{P:.2f}':>10}  "
            f"{v['successes']:>10}/{v['episodes']:<8} {v['performance']:8.2f} "
            f"{v['steps']:6.1f} {v['mean_force']:5.2f} N {v['peak_force']:5.2f} N"
        )
    if "trained" in summary:
        low, high = summary["trained_interval"]
        lines.append(
            f"{summary['trained']} of {len(results)} trainings succeeded at least once "
            f"(95 %: {100 * low:.0f} to {100 * high:.0f} %)"
        )
    means = [np.mean(summary["validation_successes"])]
    lines.append(
        f"validation: {means[0]:.1f} of {summary['validation_episodes']} episodes "
        "succeed on average"
    )
    return "\n".join(lines)

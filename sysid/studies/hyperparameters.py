"""Which hyper-parameters of DDPG matter: a full factorial (thesis, chapter 5)."""

import dataclasses
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from drake_disasm.learning.hyperparameters import override, preset
from sysid.studies.effects_plot import plot_interactions, plot_main_effects
from sysid.studies.factorial import (
    Runs,
    Source,
    analysis_of_variance,
    level_averages,
    read_runs,
)
from sysid.studies.results import mean_of
from sysid.studies.runner import SeedResult, finished
from sysid.studies.study import (
    Factor,
    Level,
    Picture,
    Stage,
    Study,
    Table,
    Treatment,
    folder_name,
)

#: Averages of P by level (table 5.3, of its appendix A1).
_THESIS: Mapping[str, tuple[float, ...]] = {
    "batch": (-5.02, -6.88, -6.29),
    "tau": (-9.23, -4.77, -4.19),
    "actor_rate": (5.57, -11.24, -12.52),
    "critic_rate": (-0.29, -4.88, -13.01),
}
_TABLE_A1 = {
    "batch": "batch_size",
    "tau": "tau",
    "actor_rate": "actor_learning_rate",
    "critic_rate": "critic_learning_rate",
}
_SIGNIFICANT = 0.05


class HyperparameterStudy(Study):
    """Averages and ranges of levels, interactions, and the best combination."""

    name = "hyperparameters"
    question = (
        "Which hyper-parameters of DDPG decide how well it learns, and do they "
        "depend on one another?"
    )
    source = "thesis, chapter 5, tables 5.2, 5.3 and A1"
    factors = (
        Factor("batch", "", (100.0, 1000.0, 2000.0)),
        Factor("tau", "", (0.1, 0.5, 0.9)),
        Factor("actor_rate", "", (0.005, 0.05, 0.5)),
        Factor("critic_rate", "", (0.005, 0.05, 0.5)),
    )
    seeds, episodes = 3, 100

    def stages(self, folder: Path) -> Iterator[Stage]:
        """Yields all trainings at once."""
        yield Stage(self.treatments(folder), self.options.seeds)

    def treatment(self, levels: dict[str, Level], folder: Path) -> Treatment:
        """See Study."""
        changes = [f"{name}={float(level):g}" for name, level in levels.items()]
        config = override(preset("chapter5", "ddpg"), changes)
        experiment = self.experiment("chapter5", config, "chapter5")
        return Treatment(folder_name(levels), levels, experiment)

    def tables(self, folder: Path) -> list[Table]:
        """Returns averages, the analysis of variance, and the best combinations."""
        results = finished(self.treatments(folder), self.options.seeds, folder)
        if not results:
            return []
        runs, thesis = _runs(results), self._thesis_runs()
        return [
            _averages(runs),
            *_variance("Analysis of variance", runs),
            *(_variance("The same of the thesis's table A1", thesis) if thesis else []),
            _best(results),
            _time(results),
        ]

    def _thesis_runs(self) -> Runs | None:
        """Returns the rows of table A1, if the user has given its file."""
        path = self.options.compare
        if path is None:
            return None
        found = read_runs(path, list(_TABLE_A1.values()))
        levels = {name: found.levels[column] for name, column in _TABLE_A1.items()}
        return dataclasses.replace(found, levels=levels)

    def pictures(self, folder: Path) -> list[Picture]:
        """Returns plots of main effects and interactions."""
        results = finished(self.treatments(folder), self.options.seeds, folder)
        if not results:
            return []
        sets = {"here": _runs(results)}
        if thesis := self._thesis_runs():
            sets["thesis"] = thesis
        pictures = [
            Picture(
                "Main effects",
                "main_effects.png",
                partial(plot_main_effects, sets),
            )
        ]
        for name, runs in sets.items():
            pictures.append(
                Picture(
                    f"Interactions, {name}",
                    f"interactions_{name}.png",
                    partial(plot_interactions, runs),
                )
            )
        return pictures


def _runs(results: list[SeedResult]) -> Runs:
    names = list(results[0].treatment.levels)
    levels = {
        name: np.array([float(r.treatment.levels[name]) for r in results])
        for name in names
    }
    P = np.array([r.figures["training"]["performance"] for r in results])
    return Runs(levels, P)


def _averages(runs: Runs) -> Table:
    rows = []
    for own in level_averages(runs):
        thesis = _THESIS[own.factor]
        known = {f.name: f.levels for f in HyperparameterStudy.factors}[own.factor]
        for level, average, spread in zip(
            own.levels, own.average, own.spread, strict=True
        ):
            said = thesis[known.index(float(level))]
            rows.append(
                [own.factor, f"{level:g}"]
                + [f"{value:.2f}" for value in (average, spread, said)]
            )
        ends = f"{own.range:.2f}", "", f"{np.ptp(thesis):.2f}"
        rows.append([own.factor, "range", *ends])
    columns = ["factor", "level", "average P", "its spread", "thesis: average P"]
    note = "P is the mean episodic reward of a training; table 5.3."
    return Table("Averages and ranges", columns, rows, note)


def _variance(title: str, runs: Runs) -> list[Table]:
    count = len(runs.response)
    if count <= np.prod([len(np.unique(levels)) for levels in runs.levels.values()]):
        return []
    sources = analysis_of_variance(runs)
    total = sum(source.sum_of_squares for source in sources)
    rows = [
        [
            " x ".join(source.factors) or "residual",
            f"{source.freedom:g}",
            f"{100 * source.sum_of_squares / total:.1f} %",
            *([f"{source.F:.2f}", f"{source.p:.2g}"] if source.factors else ["", ""]),
        ]
        for source in sorted(sources, key=_order)
    ]
    columns = ["source", "degrees of freedom", "share of variance", "F", "p"]
    return [Table(title, columns, rows, _named(sources))]


def _order(source: Source) -> tuple[bool, float]:
    return not source.factors, -source.sum_of_squares


def _named(sources: list[Source]) -> str:
    found = [
        " x ".join(s.factors)
        for s in sorted(sources, key=_order)
        if len(s.factors) == 2 and s.p < _SIGNIFICANT
    ]
    said = ", ".join(found) or "none"
    return f"Interactions with p < {_SIGNIFICANT:g}: {said}. Type II sums of squares."


def _best(results: list[SeedResult]) -> Table:
    by_folder: dict[str, list[SeedResult]] = {}
    for r in results:
        by_folder.setdefault(r.treatment.folder, []).append(r)
    P = {
        name: [r.figures["training"]["performance"] for r in own]
        for name, own in by_folder.items()
    }
    names = sorted(P, key=lambda name: -np.mean(P[name]))[:5]
    names_of = list(results[0].treatment.levels)
    rows = [
        [
            *(f"{by_folder[n][0].treatment.levels[f]:g}" for f in names_of),
            mean_of(P[n]),
            str(sum(r.has_succeeded for r in by_folder[n])),
        ]
        for n in names
    ]
    columns = [*names_of, "P", "trainings that succeed"]
    note = "The thesis's best: 2000, 0.5, 0.005, 0.005, with P = 36.0."
    return Table("The best combinations", columns, rows, note)


def _time(results: list[SeedResult]) -> Table:
    spent = {
        part: sum(r.figures["seconds"].get(part, 0.0) for r in results)
        for part in ("simulation", "updates", "saving")
    }
    total = sum(spent.values()) or 1.0
    rows = [[n, f"{s / 60:.1f}", f"{100 * s / total:.0f} %"] for n, s in spent.items()]
    note = "Added up over all trainings: time of one core, not of the clock."
    return Table("Where the time went", ["part", "minutes", "share"], rows, note)

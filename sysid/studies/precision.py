"""How the robot's imprecision changes what is learned (thesis, table 3.2 and 3.4.2)."""

import dataclasses
import functools
from collections.abc import Callable, Iterator
from pathlib import Path

from drake_disasm.learning.learning_curve import plot_learning_curves
from drake_disasm.learning.run import read_episodes
from drake_disasm.logs import read_log
from sysid.studies.results import (
    instability_index,
    mean_of,
    rate,
)
from sysid.studies.runner import SeedResult, finished
from sysid.studies.study import (
    AGENTS,
    Factor,
    Level,
    Picture,
    Stage,
    Study,
    Table,
    Treatment,
)

#: Success rate of ten trainings (table 3.2), by psi [m].
_THESIS = {0.0: 70, 1e-4: 60, 2e-4: 30, 3e-4: 30, 4e-4: 60, 5e-4: 40}
_THESIS_FORCE = 2.0  # N, mean, of a learned policy
_Cell = Callable[[list[SeedResult]], str]
_POOLED = "pooled"
_SOURCE: dict[str, Level] = {"agent": "ddpg", "psi": 0.0}  # whose data are pooled


class PrecisionStudy(Study):
    """Training success and instability against imprecision; learning from its data."""

    name = "precision"
    question = (
        "How often does a training succeed, and how steady is what it learns, as the "
        "robot gets less precise? Is a policy from all their data better than each?"
    )
    source = "thesis, tables 3.1 and 3.2, eq. 3.5, section 3.4.2"
    factors = (
        Factor("agent", "", AGENTS),
        Factor("psi", "m", tuple(_THESIS)),
    )
    seeds, episodes = 10, 200

    def stages(self, folder: Path) -> Iterator[Stage]:
        """Yields the trainings, then learning from the pooled data of some."""
        seeds = self.options.seeds
        yield Stage(self.treatments(folder), seeds)
        if pooled := self._pooled(folder):
            yield Stage([pooled], seeds)

    def treatment(self, levels: dict[str, Level], folder: Path) -> Treatment:
        """See Study."""
        return self.of_agent(levels, "chapter3")

    def _pooled(self, folder: Path) -> Treatment | None:
        """Returns learning from all data of the trainings without imprecision."""
        sources = [t for t in self.treatments(folder) if t.levels == _SOURCE]
        results = finished(sources, self.options.seeds, folder)
        if not results:
            return None
        logs = [result.folder / "log" for result in results]
        experiment = dataclasses.replace(
            sources[0].experiment,
            logs={str(log): _data_hash(log) for log in logs},
            lockstep=False,
        )
        return Treatment(_POOLED, {}, experiment)

    def tables(self, folder: Path) -> list[Table]:
        """Returns success, instability and force by imprecision, and the pooled one."""
        results = finished(self.treatments(folder), self.options.seeds, folder)
        tables = [
            Table(
                "Trainings in which at least one episode succeeds",
                ["psi [mm]", "thesis: DDPG", *map(str, self.levels["agent"])],
                self._by_psi(results, _success, [f"{p} %" for p in _THESIS.values()]),
                "In brackets Wilson's 95 % interval.",
            ),
            Table(
                "Instability index I_s of the greedy policies (eq. 3.5)",
                ["psi [mm]", *map(str, self.levels["agent"])],
                self._by_psi(results, _instability),
                "Of the trainings whose policy succeeds at all; their number in "
                "brackets. A mean over them, so that rows compare.",
            ),
            Table(
                "Greedy episodes that succeed",
                ["psi [mm]", *map(str, self.levels["agent"])],
                self._by_psi(results, _greedy),
                "Of all trainings' policies together.",
            ),
            Table(
                "Mean force of the greedy policies that succeed [N]",
                ["psi [mm]", *map(str, self.levels["agent"])],
                self._by_psi(results, _force),
                f"The thesis has {_THESIS_FORCE:g} N, on its robot.",
            ),
        ]
        return [*tables, *self._pooled_table(results, folder)]

    def _by_psi(
        self,
        results: list[SeedResult],
        cell: _Cell,
        thesis: list[str] | None = None,
    ) -> list[list[str]]:
        known = dict(zip(_THESIS, thesis or [], strict=False))
        rows = []
        for psi in self.levels["psi"]:
            own = [r for r in results if r.treatment.levels["psi"] == psi]
            cells = [
                cell([r for r in own if r.treatment.levels["agent"] == agent])
                for agent in self.levels["agent"]
            ]
            said = [known[float(psi)]] if thesis else []
            rows.append([f"{1e3 * float(psi):g}", *said, *cells])
        return rows

    def _pooled_table(self, results: list[SeedResult], folder: Path) -> list[Table]:
        treatment = self._pooled(folder)
        if treatment is None:
            return []
        pooled = finished([treatment], self.options.seeds, folder)
        alone = [r for r in results if r.treatment.levels == _SOURCE]
        rows = [
            [
                label,
                mean_of([r.validation["performance"] for r in own]),
                mean_of([r.validation["instability"] for r in own], 2),
                _greedy(own),
            ]
            for label, own in (("each alone", alone), ("from all their data", pooled))
        ]
        columns = ["DDPG, psi = 0", "greedy reward", "its spread", "greedy success"]
        note = "Learned without acting, from all transitions of the trainings above."
        return [Table("Learning from the pooled dataset", columns, rows, note)]

    def pictures(self, folder: Path) -> list[Picture]:
        """Returns learning curves of each agent, a line for each imprecision."""
        results = finished(self.treatments(folder), self.options.seeds, folder)
        found = []
        for agent in self.levels["agent"]:
            own = [r for r in results if r.treatment.levels["agent"] == agent]
            if own:
                found.append(_curves(str(agent), own))
        return found


@functools.cache
def _data_hash(log: Path) -> str:
    """Returns the hash of a finished training's log, which takes seconds to read."""
    return read_log(log).data_hash


def _curves(agent: str, results: list[SeedResult]) -> Picture:
    def draw(path: Path) -> None:
        """Draws the learning curves."""
        by_psi: dict[str, list[list[dict[str, object]]]] = {}
        for r in results:
            label = f"psi = {1e3 * float(r.treatment.levels['psi']):g} mm"
            rows = read_episodes(r.folder / "episodes.csv")
            by_psi.setdefault(label, []).append(rows)
        plot_learning_curves(by_psi, path)

    return Picture(f"Learning curves of {agent}", f"curves_{agent}.png", draw)


def _success(results: list[SeedResult]) -> str:
    return rate(sum(r.has_succeeded for r in results), len(results))


def _instability(results: list[SeedResult]) -> str:
    index, count = instability_index(results)
    return f"{index / count:.2f} ({count})" if count else "-"


def _greedy(results: list[SeedResult]) -> str:
    return rate(
        sum(r.validation["successes"] for r in results),
        sum(r.validation["episodes"] for r in results),
    )


def _force(results: list[SeedResult]) -> str:
    won = [r.validation for r in results if r.validation["successes"]]
    return mean_of([v["mean_force"] for v in won])

"""What a policy is worth on a robot of another precision (thesis, table 3.3)."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.learning.random_numbers import Purpose, seed_for
from drake_disasm.scenario import load_scenario
from sysid.studies.results import mean_of, rate
from sysid.studies.runner import SeedResult, finished, test_path
from sysid.studies.study import (
    Factor,
    Level,
    PolicyTest,
    Stage,
    Study,
    Table,
    Treatment,
    level_text,
)

_Cell = Callable[[list[dict[str, float]]], str]
_PSI = (0.0, 3e-4, 5e-4)  # m
#: Performance by agent: rows are the psi of training, columns that of the test.
_THESIS = {
    "ddpg": ((34.5, 29.7, 22.6), (35.8, 32.7, 18.0), (49.8, 41.9, 31.4)),
    "sac": ((54.8, 45.0, 26.3), (53.3, 48.1, 32.1), (57.1, 50.0, 31.8)),
    "td3": ((65.8, 42.1, 22.9), (68.4, 61.6, 44.2), (57.8, 53.9, 43.5)),
}


class PrecisionTransferStudy(Study):
    """Policies trained at one imprecision, judged at all."""

    name = "precision_transfer"
    question = (
        "What becomes of a policy on a more or a less precise robot than the one that "
        "it was trained on?"
    )
    source = "thesis, table 3.3"
    factors = (Factor("agent", "", tuple(_THESIS)), Factor("psi", "m", _PSI))
    seeds, episodes, validation = 3, 500, 200

    def stages(self, folder: Path) -> Iterator[Stage]:
        """Yields the trainings, then tests of their policies at each imprecision."""
        treatments = self.treatments(folder)
        yield Stage(treatments, self.options.seeds)
        results = finished(treatments, self.options.seeds, folder)
        tests = [
            self._test(r, psi) for r in results for psi in _PSI if psi != _own_psi(r)
        ]
        yield Stage(tests=tests)

    def treatment(self, levels: dict[str, Level], folder: Path) -> Treatment:
        """See Study."""
        return self.of_agent(levels, "chapter3")

    def _test(self, result: SeedResult, psi: float) -> PolicyTest:
        overrides = [f"imprecision={psi}", *self.options.overrides]
        count = range(self.validation_episodes)
        return PolicyTest(
            test_path(result.folder, _name(psi)),
            str(result.folder / "policy.npz"),
            load_scenario("chapter3", overrides),
            "twin",
            tuple(seed_for(result.seed, Purpose.VALIDATION, i) for i in count),
        )

    def tables(self, folder: Path) -> list[Table]:
        """Returns performance and success for each pair of imprecisions."""
        treatments = self.treatments(folder)
        results = finished(treatments, self.options.seeds, folder)
        return [
            Table(
                "Mean episodic reward, mean ± spread over seeds; thesis in brackets",
                self._columns(),
                self._rows(treatments, results, _performance, thesis=True),
                "Greedy episodes; the thesis has one policy of each.",
            ),
            Table(
                "Instability: spread of the episodic reward",
                self._columns(),
                self._rows(treatments, results, _instability),
            ),
            Table(
                "Episodes that succeed",
                self._columns(),
                self._rows(treatments, results, _successes),
                "In brackets Wilson's 95 % interval, all seeds together.",
            ),
            self._changes(results),
        ]

    def _columns(self) -> list[str]:
        tests = [f"on psi = {1e3 * psi:g} mm" for psi in _PSI]
        return ["agent", "trained at psi [mm]", *tests]

    def _rows(
        self,
        treatments: list[Treatment],
        results: list[SeedResult],
        cell: _Cell,
        thesis: bool = False,
    ) -> list[list[str]]:
        rows = []
        for treatment in treatments:
            agent, psi = treatment.levels["agent"], float(treatment.levels["psi"])
            own = [r for r in results if r.treatment is treatment]
            row = [str(agent), f"{1e3 * psi:g}"]
            for i, on in enumerate(_PSI):
                said = _THESIS[str(agent)][_PSI.index(psi)][i]
                text = cell([t for r in own if (t := _figures(r, on))])
                row.append(f"{text} ({said:g})" if thesis else text)
            rows.append(row)
        return rows

    def _changes(self, results: list[SeedResult]) -> Table:
        """Returns what policies gain on a more and lose on a less precise robot."""
        rows = []
        for agent in self.levels["agent"]:
            own = [r for r in results if r.treatment.levels["agent"] == agent]
            more, less = _differences(own)
            rows.append([str(agent), _with_interval(more), _with_interval(less)])
        note = (
            "Differences to the same policy on its own robot, over seeds and pairs of "
            "imprecisions; in brackets the 95 % interval of the mean, by resampling "
            "trainings."
        )
        columns = ["agent", "on a more precise robot", "on a less precise one"]
        return Table("Change of the mean episodic reward", columns, rows, note)


def _differences(
    results: list[SeedResult],
) -> tuple[list[list[float]], list[list[float]]]:
    """Returns changes on more and on less precise robots, a list for each training."""
    more, less = [], []
    for r in results:
        trained = _own_psi(r)
        tests = {psi: t for psi in _PSI if (t := _figures(r, psi))}
        own = tests.pop(trained)["performance"]
        change = {psi: test["performance"] - own for psi, test in tests.items()}
        more.append([d for psi, d in change.items() if psi < trained])
        less.append([d for psi, d in change.items() if psi > trained])
    return more, less


def _with_interval(changes: list[list[float]]) -> str:
    """Returns the mean with its bootstrap interval; whole trainings are drawn."""
    own = [np.mean(each) for each in changes if each]
    if len(own) < 2:
        return "-"
    random = np.random.default_rng(0)
    means = random.choice(own, (2000, len(own))).mean(axis=1)
    low, high = np.quantile(means, (0.025, 0.975))
    return f"{np.mean(own):+.2f} ({low:+.2f} to {high:+.2f})"


def _own_psi(result: SeedResult) -> float:
    """Returns the imprecision at which a policy was trained, and validated."""
    return float(result.treatment.levels["psi"])


def _figures(result: SeedResult, psi: float) -> dict[str, Any] | None:
    """Returns a policy's greedy episodes at an imprecision, if they are finished."""
    is_own = psi == _own_psi(result)
    return result.validation if is_own else result.test(_name(psi))


def _name(psi: float) -> str:
    return f"psi_{level_text(psi)}"


def _performance(tests: list[dict[str, float]]) -> str:
    return mean_of([test["performance"] for test in tests])


def _instability(tests: list[dict[str, float]]) -> str:
    return mean_of([test["instability"] for test in tests])


def _successes(tests: list[dict[str, float]]) -> str:
    return rate(
        int(sum(test["successes"] for test in tests)),
        int(sum(test["episodes"] for test in tests)),
    )

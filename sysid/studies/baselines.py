"""Classical control beside every agent, on the same episodes."""

from collections.abc import Iterator
from pathlib import Path

from drake_disasm.scenario import load_scenario
from sysid.studies.results import rate
from sysid.studies.runner import finished, read_test, test_path
from sysid.studies.study import (
    AGENTS,
    Factor,
    Level,
    PolicyTest,
    Stage,
    Study,
    Table,
    Treatment,
    level_text,
)

_CLASSICAL = ("straight", "admittance")
_SCENARIO = "chapter4"
_FIRST_TEST = 900_000  # seed; not one of any training


class BaselineStudy(Study):
    """Success, force and steps of scripted policies and agents at each imprecision."""

    name = "baselines"
    question = "Is what is learned better than classical control, and in what?"
    source = "named as future work in the thesis"
    factors = (
        Factor("agent", "", AGENTS),
        Factor("psi", "m", (0.0, 3e-4, 5e-4)),
    )
    seeds, episodes, validation = 3, 150, 50

    def stages(self, folder: Path) -> Iterator[Stage]:
        """Yields the trainings, then the same episodes for every policy."""
        treatments = self.treatments(folder)
        yield Stage(treatments, self.options.seeds)
        yield Stage(tests=self._tests(treatments, folder))

    def treatment(self, levels: dict[str, Level], folder: Path) -> Treatment:
        """See Study."""
        return self.of_agent(levels, _SCENARIO)

    def _tests(self, treatments: list[Treatment], folder: Path) -> list[PolicyTest]:
        results = finished(treatments, self.options.seeds, folder)
        agents = [
            self._test(
                test_path(r.folder, "same"),
                str(r.folder / "policy.npz"),
                r.treatment.levels["psi"],
            )
            for r in results
        ]
        classical = [
            self._test(_classical_path(folder, name, psi), name, psi)
            for name in _CLASSICAL
            for psi in self.levels["psi"]
        ]
        return [*classical, *agents]

    def _test(self, path: Path, policy: str, psi: Level) -> PolicyTest:
        overrides = [f"imprecision={psi}", *self.options.overrides]
        count = self.validation_episodes
        seeds = tuple(range(_FIRST_TEST, _FIRST_TEST + count))
        return PolicyTest(
            path, policy, load_scenario(_SCENARIO, overrides), "twin", seeds
        )

    def tables(self, folder: Path) -> list[Table]:
        """Returns one table for each imprecision."""
        treatments = self.treatments(folder)
        results = finished(treatments, self.options.seeds, folder)
        tables = []
        for psi in self.levels["psi"]:
            rows = [
                [name, "", *_cells([read_test(_classical_path(folder, name, psi))])]
                for name in _CLASSICAL
            ]
            for agent in self.levels["agent"]:
                levels = {"agent": agent, "psi": psi}
                own = [r for r in results if r.treatment.levels == levels]
                tests = [r.test("same") for r in own]
                rows.append([str(agent), str(len(own)), *_cells(tests)])
            title = f"psi = {1e3 * float(psi):g} mm"
            tables.append(Table(title, _COLUMNS, rows, _NOTE))
        return tables


_COLUMNS = (
    "policy",
    "trainings",
    "success",
    "reward",
    "mean force [N]",
    "peak force [N]",
    "steps",
)
_NOTE = (
    "The same episodes for all; of agents the mean over the policies of all seeds, "
    "those that learned nothing included. Success with Wilson's 95 % interval."
)


def _classical_path(folder: Path, name: str, psi: Level) -> Path:
    return folder / "classical" / f"{name}__psi_{level_text(psi)}.json"


def _cells(tests: list[dict[str, float] | None]) -> list[str]:
    own = [test for test in tests if test is not None]
    if not own:
        return ["-"] * (len(_COLUMNS) - 2)
    success = rate(
        int(sum(test["successes"] for test in own)),
        int(sum(test["episodes"] for test in own)),
    )
    names = ("performance", "mean_force", "mean_peak_force", "steps")
    means = [sum(test[name] for test in own) / len(own) for name in names]
    digits = (1, 2, 2, 1)
    return [success, *(f"{m:.{d}f}" for m, d in zip(means, digits, strict=True))]

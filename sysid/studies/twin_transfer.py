"""Is a policy better for the loop having been closed? (thesis, table 4.3, and beyond)

A robot differs from its twin in one way or another (`mismatches`). Agents are trained
on twins that know more or less of it (_BRANCHES), and act on the robot without having
seen it; the cell stands for the robot, and is simulated, too::

    folder/
      robots/MISMATCH/                 a log of the robot, and twins from it
      mismatch_M__agent_A__branch_B/   trainings on a twin; "any" for a common one
      tests/MISMATCH/AGENT__BRANCH/    greedy episodes on the robot, a file per seed
"""

import dataclasses
import functools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from drake_disasm.learning.hyperparameters import Hyperparameters, override
from drake_disasm.learning.training import Purpose, seed_for
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.scenario.schema import Range
from drake_disasm.studies.results import paired_difference, rate
from drake_disasm.studies.runner import finished, read_test
from drake_disasm.studies.study import (
    Factor,
    Level,
    PolicyTest,
    Stage,
    Study,
    Table,
    Treatment,
    agent_config,
    folder_name,
)
from sysid.studies.closed_twin import ClosedTwin, with_effects
from sysid.studies.mismatches import MISMATCHES

_SCENARIO = "chapter3"
_STATION = "cell"  # which stands for the robot
_LOG_SEED = 500_000  # not one of any training
_TIME_BUDGET = 1200.0  # s, of closing the loop
#: What lets an agent without a base policy learn: with the thesis's numbers alone DDPG
#: seldom does (docs/learning.md).
_LAYER_NORM = ("layer_norm=true",)
#: Ranges that surely have the robot in them, for who does not know it.
_WIDE = (
    Range("GroovePose.rx", -0.105, 0.105),  # rad, 6 degrees
    Range("GroovePose.ry", -0.105, 0.105),
    Range("GroovePose.rz", -0.105, 0.105),
    Range("GrooveFriction.coefficient", -0.1, 0.2),
    Range("SensorBias.fx", -4.0, 4.0),  # N
    Range("SensorBias.fy", -4.0, 4.0),
    Range("SensorBias.fz", -4.0, 4.0),
    Range("SensorCrossTalk.fy_fx", -0.4, 0.4),
    Range("SensorCrossTalk.fz_fx", -0.4, 0.4),
    Range("ChainPull.k", 0.0, 150.0),  # N/m
    Range("CommandGain.x", -0.4, 0.4),
)
_NOMINAL, _WIDE_NAME, _CLOSED = "nominal", "wide", "closed"
#: What a twin knows of the robot, and where; those not made from a log serve them all.
_BRANCHES = {
    _NOMINAL: "the twin as it is",
    _WIDE_NAME: "the twin, randomised widely",
    "identified": "the twin, its parameters identified on a log",
    _CLOSED: "the twin after closing the loop on that log",
    "intervals": "the same, randomised over the intervals that it gives",
    "truth": "the twin with the true effects, by hand",
}
_COMMON = (_NOMINAL, _WIDE_NAME)


class TwinTransferStudy(Study):
    """Policies from twins that know more or less of a robot, on that robot."""

    name = "twin_transfer"
    question = (
        "Is a policy that was trained on the twin better on the robot for the loop "
        "having been closed, for which mismatch and which agent?"
    )
    source = "beyond the thesis's table 4.3; the robot is the simulated cell"
    factors = (
        Factor("mismatch", "", tuple(MISMATCHES)),
        Factor("agent", "", ("ddpg", "ddpg_layer_norm", "sac_layer_norm", "best")),
        Factor("branch", "", tuple(_BRANCHES)),
    )
    seeds, episodes, validation = 10, 100, 2

    def stages(self, folder: Path) -> Iterator[Stage]:
        """Yields the robots' logs with twins, then trainings, then tests."""
        robots = [self._robot(str(name), folder) for name in self.levels["mismatch"]]
        yield Stage(preparations=robots)
        yield Stage(self._trainings(folder), self.options.seeds)
        yield Stage(tests=self._tests(folder))

    def _robot(self, mismatch: str, folder: Path) -> ClosedTwin:
        nominal = self._nominal
        return ClosedTwin(
            folder=folder / "robots" / mismatch,
            nominal=nominal,
            robot=with_effects(nominal, MISMATCHES[mismatch].effects),
            station=_STATION,
            seed=_LOG_SEED,
            time_budget=_TIME_BUDGET,
        )

    @functools.cached_property
    def _nominal(self) -> Scenario:
        return load_scenario(_SCENARIO, self.options.overrides)

    def _twin(self, levels: dict[str, Level], folder: Path) -> Scenario:
        """Returns the scenario on which an agent is trained."""
        branch, nominal = levels["branch"], self._nominal
        if branch == _NOMINAL:
            return nominal
        if branch == _WIDE_NAME:
            return dataclasses.replace(nominal, randomisation=list(_WIDE))
        mismatch = str(levels["mismatch"])
        if branch == "truth":
            return with_effects(nominal, MISMATCHES[mismatch].effects)
        return self._robot(mismatch, folder).twin(str(branch))

    def treatment(self, levels: dict[str, Level], folder: Path) -> Treatment:
        """See Study."""
        known = levels | ({"mismatch": "any"} if levels["branch"] in _COMMON else {})
        config, preset_name = self._agent(str(levels["agent"]))
        experiment = self.experiment(_SCENARIO, config, preset_name)
        # One episode on its own twin: it is judged on the robots.
        experiment = dataclasses.replace(
            experiment, scenario=self._twin(levels, folder), validation=1
        )
        return Treatment(folder_name(known), levels, experiment)

    def _agent(self, name: str) -> tuple[Hyperparameters, str]:
        algorithm, _, is_normalised = name.partition("_")
        config, preset_name = agent_config(algorithm, _SCENARIO)
        return override(config, _LAYER_NORM if is_normalised else ()), preset_name

    def _trainings(self, folder: Path) -> list[Treatment]:
        """Returns each training once: some twins are the same for all robots."""
        every = [self.treatment(each, folder) for each in self._ready(folder)]
        return list({each.folder: each for each in every}.values())

    def _ready(self, folder: Path) -> list[dict[str, Level]]:
        """Returns the combinations whose robot's twins are there."""
        return [
            levels
            for levels in self.combinations()
            if self._robot(str(levels["mismatch"]), folder).is_finished
        ]

    def _tests(self, folder: Path) -> list[PolicyTest]:
        tests = []
        for levels in self._ready(folder):
            training = self.treatment(levels, folder)
            robot = self._robot(str(levels["mismatch"]), folder).robot
            for result in finished([training], self.options.seeds, folder):
                count = range(self.validation_episodes)
                tests.append(
                    PolicyTest(
                        _test_path(folder, levels, result.seed),
                        str(result.folder / "policy.npz"),
                        robot,
                        _STATION,
                        tuple(
                            seed_for(result.seed, Purpose.VALIDATION, i) for i in count
                        ),
                    )
                )
        return tests

    def tables(self, folder: Path) -> list[Table]:
        """Returns what was found of each robot, success there, and who gains what."""
        return [
            self._found(folder),
            self._by_branch("Episodes on the robot that succeed", folder, _success),
            self._by_branch("Mean episodic reward on the robot", folder, _reward),
            self._gains("Reward that closing the loop adds", folder, "performance"),
            self._gains("Success that closing the loop adds", folder, "success"),
        ]

    def _found(self, folder: Path) -> Table:
        rows = []
        for name in map(str, self.levels["mismatch"]):
            robot = self._robot(name, folder)
            if robot.is_finished:
                sentence, values = robot.found
                text = MISMATCHES[name].text
                rows.append([name, text, ", ".join(values) or "nothing", sentence])
        columns = ["mismatch", "what is there", "what is found", "verdict"]
        return Table("The robots, and what closing the loop finds", columns, rows)

    def _by_branch(
        self, title: str, folder: Path, cell: Callable[[list[dict[str, Any]]], str]
    ) -> Table:
        rows = []
        for mismatch in self.levels["mismatch"]:
            for agent in self.levels["agent"]:
                levels = {"mismatch": mismatch, "agent": agent}
                cells = [
                    cell(list(self._results(levels | {"branch": b}, folder).values()))
                    for b in self.levels["branch"]
                ]
                rows.append([str(mismatch), str(agent), *cells])
        columns = ["mismatch", "agent", *map(str, self.levels["branch"])]
        note = "; ".join(f"{name}: {text}" for name, text in _BRANCHES.items())
        return Table(title, columns, rows, note)

    def _gains(self, title: str, folder: Path, figure: str) -> Table:
        others = [b for b in self.levels["branch"] if b != _CLOSED]
        rows = []
        for mismatch in self.levels["mismatch"]:
            for agent in self.levels["agent"]:
                levels = {"mismatch": mismatch, "agent": agent}
                own = self._figures(levels | {"branch": _CLOSED}, folder, figure)
                cells = [
                    paired_difference(
                        own, self._figures(levels | {"branch": b}, folder, figure)
                    )
                    for b in others
                ]
                rows.append([str(mismatch), str(agent), *cells])
        columns = ["mismatch", "agent", *(f"against {name}" for name in others)]
        note = (
            "Mean of the differences seed by seed, and its 95 % interval by Student's "
            "t; the number of pairs in brackets."
        )
        return Table(title, columns, rows, note)

    def _figures(
        self, levels: dict[str, Level], folder: Path, figure: str
    ) -> dict[int, float]:
        return {
            seed: test["successes"] / test["episodes"]
            if figure == "success"
            else test[figure]
            for seed, test in self._results(levels, folder).items()
        }

    def _results(
        self, levels: dict[str, Level], folder: Path
    ) -> dict[int, dict[str, Any]]:
        """Returns the figures on the robot of the seeds that are finished."""
        found = {
            seed: read_test(_test_path(folder, levels, seed))
            for seed in self.options.seeds
        }
        return {seed: test for seed, test in found.items() if test is not None}


def _test_path(folder: Path, levels: dict[str, Level], seed: int) -> Path:
    own = f"{levels['agent']}__{levels['branch']}"
    return folder / "tests" / str(levels["mismatch"]) / own / f"seed_{seed:03d}.json"


def _success(tests: list[dict[str, Any]]) -> str:
    successes, episodes = (sum(t[k] for t in tests) for k in ("successes", "episodes"))
    return rate(int(successes), int(episodes))


def _reward(tests: list[dict[str, Any]]) -> str:
    if not tests:
        return "-"
    return f"{sum(t['performance'] for t in tests) / len(tests):.1f}"

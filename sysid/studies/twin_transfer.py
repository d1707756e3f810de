"""Is a policy better for the loop having been closed? (thesis, table 4.3, and beyond)

A robot differs from its twin in one way or another (`mismatches`). Agents are trained
on twins that know more or less of it (_BRANCHES), and act on the robot without having
seen it; then they go on learning there, if that is wanted, beside one that comes from
no twin. The cell stands for the robot, and is simulated, too::

    folder/
      robots/MISMATCH/                 a log of the robot, and twins from it
      mismatch_M__agent_A__branch_B/   trainings on a twin; "any" for a common one
      accepted/MISMATCH/AGENT__BRANCH/ what the corrected twin says, a file per seed
      tests/MISMATCH/AGENT__BRANCH/    greedy episodes on the robot, a file per seed
      robot__mismatch_M__.../          with --robot-episodes: learning there
"""

import dataclasses
import functools
import itertools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar, Literal

from drake_disasm.learning.experiment import read_result, seed_folder
from drake_disasm.learning.hyperparameters import Hyperparameters, override
from drake_disasm.learning.learning_curve import plot_learning_curves
from drake_disasm.learning.random_numbers import Purpose, seed_for
from drake_disasm.learning.run import read_episodes
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.scenario.schema import Range
from sysid.acceptance import DRAWS
from sysid.studies.branch_tables import (
    BranchTables,
    first_success_cell,
    performance,
    performance_cell,
    success_cell,
    success_share,
)
from sysid.studies.closed_twin import ClosedTwin, with_effects
from sysid.studies.mismatches import MISMATCHES
from sysid.studies.policy_acceptance import PolicyAcceptance, read_acceptance
from sysid.studies.runner import SeedResult, finished, read_test
from sysid.studies.study import (
    Factor,
    Level,
    Picture,
    PolicyTest,
    Stage,
    Study,
    Table,
    Treatment,
    agent_config,
    folder_name,
)

_SCENARIO = "chapter3"
_STATION = "cell"  # which stands for the robot
_LOG_SEED = 500_000  # not one of any training
#: What lets an agent without a base policy learn: with the thesis's numbers alone DDPG
#: seldom does (docs/explanation/learning.md).
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
#: Share of each batch on the robot that comes from the twin's replay memory: without it
#: the new memory is so narrow that the agent unlearns.
_REHEARSAL = 0.5
_UNTRAINED, _NOMINAL, _WIDE_NAME, _CLOSED = "untrained", "nominal", "wide", "closed"
#: What a twin knows of the robot, and where; those not made from a log serve them all.
_BRANCHES = {
    _UNTRAINED: "no twin: it learns on the robot alone",
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
    # The thesis's DDPG takes up to 225 where a groove is rolled, 262 against a chain.
    seeds, episodes, validation = 10, 300, 2
    has_robot = True
    time_budget: ClassVar[float] = 1200.0  # s, of closing the loop
    draws: ClassVar[int] = DRAWS  # over a verdict's intervals, of each policy

    def stages(self, folder: Path) -> Iterator[Stage]:
        """Yields the robots' logs and twins, trainings, tests, trainings there."""
        robots = [self._robot(str(name), folder) for name in self.levels["mismatch"]]
        yield Stage(preparations=robots)
        yield Stage(self._trainings(folder), self.options.seeds)
        yield Stage(preparations=self._acceptances(folder))
        yield Stage(tests=self._tests(folder))
        if self.options.robot_episodes:
            there = [
                self._treatment_there(each, folder) for each in self._ready(folder)
            ]
            yield Stage(there, self.options.seeds)

    def _robot(self, mismatch: str, folder: Path) -> ClosedTwin:
        nominal = self._nominal
        return ClosedTwin(
            folder=folder / "robots" / mismatch,
            nominal=nominal,
            robot=with_effects(nominal, MISMATCHES[mismatch].effects),
            station=_STATION,
            seed=_LOG_SEED,
            time_budget=self.time_budget,
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
        found = self._robot(mismatch, folder).twin(str(branch))
        # Robots may be of a study with another reward, on which no log depends.
        return dataclasses.replace(found, task=nominal.task)

    def treatment(self, levels: dict[str, Level], folder: Path) -> Treatment:
        """See Study."""
        config, preset_name = self._agent(str(levels["agent"]))
        experiment = self.experiment(_SCENARIO, config, preset_name)
        # One episode on its own twin: it is judged on the robots.
        experiment = dataclasses.replace(
            experiment, scenario=self._twin(levels, folder), validation=1
        )
        return Treatment(_name_on_twin(levels), levels, experiment)

    def _treatment_there(self, levels: dict[str, Level], folder: Path) -> Treatment:
        """Returns the training on the robot that follows one on a twin, or none."""
        is_first = levels["branch"] == _UNTRAINED
        start = "" if is_first else str(folder / _name_on_twin(levels))
        config, preset_name = self._agent(str(levels["agent"]))
        experiment = self.experiment(_SCENARIO, config, preset_name)
        there = dataclasses.replace(
            experiment.config,
            episodes=self.options.robot_episodes,
            demonstrations=0.0 if is_first else _REHEARSAL,
        )
        experiment = dataclasses.replace(
            experiment,
            scenario=self._robot(str(levels["mismatch"]), folder).robot,
            station=_STATION,
            config=there,
            start=start,
            lockstep=False,  # a batch has no arm
        )
        return Treatment(_name_there(levels), levels, experiment)

    def _agent(self, name: str) -> tuple[Hyperparameters, str]:
        algorithm, _, is_normalised = name.partition("_")
        config, preset_name = agent_config(algorithm, _SCENARIO)
        return override(config, _LAYER_NORM if is_normalised else ()), preset_name

    def _trainings(self, folder: Path) -> list[Treatment]:
        """Returns each training once: some twins are the same for all robots."""
        every = [self.treatment(each, folder) for each in self._from_twins(folder)]
        return list({each.folder: each for each in every}.values())

    def _ready(self, folder: Path) -> list[dict[str, Level]]:
        """Returns the combinations whose robot's twins are there."""
        return [
            levels
            for levels in self.combinations()
            if self._robot(str(levels["mismatch"]), folder).is_finished
        ]

    def _from_twins(self, folder: Path) -> list[dict[str, Level]]:
        """Returns those of them whose agents are trained on a twin."""
        return [each for each in self._ready(folder) if each["branch"] != _UNTRAINED]

    def _trained(
        self, folder: Path
    ) -> Iterator[tuple[dict[str, Level], ClosedTwin, SeedResult]]:
        """Yields each policy from a twin with its levels, for each robot in turn."""
        for levels in self._from_twins(folder):
            training = self.treatment(levels, folder)
            robot = self._robot(str(levels["mismatch"]), folder)
            for result in finished([training], self.options.seeds, folder):
                yield levels, robot, result

    def _acceptances(self, folder: Path) -> list[PolicyAcceptance]:
        return [
            PolicyAcceptance(
                file_of("accepted", folder, levels, result.seed),
                result.folder / "policy.npz",
                robot.folder,
                self._nominal.task,
                self.draws,
            )
            for levels, robot, result in self._trained(folder)
        ]

    def _tests(self, folder: Path) -> list[PolicyTest]:
        count = range(self.validation_episodes)
        return [
            PolicyTest(
                file_of("tests", folder, levels, result.seed),
                str(result.folder / "policy.npz"),
                robot.robot,
                _STATION,
                tuple(seed_for(result.seed, Purpose.VALIDATION, i) for i in count),
            )
            for levels, robot, result in self._trained(folder)
        ]

    def tables(self, folder: Path) -> list[Table]:
        """Returns what was found of each robot, what is done there, and who gains."""
        make = BranchTables(self.levels, _BRANCHES, _CLOSED)
        new = functools.partial(self._arrived, folder=folder)
        found = [
            self._found(folder),
            make.by_branch("Episodes on the robot that succeed", new, success_cell),
            make.by_branch(
                "The same, of policies that the corrected twin accepts",
                functools.partial(self._accepted, folder=folder),
                success_cell,
            ),
            make.by_branch("Mean episodic reward on the robot", new, performance_cell),
            make.gains("Reward that closing the loop adds", new, performance),
            make.gains("Success that closing the loop adds", new, success_share),
        ]
        if not self.options.robot_episodes:
            return found
        learned = functools.partial(self._learned, folder=folder)
        return [
            *found,
            make.by_branch("P, learning on the robot", learned, performance_cell),
            make.by_branch("Success, learning on the robot", learned, success_cell),
            make.by_branch("First success of each seed", learned, first_success_cell),
            make.gains("P that closing the loop adds", learned, performance),
        ]

    def pictures(self, folder: Path) -> list[Picture]:
        """Returns how agents learn on the robot, by where they come from."""
        if not self.options.robot_episodes:
            return []
        found = []
        for mismatch, agent in itertools.product(
            self.levels["mismatch"], self.levels["agent"]
        ):
            levels = {"mismatch": mismatch, "agent": agent}
            curves = self._curves(levels, folder)
            if curves:
                found.append(
                    Picture(
                        f"Learning on the robot: {mismatch}, {agent}",
                        f"robot_{mismatch}_{agent}.png",
                        functools.partial(plot_learning_curves, curves),
                    )
                )
        return found

    def _curves(
        self, levels: dict[str, Level], folder: Path
    ) -> dict[str, list[list[dict[str, float]]]]:
        """Returns the episodes of each branch's seeds that have learned."""
        found = {}
        for branch in self.levels["branch"]:
            learned = self._finished_there(levels | {"branch": branch}, folder)
            if learned:
                paths = [own / "episodes.csv" for own in learned.values()]
                found[str(branch)] = list(map(read_episodes, paths))
        return found

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

    def _arrived(
        self, levels: dict[str, Level], folder: Path
    ) -> dict[int, dict[str, Any]]:
        """Returns the figures on arrival at the robot of the seeds that are tested."""
        found = {
            seed: read_test(file_of("tests", folder, levels, seed))
            for seed in self.options.seeds
        }
        return {seed: test for seed, test in found.items() if test is not None}

    def _accepted(
        self, levels: dict[str, Level], folder: Path
    ) -> dict[int, dict[str, Any]]:
        """Returns the same of those that the corrected twin accepts."""
        arrived = self._arrived(levels, folder)
        said = {
            seed: read_acceptance(file_of("accepted", folder, levels, seed))
            for seed in arrived
        }
        return {s: arrived[s] for s, own in said.items() if own and own["accepted"]}

    def _learned(
        self, levels: dict[str, Level], folder: Path
    ) -> dict[int, dict[str, Any]]:
        """Returns the figures of learning on the robot of the seeds that have."""
        found = {}
        for seed, own in self._finished_there(levels, folder).items():
            result = _result(own)
            first = {"first_success": result["first_success"]}
            found[seed] = result["training"] | first
        return found

    def _finished_there(
        self, levels: dict[str, Level], folder: Path
    ) -> dict[int, Path]:
        """Returns the folders of the seeds that have learned on the robot."""
        own = folder / _name_there(levels)
        folders = {seed: seed_folder(own, seed) for seed in self.options.seeds}
        return {s: f for s, f in folders.items() if (f / "result.json").exists()}


def _name_on_twin(levels: dict[str, Level]) -> str:
    """Returns the folder of a training on a twin, which may serve all robots."""
    is_common = levels["branch"] in _COMMON
    return folder_name(levels | ({"mismatch": "any"} if is_common else {}))


def _name_there(levels: dict[str, Level]) -> str:
    """Returns the folder of the training on the robot."""
    return f"robot__{folder_name(levels)}"


def _result(seed: Path) -> dict[str, Any]:
    """Returns the figures of one seed of a training, by its folder."""
    return read_result(seed / "result.json", online=True)


def file_of(
    kind: Literal["accepted", "tests"],
    folder: Path,
    levels: Mapping[str, Level],
    seed: int,
) -> Path:
    """Returns the file with what a corrected twin, or a robot, says of a policy.

    Args:
        kind: whose word it is.
        folder: of the study.
        levels: of the policy's training, and the robot that it meets.
        seed: of the training.
    """
    treatment = f"{levels['agent']}__{levels['branch']}"
    name = f"seed_{seed:03d}.json"
    return folder / kind / str(levels["mismatch"]) / treatment / name

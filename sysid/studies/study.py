"""What a study is: factors, their levels, replications, and what is measured.

A study is a module that says so, and makes tables of what was measured; `runner.py`
does the work, `report.py` writes it down. A study's folder::

    study.json                     what is studied, and by which command
    TREATMENT/                     one combination of levels: a training of all seeds
                                   (see learning/experiment.py)
    TREATMENT/seed_000/tests/      greedy episodes of its policy elsewhere
    results.csv, tests.csv         a row for each seed of each treatment, each test
    report.md, report.html, *.png
"""

import abc
import dataclasses
import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Protocol

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.progress import Progress
from drake_disasm.common.quantity import closest
from drake_disasm.learning.experiment import Experiment
from drake_disasm.learning.hyperparameters import Hyperparameters, override, preset
from drake_disasm.scenario import Scenario, load_scenario

Level = float | str


@dataclasses.dataclass(frozen=True)
class Factor:
    """What is varied.

    Attributes:
        name: in folders, options and columns.
        unit: of its levels.
        levels: those of the whole study.
    """

    name: str
    unit: str
    levels: tuple[Level, ...]

    @property
    def heading(self) -> str:
        """Its name with its unit, for tables."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def chosen(self, texts: Sequence[str]) -> tuple[Level, ...]:
        """Returns some of the levels.

        Args:
            texts: of the levels, as the user writes them.

        Raises:
            DisasmError: one is none of the levels.
        """
        known = {level_text(level): level for level in self.levels}
        for text in texts:
            if text not in known:
                raise DisasmError(
                    f"level {self.name}={text}: is not studied; "
                    f"{closest(text, list(known))}"
                )
        return tuple(level for text, level in known.items() if text in texts)


def level_text(level: Level) -> str:
    """Returns a level as users write it."""
    return level if isinstance(level, str) else f"{level:g}"


@dataclasses.dataclass(frozen=True)
class Treatment:
    """One combination of levels, and the training that it means.

    Attributes:
        folder: name within the study's folder.
        levels: by the factor's name.
        experiment: of all seeds.
    """

    folder: str
    levels: Mapping[str, Level]
    experiment: Experiment


@dataclasses.dataclass(frozen=True)
class PolicyTest:
    """Greedy episodes of a policy, as one job.

    Attributes:
        path: of the JSON file with its figures (`Evaluation`).
        policy: name of a scripted or shipped one, or an .npz file.
        scenario, station: where it acts.
        seeds: of the episodes.
    """

    path: Path
    policy: str
    scenario: Scenario
    station: str
    seeds: tuple[int, ...]


class Preparation(Protocol):
    """Work of a kind of its own, as one job that other processes can be sent."""

    @property
    def is_finished(self) -> bool:
        """Whether its result is there."""

    def __call__(self, progress: Progress) -> None:
        """Does it, and writes its result last."""


@dataclasses.dataclass(frozen=True)
class Stage:
    """Work that needs nothing but what stages before it have left.

    Attributes:
        treatments: to be trained.
        seeds: of each.
        tests: after that.
        preparations: before it.
    """

    treatments: Sequence[Treatment] = ()
    seeds: Sequence[int] = ()
    tests: Sequence[PolicyTest] = ()
    preparations: Sequence[Preparation] = ()


@dataclasses.dataclass(frozen=True)
class StudyOptions:
    """What the user chooses of a study; everything else it says itself.

    Attributes:
        seeds: replications of each treatment.
        levels: of some factors, by name; others have all theirs.
        episodes: of each training; None for the study's number.
        validation: greedy episodes of each policy; None for the study's number.
        robot_episodes: of learning on the robot after that on a twin; 0 for none.
        changes: of hyper-parameters, as KEY=VALUE.
        overrides: of the scenario, as KEY=VALUE.
        lockstep: whether trainings run side by side on batches of twins.
        compiled: whether updates are compiled.
        compare: file of somebody else's results to show beside ours, or None.
        provenance: command, date, versions, commit.
    """

    seeds: tuple[int, ...]
    levels: Mapping[str, Sequence[str]] = dataclasses.field(default_factory=dict)
    episodes: int | None = None
    validation: int | None = None
    robot_episodes: int = 0
    changes: tuple[str, ...] = ()
    overrides: tuple[str, ...] = ()
    lockstep: bool = True
    compiled: bool = True
    compare: Path | None = None
    provenance: dict[str, Any] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True)
class Table:
    """A table of a report.

    Attributes:
        title: above it.
        columns: headings.
        rows: texts.
        note: below it.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""

    @property
    def kinds(self) -> list[str]:
        """What each column is of: "words", or "numbers"."""
        return [
            "words" if any(cell[:1].isalpha() for cell in column) else "numbers"
            for column in zip(*(self.rows or [self.columns]), strict=True)
        ]


@dataclasses.dataclass(frozen=True)
class Picture:
    """A figure of a report.

    Attributes:
        title: above it.
        name: of the file.
        draw: writes the file.
    """

    title: str
    name: str
    draw: Callable[[Path], None]


class Study(abc.ABC):
    """One of the studies.

    Attributes:
        name: by which it is started.
        question: that it answers.
        source: in the thesis, or elsewhere.
        factors: and all their levels.
        seeds, episodes, validation: of the whole study.
        has_robot: whether agents can go on learning on what stands for a robot.

    Args:
        options: what the user chooses.

    Raises:
        DisasmError: a level or a factor that is not studied, or learning on a robot
            where there is none.
    """

    name: ClassVar[str]
    question: ClassVar[str]
    source: ClassVar[str]
    factors: ClassVar[tuple[Factor, ...]]
    seeds: ClassVar[int]
    episodes: ClassVar[int]
    validation: ClassVar[int] = 10
    has_robot: ClassVar[bool] = False

    def __init__(self, options: StudyOptions) -> None:
        self.options = options
        if options.robot_episodes and not self.has_robot:
            raise DisasmError(
                f"robot_episodes: there is no robot in study '{self.name}'; leave "
                "`robot_episodes` out"
            )
        known = [factor.name for factor in self.factors]
        for name in options.levels:
            if name not in known:
                raise DisasmError(
                    f"factor {name}: is not one of study '{self.name}'; "
                    f"{closest(name, known)}"
                )
        self.levels = {
            f.name: f.chosen(options.levels[f.name])
            if f.name in options.levels
            else f.levels
            for f in self.factors
        }

    @abc.abstractmethod
    def treatment(self, levels: dict[str, Level], folder: Path) -> Treatment:
        """Returns what a combination of levels means, in a study's folder."""

    @abc.abstractmethod
    def stages(self, folder: Path) -> Iterator[Stage]:
        """Yields the work, stage by stage; each sees what those before have left."""

    @abc.abstractmethod
    def tables(self, folder: Path) -> list[Table]:
        """Returns what was found, of all that is finished."""

    def pictures(self, folder: Path) -> list[Picture]:
        """Returns what is to be drawn, of all that is finished."""
        return []

    def combinations(self) -> list[dict[str, Level]]:
        """Returns all combinations of the chosen levels."""
        values = itertools.product(*self.levels.values())
        return [dict(zip(self.levels, each, strict=True)) for each in values]

    def treatments(self, folder: Path) -> list[Treatment]:
        """Returns the treatments of all combinations of the chosen levels."""
        return [self.treatment(levels, folder) for levels in self.combinations()]

    def of_agent(self, levels: dict[str, Level], chapter: str) -> Treatment:
        """Returns the training of the agent "agent" at the imprecision "psi".

        Args:
            levels: of those two factors.
            chapter: scenario, and preset of all agents but "best".
        """
        config, preset_name = agent_config(str(levels["agent"]), chapter)
        psi = [f"imprecision={levels['psi']}"]
        experiment = self.experiment(chapter, config, preset_name, psi)
        return Treatment(folder_name(levels), levels, experiment)

    def experiment(
        self,
        scenario: str,
        config: Hyperparameters,
        preset_name: str,
        overrides: Iterable[str] = (),
    ) -> Experiment:
        """Returns a training on the twin, with what the user chooses.

        Args:
            scenario: its name.
            config: hyper-parameters, `preset_name` what they started from.
            overrides: of the scenario.
        """
        options = self.options
        episodes = f"episodes={options.episodes or self.episodes}"
        return Experiment(
            scenario=load_scenario(scenario, [*overrides, *options.overrides]),
            station="twin",
            preset=preset_name,
            config=override(config, [episodes, *options.changes]),
            compiled=options.compiled,
            validation=self.validation_episodes,
            lockstep=options.lockstep,
            provenance=options.provenance,
        )

    @property
    def validation_episodes(self) -> int:
        """Greedy episodes of each policy."""
        return self.options.validation or self.validation


def folder_name(levels: Mapping[str, Level]) -> str:
    """Returns the name of a treatment's folder."""
    return "__".join(f"{name}_{level_text(level)}" for name, level in levels.items())


#: Agents that studies compare: what each is, and its preset if it has its own.
AGENTS = ("ddpg", "td3", "sac", "best")


def agent_config(agent: str, chapter: str) -> tuple[Hyperparameters, str]:
    """Returns hyper-parameters of an agent and the name of their preset.

    Args:
        agent: one of AGENTS; "best" is SAC that corrects `admittance`.
        chapter: preset of the others.
    """
    if agent == "best":
        return preset("best"), "best"
    return preset(chapter, agent), chapter

"""Twins made from a log of the robot: identified, and with the loop closed."""

import dataclasses
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import make_folder, read_json, write_json, write_text
from drake_disasm.common.progress import Progress
from drake_disasm.effects import Effect
from drake_disasm.logs import Log, read_log
from drake_disasm.policies import Exploring, make_policy
from drake_disasm.scenario import Scenario, dump_scenario, load_scenario
from drake_disasm.task.recording import record_transitions
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm.twin.batch import with_impact
from sysid.acceptance.corrected_twin import refused_verdict, with_intervals
from sysid.effect_selection.close_loop import close_loop
from sysid.effect_selection.output import to_mapping
from sysid.identification.identify import identify
from sysid.identification.settings import SearchSettings, Settings
from sysid.models.from_logs import ModelChoice, model_of
from sysid.scenario_parameters import ParameterRequest

_TRANSITIONS = 440  # of the log
_EXPLORATION = 1.5e-4  # m, of `admittance` while it is recorded
_PARAMETERS = (
    "contact.friction",
    "part.clearance",
    "contact.impact.stiffness",
    "contact.impact.exponent",
)
_EVALUATIONS = 200
_RESULT: dict[str, Any] = {"sentence": "", "provisional": False, "parameters": {}}


@dataclass(frozen=True)
class ClosedTwin:
    """Records a log of the robot, and makes twins from it.

    folder/
      log/               of the robot, `admittance` with some exploration
      identified.yaml    the nominal twin with what identification makes of the log
      intervals.yaml     the corrected twin, its values drawn from their intervals
      scenario.yaml      the corrected twin, as `drake-disasm close-loop` writes it
      result.json        its verdict, as that writes it; written last

    A log that closing the loop refuses leaves the nominal twin.

    Attributes:
        folder: for all of it.
        nominal: the twin's scenario.
        robot: the scenario of what stands for the robot, with effects that the
            nominal one lacks.
        station: that simulates it.
        seed: of the log's first episode.
        time_budget: of closing the loop [s].
    """

    folder: Path
    nominal: Scenario
    robot: Scenario
    station: str
    seed: int
    time_budget: float

    @property
    def is_finished(self) -> bool:
        """Whether the twins are there."""
        return (self.folder / "result.json").exists()

    def __call__(self, progress: Progress) -> None:
        """Makes the twins."""
        make_folder(self.folder)
        log, fits = self._recorded(progress), self.folder / "fits"
        self._write("identified", self._identified(log, progress))
        model = model_of([log], ModelChoice(scenario=self.nominal, fixed=True))
        try:
            closed = close_loop(
                model,
                progress=progress,
                folder=fits,
                time_budget=self.time_budget,
            )
        except DisasmError as error:
            scenario, result = self.nominal, refused_verdict(str(error))
        else:
            scenario, result = closed.scenario or self.nominal, to_mapping(closed)
        self._write("scenario", scenario)
        self._write("intervals", with_intervals(scenario, result["parameters"]))
        write_json(self.folder / "result.json", result)
        shutil.rmtree(fits, ignore_errors=True)

    def twin(self, name: str) -> Scenario:
        """Returns one of the twins: "identified", "closed" or "intervals"."""
        file = "scenario" if name == "closed" else name
        return load_scenario(str(self.folder / f"{file}.yaml"))

    @property
    def found(self) -> tuple[str, list[str]]:
        """The verdict's sentence, and each parameter with its 95 % interval."""
        result = read_json(
            self.folder / "result.json", "delete it, and resume the study", _RESULT
        )
        form = "{} {value:.4g} ({interval_95[0]:.4g} to {interval_95[1]:.4g})"
        values = [form.format(n, **own) for n, own in result["parameters"].items()]
        provisional = "provisional: " if result["provisional"] else ""
        return f"{provisional}{result['sentence']}", values

    def _recorded(self, progress: Progress) -> Log:
        folder, marker = self.folder / "log", self.folder / "recorded"
        if not marker.exists():
            base = make_policy("admittance", self.robot)
            policy = Exploring(base, _EXPLORATION, self.seed)
            simulation = TaskSimulation(self.robot, self.station, policy)
            record_transitions(folder, simulation, _TRANSITIONS, self.seed, progress)
            marker.touch()
        return read_log(folder)

    def _identified(self, log: Log, progress: Progress) -> Scenario:
        """Returns the nominal twin with its parameters fitted to the log."""
        requests = tuple(ParameterRequest(name) for name in _PARAMETERS)
        choice = ModelChoice(scenario=with_impact(self.nominal), requests=requests)
        settings = Settings(
            search=SearchSettings(evaluations=_EVALUATIONS), unidentifiable="freeze"
        )
        found = identify(model_of([log], choice), settings=settings, progress=progress)
        return found.model.scenario_at(found.theta) or self.nominal

    def _write(self, name: str, scenario: Scenario) -> None:
        write_text(self.folder / f"{name}.yaml", dump_scenario(scenario))


def with_effects(scenario: Scenario, effects: tuple[Effect, ...]) -> Scenario:
    """Returns a scenario with further effects."""
    return dataclasses.replace(scenario, effects=[*scenario.effects, *effects])

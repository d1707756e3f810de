"""A station in contact, and the log of the experiments on it."""

from pathlib import Path
from typing import Any

from drake_disasm.common.progress import Progress, ignore_progress
from drake_disasm.experiments import Plan
from drake_disasm.experiments.performing import Laboratory, Performance
from drake_disasm.logs import read_log
from drake_disasm.logs.columns import flat_columns
from drake_disasm.safety import SafetyConfig
from drake_disasm.scenario import Scenario, scenario_to_mapping
from drake_disasm.task.recording import EpisodeRecorder, transitions_header
from drake_disasm.task.simulation import StationFactory
from drake_disasm.visualization import MeshcatView
from sysid.diagnosis.experiment_log import ExperimentLog
from sysid.models.base import LogModel
from sysid.models.from_logs import ModelChoice, model_of


class GrowingLog(ExperimentLog):
    """A station, and the log of what was performed on it.

    Args:
        scenario: that the log states.
        folder: of the log; episodes that are there already are kept.
        station: "cell", "twin", or what makes the hardware's.
        real: scenario of a simulated station; the stated one if left out.
        progress: gets each step.
        view: shows each experiment; if it records, a page of each is kept in the
            folder `meshcat` beside that of the log.
        seed: of the first episode's noise; of each later one it is one more.
    """

    def __init__(
        self,
        scenario: Scenario,
        folder: Path,
        station: str | StationFactory = "cell",
        real: Scenario | None = None,
        progress: Progress = ignore_progress,
        view: MeshcatView | None = None,
        seed: int = 0,
    ) -> None:
        self.seed = seed
        self._scenario, self._folder = scenario, folder
        self._view, views = view, [view] if view else []
        self._real = scenario_to_mapping(real or scenario)
        self._laboratory = Laboratory(real or scenario, station, views)
        kind = self._laboratory.station.kind
        header = transitions_header(scenario, kind, {"program": "diagnose"})
        super().__init__(folder, header, progress)

    @property
    def reality(self) -> dict[str, Any]:
        """What experiments are performed on: plain data, of a simulation all of it."""
        kind = self._laboratory.station.kind
        return {"station": kind, "scenario": self._real if kind != "hardware" else None}

    @property
    def limits(self) -> SafetyConfig | None:
        """At which the station holds; None for a simulated one."""
        return self._laboratory.limits

    def refuse_hold(self) -> None:
        """Raises HoldError while the station holds."""
        self._laboratory.station.check()

    def perform(self, plan: Plan) -> Performance:
        """Performs an experiment; what was recorded is kept if the station holds."""
        if self._view is None:
            return self._recorded(plan)
        page = self._folder.parent / "meshcat" / f"episode_{self.episodes:04d}.html"
        self._view.begin_episode()
        found = self._recorded(plan)
        self._view.end_episode()
        if self._view.records:
            self._view.save_html(page)
        return found

    def _recorded(self, plan: Plan) -> Performance:
        """Performs an experiment, which becomes an episode."""
        seed, laboratory = self.seed + self.episodes, self._laboratory
        if laboratory.station.kind == "hardware":
            with self._writer.begin_episode() as episode:
                recorder = EpisodeRecorder(laboratory.simulation, episode)
                return laboratory.perform(plan, seed, recorder, self._progress)
        recorder = EpisodeRecorder(laboratory.simulation)
        found = laboratory.perform(plan, seed, recorder, self._progress)
        self._writer.write_episode(flat_columns("transitions", recorder.columns()))
        return found

    def model(self, scenario: Scenario | None = None) -> LogModel:
        """Returns the model of the log so far, with the effects of a scenario.

        Args:
            scenario: of the model; the stated one if left out.
        """
        choice = ModelChoice(scenario=scenario or self._scenario, fixed=True)
        return model_of([read_log(self._folder)], choice)

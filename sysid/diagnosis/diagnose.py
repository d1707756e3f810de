"""What a scenario's model lacks, by experiments on a station."""

from collections.abc import Sequence
from pathlib import Path

from drake_disasm.common.progress import Progress, ignore_progress
from drake_disasm.effects import Effect
from drake_disasm.experiments import Experiment
from drake_disasm.scenario import Scenario
from drake_disasm.task.simulation import StationFactory
from drake_disasm.visualization import MeshcatView
from sysid.diagnosis.growing_log import GrowingLog
from sysid.diagnosis.loop import DEFAULT_BUDGET, Budget, Confirm, Diagnosis, pursue
from sysid.diagnosis.station_subject import StationSubject
from sysid.workers import Workers


def diagnose(
    scenario: Scenario,
    folder: Path,
    *,
    station: str | StationFactory = "cell",
    real: Scenario | None = None,
    budget: Budget = DEFAULT_BUDGET,
    experiments: Sequence[type[Experiment]] | None = None,
    effects: Sequence[type[Effect]] | None = None,
    confirm: Confirm = lambda _: True,
    view: MeshcatView | None = None,
    seed: int = 0,
    workers: Workers | None = None,
    progress: Progress = ignore_progress,
) -> Diagnosis:
    """Finds out what a scenario's model lacks, by experiments on a station.

    Records some removals, asks for the verdict, performs the experiment that separates
    best what the verdict leaves, adds it to the log, and asks again, until one
    hypothesis is left, no experiment would help, or the budget is spent. The same call
    goes on where it was stopped.

    Args:
        scenario: of the model, which the log states.
        folder: of the log, the fits and `diagnosis.json`.
        station: "cell", "twin", or what makes the hardware's.
        real: scenario of a simulated station; the model's if left out.
        budget: after which no experiment begins.
        experiments: to choose from; all registered ones if left out.
        effects: that may be named; all registered ones if left out.
        confirm: is asked before each experiment.
        view: shows the station, see GrowingLog.
        seed: of noise, see GrowingLog.
        workers: fit.
        progress: gets each step.

    Raises:
        DisasmError: the budget is too small for a first recording, the folder holds
            another scenario's, or what close_loop and the station raise.
    """
    log = GrowingLog(
        scenario, folder / "log", station, real or scenario, progress, view, seed
    )
    subject = StationSubject(scenario, log, experiments, effects, progress)
    return pursue(subject, folder, budget, confirm, workers or Workers())

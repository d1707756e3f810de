"""A station in contact, as what is diagnosed."""

from collections.abc import Collection, Mapping, Sequence
from functools import partial
from pathlib import Path

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.progress import Progress, ignore_progress
from drake_disasm.effects import Effect
from drake_disasm.experiments import (
    Experiment,
    LoadedStrokes,
    Plan,
    Presses,
    Removal,
    SlowApproach,
    Weighing,
    registered_experiments,
)
from drake_disasm.safety import SafetyConfig
from drake_disasm.scenario import Scenario, scenario_to_mapping
from sysid.diagnosis.design import Prediction, predict
from sysid.diagnosis.growing_log import GrowingLog
from sysid.diagnosis.in_contact import twin_forecasts
from sysid.diagnosis.rivals import (
    NOTHING,
    Need,
    Rival,
    TwinRival,
    open_rivals,
    twin_rival,
    unseen_rivals,
)
from sysid.diagnosis.subject import Subject
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.workers import Workers

# Before the first verdict: each for something else. Weighing begins with the only
# removal: led by what the sensor reads, that jams the bolt where the reading is wrong,
# and there a twin errs.
_FIRST = (
    Weighing(angle=0.1),
    LoadedStrokes(way=0.1),
    Presses(axis="z", places=1),
    Presses(axis="y", places=1),
    SlowApproach(speed=0.3),
)


def first_plans(
    scenario: Scenario,
    limits: SafetyConfig | None = None,
    progress: Progress = ignore_progress,
) -> list[Plan]:
    """Returns what is performed before the first verdict.

    Args:
        scenario: of the model.
        limits: at which the station holds, if it does.
        progress: gets each simulation.

    Raises:
        DisasmError: none of it is safe where nothing is hidden.
    """
    every = [each.plan(scenario) for each in _FIRST]
    plans = [plan for plan in every if plan.phases]
    alone = [TwinRival(NOTHING, 1.0, 0.0, scenario)]
    known = twin_forecasts(plans, alone, limits, progress)
    pairs = zip(plans, known, strict=True)
    safe = [plan for plan, forecast in pairs if not forecast.hazard]
    if not safe:
        raise DisasmError(f"no experiment is safe: {known[0].hazard}")
    return safe


class StationSubject(Subject):
    """A station on which the bolt is in contact; see `diagnose` for the arguments."""

    def __init__(
        self,
        scenario: Scenario,
        log: GrowingLog,
        experiments: Sequence[type[Experiment]] | None,
        effects: Sequence[type[Effect]] | None,
        progress: Progress,
    ) -> None:
        super().__init__(log, effects, {"scenario": scenario_to_mapping(scenario)})
        self._scenario, self._log = scenario, log
        kinds = registered_experiments() if experiments is None else experiments
        self._kinds, self._progress = kinds, progress
        self._first = first_plans(scenario, log.limits, progress)

    def first(self) -> list[Plan]:
        """See Subject."""
        return self._first

    def plans(self) -> list[Plan]:
        """See Subject: all that the scenario has anything to do with."""
        first = {plan.text for plan in self._first}
        kinds = [kind for kind in self._kinds if kind is not Removal]
        plans = [e.plan(self._scenario) for kind in kinds for e in kind.variants()]
        return [plan for plan in plans if plan.phases and plan.text not in first]

    def most(self, plan: Plan) -> float:
        """See Subject."""
        return plan.most_steps * plan.period

    def rivals(
        self,
        closed: ClosedLoop,
        workers: Workers,
        fits: Path | None,
        asked: Sequence[tuple[str, ...]],
    ) -> tuple[Rival, ...]:
        """See Subject."""
        model = self._log.model()
        left = open_rivals(closed, model, twin_rival, workers, fits, asked)
        return left or unseen_rivals(closed, self._log, workers, fits)

    def predict(
        self,
        plans: Sequence[Plan],
        rivals: Sequence[Rival],
        need: Need,
        trust: Mapping[str, float],
        done: Collection[str],
    ) -> list[Prediction]:
        """See Subject."""
        forecasts = partial(
            twin_forecasts, limits=self._log.limits, progress=self._progress
        )
        return predict(plans, rivals, need, forecasts, trust)

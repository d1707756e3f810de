"""A station in contact, as what is diagnosed."""

from collections.abc import Collection, Mapping, Sequence
from functools import partial
from pathlib import Path

from drake_disasm.common.progress import Progress
from drake_disasm.effects import Effect
from drake_disasm.experiments import Experiment, Plan, Removal, registered_experiments
from drake_disasm.scenario import Scenario, scenario_to_mapping
from sysid.diagnosis.design import Prediction, predict
from sysid.diagnosis.growing_log import GrowingLog
from sysid.diagnosis.in_contact import forecasts_as_it_is, twin_forecasts
from sysid.diagnosis.rivals import Need, Rival, open_rivals, twin_rival
from sysid.diagnosis.subject import Subject
from sysid.diagnosis.unseen import unseen_rivals
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.workers import Workers

FIRST = 3  # removals before the first verdict


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
        stated = scenario_to_mapping(scenario)
        settings = {"scenario": stated, "reality": log.reality}
        super().__init__(log, effects, settings)
        self._scenario, self._log = scenario, log
        kinds = registered_experiments() if experiments is None else experiments
        self._kinds, self._progress = kinds, progress

    def first(self) -> list[Plan]:
        """See Subject."""
        seeds = [self._log.seed + number for number in range(FIRST)]
        return [Removal(seed=seed).plan(self._scenario) for seed in seeds]

    def foreseen(self, plans: Sequence[Plan]) -> list[tuple[float, str]]:
        """See Subject."""
        limits, progress = self._log.limits, self._progress
        found = forecasts_as_it_is(plans, self._scenario, limits, progress)
        return [(each.duration, each.hazard) for each in found]

    def plans(self) -> list[Plan]:
        """See Subject: all that the scenario has anything to do with."""
        kinds = [kind for kind in self._kinds if kind is not Removal]
        plans = [e.plan(self._scenario) for kind in kinds for e in kind.variants()]
        return [plan for plan in plans if plan.phases]

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

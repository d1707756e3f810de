"""What is diagnosed: a station in contact, or an arm in free space."""

import abc
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from drake_disasm.effects import Effect
from sysid.diagnosis.design import Prediction
from sysid.diagnosis.experiment_log import ExperimentLog
from sysid.diagnosis.rivals import Need, Rival
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.workers import Workers


class Subject(abc.ABC):
    """What is diagnosed, with the log of what was performed on it.

    Attributes:
        log: of it.
        settings: plain data; a diagnosis is taken up only with the same.

    Args:
        log: see the attributes.
        effects: that may be named; None: all registered ones.
        settings: see the attributes.
    """

    def __init__(
        self,
        log: ExperimentLog,
        effects: Sequence[type[Effect]] | None,
        settings: Mapping[str, Any],
    ) -> None:
        self.log, self._effects, self.settings = log, effects, settings

    def verdict(
        self, workers: Workers, time_budget: float, fits: Path | None
    ) -> ClosedLoop:
        """Returns the verdict on the log so far; see `ExperimentLog.verdict`."""
        return self.log.verdict(self._effects, workers, time_budget, fits)

    @abc.abstractmethod
    def first(self) -> Sequence[Any]:
        """Returns what is performed before the first verdict."""

    @abc.abstractmethod
    def foreseen(self, plans: Sequence[Any]) -> list[tuple[float, str]]:
        """Returns how long each takes [s], and why it is not safe; empty if it is.

        Under the model as it is.
        """

    @abc.abstractmethod
    def plans(self) -> Sequence[Any]:
        """Returns the experiments to choose from."""

    @abc.abstractmethod
    def rivals(
        self,
        closed: ClosedLoop,
        workers: Workers,
        fits: Path | None,
        asked: Sequence[tuple[str, ...]],
    ) -> tuple[Rival, ...]:
        """Returns the hypotheses that a verdict leaves; one alone is settled.

        Args:
            closed: the verdict.
            workers: fit.
            fits: folder of a cache of them.
            asked: names of the verdict before each experiment.
        """

    @abc.abstractmethod
    def predict(
        self,
        plans: Sequence[Any],
        rivals: Sequence[Rival],
        need: Need,
        trust: Mapping[str, float],
        done: Collection[str],
    ) -> list[Prediction]:
        """Returns how well experiments separate rivals; see `design.predict`.

        Args:
            plans: to choose from.
            rivals: at least two.
            need: how far apart they have to be.
            trust: in the distances of a class of experiments, by its name.
            done: experiments that were performed, in words.
        """

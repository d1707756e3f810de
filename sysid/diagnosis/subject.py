"""What is diagnosed: a station in contact, or an arm in free space."""

import abc
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from sysid.diagnosis.design import Prediction
from sysid.diagnosis.rivals import Need, Rival
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.workers import Workers


class Performed(Protocol):
    """What came of an experiment."""

    @property
    def duration(self) -> float:
        """Robot time [s]."""

    @property
    def greatest(self) -> tuple[float, float]:
        """Greatest force and torque [N, N m]."""

    @property
    def ended(self) -> str:
        """Why it was cut short; empty if it was performed whole."""

    @property
    def period(self) -> float:
        """Of rows that were measured [s]."""

    def channel(self, name: str) -> np.ndarray:
        """Returns what was measured in a channel (n,)."""


class Subject(abc.ABC):
    """What is diagnosed, with the log of what was performed on it.

    Attributes:
        settings: plain data; a diagnosis is taken up only with the same.
    """

    settings: Mapping[str, Any]

    @property
    @abc.abstractmethod
    def episodes(self) -> int:
        """How many the log has."""

    @abc.abstractmethod
    def first(self) -> Sequence[Any]:
        """Returns what is performed before the first verdict."""

    @abc.abstractmethod
    def plans(self) -> Sequence[Any]:
        """Returns the experiments to choose from."""

    @abc.abstractmethod
    def most(self, plan: Any) -> float:
        """Returns how long an experiment may take [s]."""

    @abc.abstractmethod
    def perform(self, plan: Any) -> Performed:
        """Performs an experiment, which becomes an episode of the log."""

    @abc.abstractmethod
    def refuse_hold(self) -> None:
        """Raises HoldError while the station holds."""

    @abc.abstractmethod
    def verdict(
        self, workers: Workers, time_budget: float, fits: Path | None
    ) -> ClosedLoop:
        """Returns the verdict on the log so far.

        Args:
            workers: fit.
            time_budget: see close_loop [s].
            fits: folder of a cache of them.
        """

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
    ) -> list[Prediction]:
        """Returns how well experiments separate rivals; see `design.predict`."""

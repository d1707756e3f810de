"""A log that grows by an episode for each experiment, and the verdict on it so far."""

import abc
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from drake_disasm.common.progress import Progress
from drake_disasm.effects import Effect
from drake_disasm.logs import LogHeader, LogWriter
from sysid.effect_selection.close_loop import ClosedLoop, close_loop
from sysid.models.base import LogModel
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


class ExperimentLog(abc.ABC):
    """What performs experiments, and the log of them.

    Args:
        folder: of what is recorded; episodes that are there already are kept.
        header: of it.
        progress: gets each step.
    """

    def __init__(self, folder: Path, header: LogHeader, progress: Progress) -> None:
        self._progress = progress
        self._writer = LogWriter(folder, header, resume=True)

    @property
    def episodes(self) -> int:
        """How many were recorded."""
        return self._writer.next_number

    @abc.abstractmethod
    def perform(self, plan: Any) -> Performed:
        """Performs an experiment; what was recorded is kept if the station holds."""

    @abc.abstractmethod
    def refuse_hold(self) -> None:
        """Raises HoldError while the station holds."""

    @abc.abstractmethod
    def model(self) -> LogModel:
        """Returns the model of the log so far."""

    def verdict(
        self,
        effects: Sequence[type[Effect]] | None = None,
        workers: Workers | None = None,
        time_budget: float = math.inf,
        fits: Path | None = None,
    ) -> ClosedLoop:
        """Returns the verdict on the log so far.

        Every episode is fitted, contiguous blocks are held out in turn: an experiment
        is made to be learned from.

        Args:
            effects: that may be named; all registered ones if left out.
            workers: fit.
            time_budget: see close_loop [s].
            fits: folder of a cache of them.
        """
        model = self.model()
        return close_loop(
            model,
            train=range(len(model.measurements.names)),
            test=(),
            library=effects,
            workers=workers,
            progress=self._progress,
            folder=fits,
            time_budget=time_budget,
        )

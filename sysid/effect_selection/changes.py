"""What has changed since reference logs, by how much, and since when."""

import dataclasses
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import ttest_ind

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.progress import Progress
from sysid.effect_selection.close_loop import ClosedLoop, close_loop
from sysid.effect_selection.onsets import onset_block
from sysid.effect_selection.verdict import ParameterValue, parameter_values
from sysid.fitting.candidates import Candidate, extended
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import DEFAULT_SETTINGS, SelectionSettings
from sysid.models.base import LogModel
from sysid.models.changed import ChangedModel
from sysid.workers import Workers

_OF_REFERENCES = 0.5  # of the time


@dataclass(frozen=True)
class Onset:
    """Where in newer logs changes begin.

    Attributes:
        episode: its name.
        row: of the episode's rows that are fitted, from 0; known to `rows`.
        rows: number of rows, from that one on, within which it is.
    """

    episode: str
    row: int
    rows: int

    @classmethod
    def of(
        cls, block: range, episode: NDArray[np.int64], names: Sequence[str]
    ) -> "Onset":
        """Returns the onset within a block of all rows.

        Args:
            block: of rows.
            episode: (rows,) number of each row's episode.
            names: of the episodes.
        """
        number = int(episode[block.start])
        first = int(np.argmax(episode == number))
        return cls(names[number], block.start - first, len(block))


@dataclass(frozen=True)
class Course:
    """How large changes are in one newer log.

    Attributes:
        episode: its name.
        values: of the changes' parameters, fitted to the references and this log.
    """

    episode: str
    values: tuple[ParameterValue, ...]


@dataclass(frozen=True)
class Changes:
    """What has changed since reference logs.

    Attributes:
        reference: what the references' model lacks.
        closed: what changed since: its effects act in newer rows alone.
        known: number of episodes that are references; they come first.
        onset: where the changes begin; None: with the first newer log.
        courses: of each newer log, where there are several.
    """

    reference: ClosedLoop
    closed: ClosedLoop
    known: int
    onset: Onset | None
    courses: tuple[Course, ...]

    @property
    def newer(self) -> list[int]:
        """Numbers of the episodes that are no references."""
        return list(range(self.known, len(self.closed.errors.names)))

    @property
    def leaves_more(self) -> bool:
        """Whether newer logs are explained worse than the references, changes included.

        By the losses of their blocks (Welch's test of the logarithms, one-sided).
        """
        account, limits = self.closed.search.account, self.closed.last.settings
        equations = account.equations
        losses = np.log(np.maximum(equations.losses / equations.rows, 1e-300))
        is_newer = equations.episode >= self.known
        after, before = losses[is_newer], losses[~is_newer]
        if min(len(after), len(before)) < 2:
            return False
        p = ttest_ind(after, before, equal_var=False, alternative="greater").pvalue
        ratio = np.exp(after.mean() - before.mean())
        return bool(ratio > limits.max_objective_at_noise**2 and p < limits.alpha)


def find_changes(
    model: LogModel,
    known: int,
    *,
    settings: SelectionSettings = DEFAULT_SETTINGS,
    workers: Workers | None = None,
    progress: Progress | None = None,
    folder: Path | None = None,
    time_budget: float = math.inf,
) -> Changes:
    """Finds what changed from reference logs to newer ones.

    The loop is closed on the references; their effects are then part of the model, and
    are fitted together with its parameters to all logs. Effects of the library are
    added to the newer rows alone: from the first newer log on, or, if that explains
    more, from a block of rows on.

    Args:
        model: of all logs, without effects.
        known: number of its episodes, the first ones, that are references.
        settings, workers, progress: see `close_loop`.
        folder: of caches of fits, see `close_loop`.
        time_budget: for all searches [s].

    Raises:
        DisasmError: there is no reference, or no newer log; see also `close_loop`.
    """
    names, episode = model.measurements.names, model.measurements.episode
    if not 0 < known < len(names):
        raise DisasmError("give at least one reference, and one log to compare")
    search = _Search(
        settings, workers, progress, folder, time.monotonic() + time_budget
    )
    first = model.of_episodes(range(known))
    reference = search.closed(first, "reference", _OF_REFERENCES)
    whole = _with_effects_of(model, reference)

    # As much of the newer logs' loss as if the references were as long.
    share = float(np.mean(episode >= known))
    search = search.for_gain(2.0 * share * settings.min_gain)

    def _closed_since(row: int) -> ClosedLoop:
        is_newer = np.arange(len(episode)) >= row
        changed = ChangedModel(whole, is_newer, reference.last.values)
        return search.closed(changed, f"since_{row}_{len(whole.parameters)}")

    begin, onset = int(np.argmax(episode >= known)), None
    closed = _closed_since(begin)
    if common := _common(closed, whole, workers or Workers()):
        whole, _ = extended(whole, common)
        closed = _closed_since(begin)
    if (block := _onset_rows(closed, known)) is not None:
        later = _closed_since(block.start)
        if _loss(later) < _loss(closed):
            closed, onset = later, Onset.of(block, episode, names)
    return Changes(reference, closed, known, onset, _courses(closed, known, workers))


@dataclass(frozen=True)
class _Search:
    """How loops are closed, and until when.

    Attributes:
        settings, workers, progress, folder: see `find_changes`.
        deadline: of all [s], monotonic.
    """

    settings: SelectionSettings
    workers: Workers | None
    progress: Progress | None
    folder: Path | None
    deadline: float

    def for_gain(self, min_gain: float) -> "_Search":
        """Returns the same for effects that gain so much of the loss of all rows."""
        settings = dataclasses.replace(self.settings, min_gain=min_gain)
        return dataclasses.replace(self, settings=settings)

    def closed(self, model: LogModel, name: str, share: float = 1.0) -> ClosedLoop:
        """Closes the loop on all rows of a model, within a share of the time left."""
        return close_loop(
            model,
            test=(),
            settings=self.settings,
            workers=self.workers,
            progress=self.progress,
            folder=self.folder / name if self.folder else None,
            time_budget=share * max(self.deadline - time.monotonic(), 0.0),
        )


def _common(closed: ClosedLoop, whole: LogModel, workers: Workers) -> list[Candidate]:
    """Returns changes that explain as much as effects of all logs: they are none.

    What the references show too weakly to be named may show in the newer logs.

    Args:
        closed: with changes in the newer rows.
        whole: of all logs, with the references' effects.
        workers: fit.
    """
    if closed.is_provisional:
        return []
    last = closed.last
    assert isinstance(closed.first.model, ChangedModel)
    is_newer = closed.first.model.is_newer
    measured = last.model.measurements
    measured = measured.with_noise(measured.noise, "estimated")
    found = []
    for number, effect in enumerate(last.effects):
        more, _ = extended(whole, [effect])
        model = ChangedModel(more, is_newer, last.values).with_measurements(measured)
        delta = last.linearisation.huber_delta
        fitter = Fitter.of(model, workers, delta, last.settings)
        others = (*last.effects[:number], *last.effects[number + 1 :])
        if fitter.fit(others).loss <= last.loss:
            found.append(effect)
    return found


def _with_effects_of(model: LogModel, reference: ClosedLoop) -> LogModel:
    """Returns the model with the references' effects, in the shapes that they have."""
    whole, _ = extended(model, _at_values(reference))
    return whole


def _at_values(closed: ClosedLoop) -> list[Candidate]:
    """Returns the effects of a closed loop at their values."""
    last = closed.last
    count = len(last.effects)
    values = last.model.effects_at(last.model.with_frozen(last.theta))
    return [
        dataclasses.replace(candidate, effect=effect)
        for candidate, effect in zip(
            last.effects, values[len(values) - count :], strict=True
        )
    ]


def _onset_rows(closed: ClosedLoop, known: int) -> range | None:
    """Returns the rows within which something else changes, if it does."""
    grams = closed.search.account.system.grams
    if closed.is_provisional or grams.rows.sum() != closed.last.model.measurements.rows:
        return None
    block = onset_block(closed.search.account, grams.episode >= known)
    if block is None:
        return None
    row = int(grams.rows[:block].sum())
    return range(row, row + int(grams.rows[block]))


def _loss(closed: ClosedLoop) -> float:
    """Returns the held-out error of all channels, as the mean of its logarithm."""
    return float(np.mean(np.log(closed.errors.rms(closed.errors.after))))


def _courses(
    closed: ClosedLoop, known: int, workers: Workers | None
) -> tuple[Course, ...]:
    """Returns how large the changes are in each newer log, if there are several."""
    model, effects = closed.last.model, closed.last.effects
    names = model.measurements.names
    if len(names) - known < 2 or not effects:
        return ()
    delta, settings = closed.last.linearisation.huber_delta, closed.last.settings
    found = []
    for number in range(known, len(names)):
        own = closed.first.model.of_episodes([*range(known), number])
        fit = Fitter.of(own, workers or Workers(), delta, settings).fit(effects)
        values = parameter_values(fit, len(closed.first.theta))
        found.append(Course(names[number], values))
    return tuple(found)

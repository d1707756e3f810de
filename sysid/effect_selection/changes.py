"""What has changed since reference logs, by how much, and since when."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import ttest_ind

from drake_disasm.common.progress import Progress
from sysid.effect_selection.close_loop import ClosedLoop, close_loop
from sysid.effect_selection.onsets import Onset, onsets
from sysid.effect_selection.verdict import ParameterValue, parameter_values
from sysid.fitting.candidates import Candidate, extended
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import DEFAULT_SETTINGS, SelectionSettings
from sysid.models.base import LogModel
from sysid.models.changed import ChangedModel
from sysid.workers import Workers

_OF_REFERENCES = 0.5  # of the time


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
        closed: what changed since: its effects act in the newer logs alone.
        newer: numbers of the newer episodes.
        onsets: of those that begin within a log.
        courses: of each newer log, where there are several.
    """

    reference: ClosedLoop
    closed: ClosedLoop
    newer: tuple[int, ...]
    onsets: tuple[Onset, ...]
    courses: tuple[Course, ...]

    @property
    def leaves_more(self) -> bool:
        """Whether newer logs are explained worse than the references, changes included.

        By the losses of their blocks (Welch's test of the logarithms, one-sided).
        """
        account, last = self.closed.search.account, self.closed.last
        equations = account.equations
        losses = np.log(np.maximum(equations.losses / equations.rows, 1e-300))
        is_newer = np.isin(equations.episode, self.newer)
        after, before = losses[is_newer], losses[~is_newer]
        if min(len(after), len(before)) < 2:
            return False
        test = ttest_ind(after, before, equal_var=False, alternative="greater")
        is_larger = np.exp(after.mean() - before.mean()) > (
            last.settings.max_objective_at_noise**2
        )
        return bool(is_larger and test.pvalue < last.settings.alpha)


def find_changes(
    model: LogModel,
    newer: Sequence[int],
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
    added to the newer logs alone.

    Args:
        model: of all logs, without effects.
        newer: numbers of the episodes that are no references.
        settings, workers, progress: see `close_loop`.
        folder: of caches of fits, see `close_loop`.
        time_budget: for both searches [s].

    Raises:
        DisasmError: there is no reference, or no newer log; see also `close_loop`.
    """
    names = model.measurements.names
    known = [i for i in range(len(names)) if i not in newer]
    reference = close_loop(
        model.of_episodes(known) if known else model,
        test=(),
        settings=settings,
        workers=workers,
        progress=progress,
        folder=folder / "reference" if folder else None,
        time_budget=_OF_REFERENCES * time_budget,
    )
    changed = ChangedModel(*_extended(model, reference, newer))
    closed = close_loop(
        changed,
        test=(),
        settings=settings,
        workers=workers,
        progress=progress,
        folder=folder / "changes" if folder else None,
        time_budget=(1.0 - _OF_REFERENCES) * time_budget,
    )
    account = closed.search.account
    of_newer = np.isin(account.system.grams.episode, newer)
    found = onsets(account, of_newer)
    course = _courses(changed, closed, newer, workers)
    return Changes(reference, closed, tuple(newer), found, course)


def _extended(
    model: LogModel, reference: ClosedLoop, newer: Sequence[int]
) -> tuple[LogModel, Sequence[int], dict[str, float]]:
    """Returns the model with the references' effects, and where fits of it begin.

    Shapes are as in the references: sizes alone are fitted again.
    """
    last = reference.last
    effects = last.model.effects_at(last.model.with_frozen(last.theta))
    own = (
        [
            dataclasses.replace(candidate, effect=effect)
            for candidate, effect in zip(
                last.effects, effects[-len(last.effects) :], strict=True
            )
        ]
        if last.effects
        else []
    )
    whole, _ = extended(model, own)
    return whole, newer, last.values


def _courses(
    changed: ChangedModel,
    closed: ClosedLoop,
    newer: Sequence[int],
    workers: Workers | None,
) -> tuple[Course, ...]:
    """Returns how large the changes are in each newer log, if there are several."""
    effects = closed.last.effects
    if len(newer) < 2 or not effects:
        return ()
    names = changed.measurements.names
    known = [i for i in range(len(names)) if i not in newer]
    found = []
    for number in newer:
        model = changed.of_episodes([*known, number])
        delta = closed.last.linearisation.huber_delta
        fitter = Fitter.of(
            model, workers or Workers(), delta, closed.last.settings, None
        )
        fit = fitter.fit(_at_values(effects, closed))
        values = parameter_values(fit, len(closed.first.theta))
        found.append(Course(names[number], values))
    return tuple(found)


def _at_values(
    effects: Sequence[Candidate], closed: ClosedLoop
) -> tuple[Candidate, ...]:
    """Returns effects with the shapes that all newer logs have."""
    model = closed.last.model
    values = model.effects_at(model.with_frozen(closed.last.theta))
    return tuple(
        dataclasses.replace(candidate, effect=effect)
        for candidate, effect in zip(effects, values, strict=True)
    )

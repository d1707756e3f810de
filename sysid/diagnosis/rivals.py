"""The hypotheses that a verdict leaves: what the model may lack, each fitted."""

import dataclasses
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from drake_disasm.effects import Effect
from drake_disasm.scenario import Scenario
from sysid.diagnosis.growing_log import GrowingLog
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.effect_selection.detection import DetectionLimit
from sysid.effect_selection.effect_names import effect_class
from sysid.fitting.candidates import Candidate, candidates
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter
from sysid.models.base import Array, LogModel
from sysid.objective import pseudo_residual
from sysid.parameters import Scaling
from sysid.workers import Workers

#: What the hypothesis is called that the model lacks nothing (more).
NOTHING = "nothing"

#: How far apart two rivals are that differ by more than chance, in standard deviations.
BY_CHANCE = 5.0

_LEAST = 1e-4  # weight of a hypothesis that the log speaks against
_DRAWS = 2000  # of folds: a weight of a half is then known to a hundredth
_OF_BOUND = 0.5  # of an amplitude that no size within its bounds would have shown
_TIMES = 2.0  # the size that would have been found
_SUSPECTS = 3  # of something that is unexplained
_TRIED = 3  # experiments, until that is taken to be in no library
_MOST = 6  # hypotheses about what a log could not have shown


@dataclasses.dataclass(frozen=True)
class Rival:
    """A hypothesis.

    Attributes:
        name: of its effects, or NOTHING.
        scenario: the model with them, fitted.
        weight: share of draws of the log's folds in which it predicts held-out rows
            best; of those that the verdict can't tell apart the mean of that and of the
            same for each; of what the log could not have shown, the same for each.
        varied: the scenario, moved by a standard deviation along each axis of the
            covariance of its effects' parameters.
        loss: that it leaves of rows of the log that it was not fitted to.
    """

    name: str
    scenario: Scenario
    weight: float
    varied: tuple[Scenario, ...] = ()
    loss: float = 0.0


@dataclasses.dataclass(frozen=True)
class Need:
    """How far apart two rivals have to be for a verdict to tell them apart.

    One has to leave so much more of the loss as the margin of ambiguity asks
    (`Gain.is_about_as_good_as`), a share of what is left: each row adds to it, too. And
    more than chance.

    Attributes:
        margin: of the log so far.
        of_row: of each row that is added.
    """

    margin: float
    of_row: float = 0.0

    @classmethod
    def of(cls, closed: ClosedLoop) -> "Need":
        """Returns what a verdict needs."""
        left = closed.last.loss
        taken = max(closed.first.loss - left, 0.0)
        margin = closed.last.settings.ambiguity_margin * min(taken, left)
        return cls(margin, margin / closed.last.model.measurements.rows)

    def distances(self, rivals: Sequence[Rival], rows: int) -> Array:
        """Returns how far apart rivals have to be (k, k) in experiments to come.

        In standard deviations; whichever is ahead in the log so far keeps that.

        Args:
            rivals: k of them.
            rows: of the experiments.
        """
        loss = np.array([rival.loss for rival in rivals])
        missing = self.margin + self.of_row * rows - np.abs(loss[:, None] - loss)
        return np.sqrt(np.maximum(missing, BY_CHANCE**2))


def rivals_of(
    closed: ClosedLoop,
    log: GrowingLog,
    workers: Workers,
    folder: Path | None = None,
    performed: int = 0,
) -> tuple[Rival, ...]:
    """Returns the hypotheses that are left; one alone is settled.

    Args:
        closed: the verdict.
        log: on which it is.
        workers: fit.
        folder: of a cache of fits.
        performed: how many experiments were.
    """
    verdict, model = closed.verdict, log.model()
    fitter, library = _fitter(closed, model, workers, folder), candidates(model)
    is_open = verdict.ambiguous or verdict.suggested
    if is_open:
        sets = list(_sets(closed, library))
    elif verdict.ending == "unexplained" and performed < _TRIED:
        sets = list(_suspects(closed, library))
    else:
        return _unseen(closed, log, workers, folder)
    fits = [fitter.fit(effects, _start(closed.last, effects)) for effects, _ in sets]
    shares = best_of_folds([fit.held_out_losses for fit in fits])
    equal = 1.0 / max(1, sum(is_ambiguous for _, is_ambiguous in sets))
    found = []
    for (effects, is_ambiguous), fit, share in zip(
        sets, fits, shares.tolist(), strict=True
    ):
        scenario = fit.model.scenario_at(fit.theta)
        if scenario is not None:
            name = " and ".join(e.name for e in effects) or NOTHING
            weight = 0.5 * (share + equal) if is_ambiguous else max(share, _LEAST)
            loss = float(fit.held_out_losses.sum())
            found.append(Rival(name, scenario, weight, tuple(_varied(fit)), loss))
    return tuple(sorted(found, key=lambda rival: -rival.weight))


def _varied(fit: Fit) -> Iterator[Scenario]:
    """Yields a fit's scenario, moved along each axis of its parameters' covariance."""
    scaling, u = Scaling(fit.model.parameters), fit.linearisation.u
    covariance = np.nan_to_num(fit.covariance) if len(u) else np.zeros((0, 0))
    variances, axes = np.linalg.eigh(covariance)
    for variance, axis in zip(variances.tolist(), axes.T, strict=True):
        moved = u + axis * math.sqrt(max(variance, 0.0))
        scenario = fit.model.scenario_at(scaling.from_unit(np.clip(moved, 0.0, 1.0)))
        if scenario is not None:
            yield scenario


def best_of_folds(losses: Sequence[np.ndarray], seed: int = 0) -> np.ndarray:
    """Returns how often each of k hypotheses is the best (k,), over draws of folds.

    Args:
        losses: of each, (F,) of the held-out folds.
        seed: of the draws (bootstrap, Efron 1979).
    """
    table = np.array(losses)
    random = np.random.default_rng(seed)
    drawn = random.integers(table.shape[1], size=(_DRAWS, table.shape[1]))
    best = np.argmin(table[:, drawn].sum(axis=2), axis=0)
    return np.bincount(best, minlength=len(table)) / _DRAWS


def _start(fit: Fit, effects: Sequence[Candidate]) -> Fit | None:
    """Returns where a fit begins: where the last one ended, if it has its effects."""
    kept = {effect.name for effect in effects}
    return fit if all(e.name in kept for e in fit.effects) else None


def _sets(
    closed: ClosedLoop, library: Sequence[Candidate]
) -> Iterator[tuple[tuple[Candidate, ...], bool]]:
    """Yields sets of effects that are left, the verdict's first.

    And whether the verdict can't tell each from its own.
    """
    chosen = closed.last.effects
    yield chosen, True
    for standing in closed.verdict.standings:
        rest = tuple(e for e in chosen if e.name != standing.name)
        if standing.status == "suggested":
            yield rest, False
        for names in standing.rivals:
            yield (*rest, *(_shaped(closed, name, library) for name in names)), True


def _shaped(closed: ClosedLoop, name: str, library: Sequence[Candidate]) -> Candidate:
    """Returns an effect in the shape that gained most, all its amplitudes free."""
    for gain in closed.search.begin:
        for candidate in gain.term.candidates:
            if candidate.name == name:
                return Candidate.of(candidate.effect)
    return next(each for each in library if each.name == name)


def _suspects(
    closed: ClosedLoop, library: Sequence[Candidate]
) -> Iterator[tuple[tuple[Candidate, ...], bool]]:
    """Yields what explains most of a residual that is unexplained, and nothing."""
    yield (), False
    names = dict.fromkeys(gain.term.names for gain in closed.search.begin)
    single = [own[0] for own in names if len(own) == 1]
    for name in single[:_SUSPECTS]:
        yield (_shaped(closed, name, library),), True


def _fitter(
    closed: ClosedLoop, model: LogModel, workers: Workers, folder: Path | None
) -> Fitter:
    delta = model.default_huber_delta
    return Fitter.of(model, workers, delta, closed.last.settings, folder)


def _unseen(
    closed: ClosedLoop, log: GrowingLog, workers: Workers, folder: Path | None
) -> tuple[Rival, ...]:
    """Returns the verdict, and what its log does not speak against, each as a rival.

    An effect that its fit leaves at no size is one of a size that matters, unless the
    log speaks against that. Where something is named, that is all that was asked.
    """
    scenario = closed.scenario
    if scenario is None:
        return ()
    if closed.verdict.confirmed:
        return (Rival(" and ".join(closed.verdict.confirmed), scenario, 1.0),)
    model = log.model(scenario)
    fitter, library = _fitter(closed, model, workers, folder), candidates(model)
    alone, without = fitter.fit(()).loss, _loss(model)
    found = [Rival(NOTHING, scenario, 1.0, loss=alone)]
    for kind in sorted(closed.verdict.undetectable)[:_MOST]:
        effect = _of_size(kind, closed.verdict.limits)
        if effect is None:
            continue
        more = dataclasses.replace(scenario, effects=[*scenario.effects, effect])
        loss = alone + _loss(log.model(more)) - without
        rival = Rival(kind, more, 1.0, loss=loss)
        fit = fitter.fit(tuple(each for each in library if each.name == kind)[:1])
        fitted = fit.model.scenario_at(fit.theta)
        if fitted is not None and alone - fit.loss >= BY_CHANCE**2:
            rival = Rival(kind, fitted, 1.0, tuple(_varied(fit)), fit.loss)
        if rival.loss - alone < BY_CHANCE**2:
            found.append(rival)
    return tuple(dataclasses.replace(each, weight=1.0 / len(found)) for each in found)


def _loss(model: LogModel) -> float:
    """Returns the loss that a model without parameters leaves."""
    error = model.measurements.weighted(model.predictions(np.zeros(0)))
    return float(np.sum(pseudo_residual(error, model.default_huber_delta) ** 2))


def _of_size(kind: str, limits: Sequence[DetectionLimit]) -> Effect | None:
    """Returns an effect that a log could not have shown, of a size that matters.

    In the field and shape that it would have shown soonest: half of its bound, or twice
    of what would have been found.
    """
    made = effect_class(kind)
    if made is None:
        return None
    fields = {field.name for field in dataclasses.fields(made)}
    own = [x for x in limits if x.effect == kind and x.field in fields]
    if not own:
        return None
    best = min(own, key=lambda limit: limit.share)
    field = next(f for f in dataclasses.fields(made) if f.name == best.field)
    high = field.metadata["high"]
    size = _OF_BOUND * high
    if best.amplitude is not None:
        size = math.copysign(min(_TIMES * abs(best.amplitude), size), size)
    pairs = (part.split("=") for part in best.shape.split(", ") if part)
    return made(**{best.field: size}, **{name: float(v) for name, v in pairs})

"""The hypotheses that a verdict leaves: what the model may lack, each fitted."""

import dataclasses
import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np

from drake_disasm.effects import Effect, Reach
from drake_disasm.scenario import Scenario
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.effect_selection.effect_names import short_names
from sysid.effect_selection.forward_selection import room
from sysid.fitting.candidates import Candidate, candidates
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter
from sysid.models.base import Array, LogModel
from sysid.parameters import Scaling
from sysid.workers import Workers

#: What the hypothesis is called that the model lacks nothing (more).
NOTHING = "nothing"

#: And where that is said of what would happen.
AS_IT_IS = "the model as it is"

#: How many experiments are made about what is unexplained, or suggested.
TRIED = 3

#: How far apart two rivals are that differ by more than chance, in standard deviations.
BY_CHANCE = 5.0

_LEAST = 1e-4  # weight of a hypothesis that the log speaks against
_DRAWS = 2000  # of folds: a weight of a half is then known to a hundredth
_SUSPECTS = 3  # of something that is unexplained
_AHEAD = 2.0  # times as long as the log: how slow a hypothesis may be


@dataclasses.dataclass(frozen=True)
class Rival:
    """A hypothesis.

    Attributes:
        name: of its effects that not all have, or NOTHING.
        weight: share of draws of the log's folds in which it predicts held-out rows
            best; of those that the verdict can't tell apart the mean of that and of the
            same for each; of what the log could not have shown, the same for each.
        loss: that it leaves of rows of the log that it was not fitted to.
        is_guess: whether the log speaks against it, and an experiment is to show
            whether that stands.
        varied: the same, moved by a standard deviation along each axis of the
            covariance of its effects' parameters.
    """

    name: str
    weight: float
    loss: float
    is_guess: bool = dataclasses.field(default=False, kw_only=True)
    varied: tuple[Any, ...] = dataclasses.field(default=(), kw_only=True)

    @property
    def is_uncertain(self) -> bool:
        """Whether any of its parameters is."""
        return bool(self.varied)

    @property
    def with_known_parameters(self) -> Self:
        """The same, as if its parameters were known."""
        return dataclasses.replace(self, varied=())


@dataclasses.dataclass(frozen=True)
class TwinRival(Rival):
    """A hypothesis about a station in contact.

    Attributes:
        scenario: the model with its effects, fitted; `varied` has such, too.
    """

    scenario: Scenario


#: Returns the hypothesis of a name, a fit, a weight and a loss; None: there is none.
Make = Callable[[str, Fit, float, float], Rival | None]


@dataclasses.dataclass(frozen=True)
class Need:
    """How far apart two rivals have to be for a verdict to tell them apart.

    One has to leave so much more of the loss as the margin of ambiguity asks
    (`Gain.is_about_as_good_as`), or, where nothing is named, as an effect has to take
    away to be. Both are shares of what is left: each row adds to it, too. And more than
    chance.

    Attributes:
        margin: of the log so far.
        of_row: of each row that is added.
        reach: standard deviations of the model's own error that do not count, where
            nothing is named.
    """

    margin: float
    of_row: float = 0.0
    reach: float = 0.0

    @classmethod
    def of(cls, closed: ClosedLoop) -> "Need":
        """Returns what a verdict needs."""
        left, settings = closed.last.held_out_losses, closed.last.settings
        taken = closed.first.held_out_losses - left
        rows = closed.last.model.measurements.rows
        if closed.verdict.names:
            margin = settings.ambiguity_margin * room(taken, left)
            return cls(margin, margin / rows)
        margin = settings.min_gain / (1.0 - settings.min_gain) * float(left.sum())
        return cls(margin, margin / rows, settings.model_error_reach)

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


@dataclasses.dataclass(frozen=True)
class _Set:
    """Effects that may be what the model lacks.

    Attributes:
        effects: all of them.
        is_equal: whether the log can't tell it from the others.
        is_guess: see Rival.
    """

    effects: tuple[Candidate, ...]
    is_equal: bool = True
    is_guess: bool = False


def open_rivals(
    closed: ClosedLoop,
    model: LogModel,
    make: Make,
    workers: Workers,
    folder: Path | None = None,
    asked: Sequence[tuple[str, ...]] = (),
) -> tuple[Rival, ...]:
    """Returns the hypotheses that a verdict leaves open; none if it leaves none.

    An experiment may last longer than the log, which bounds what a verdict names: a
    hypothesis may be slower.

    Args:
        closed: the verdict.
        model: of the log on which it is.
        make: of a fit, the hypothesis.
        workers: fit.
        folder: of a cache of fits.
        asked: names of the verdict before each experiment.
    """
    model = model.looking_ahead(_AHEAD)
    fitter, library = fitter_of(closed, model, workers, folder), candidates(model)
    sets = list(_open_sets(closed, library, asked))
    if len(sets) < 2:
        return ()
    fits = [fitter.fit(s.effects, _start(closed.last, s.effects)) for s in sets]
    shares = best_of_folds([fit.held_out_losses.sum(axis=1) for fit in fits])
    equal = 1.0 / max(1, sum(each.is_equal for each in sets))
    found = []
    for each, name, fit, share in zip(
        sets, _names(sets), fits, shares.tolist(), strict=True
    ):
        weight = 0.5 * (share + equal) if each.is_equal else max(share, _LEAST)
        rival = make(name, fit, weight, float(fit.held_out_losses.sum()))
        if rival is not None:
            found.append(dataclasses.replace(rival, is_guess=each.is_guess))
    return tuple(sorted(found, key=lambda rival: (rival.is_guess, -rival.weight)))


def _open_sets(
    closed: ClosedLoop, library: Sequence[Candidate], asked: Sequence[tuple[str, ...]]
) -> Iterator[_Set]:
    """Yields sets of effects among which a verdict leaves the choice.

    What few seconds of contact show may be gone with the next: names have to stand once
    after an experiment that was made to refute them, and a residual that nothing
    explains is asked about more often.
    """
    verdict = closed.verdict
    is_left = verdict.ending in ("unexplained", "partly") and len(asked) < TRIED
    has_to_stand = not asked or set(asked[-1]) != set(verdict.names)
    is_short = closed.last.model.makes_contact
    if verdict.ambiguous or verdict.suggested:
        yield from _ambiguous_sets(closed, library)
    elif not verdict.confirmed:
        yield from _suspects(closed, library) if is_left else ()
    elif is_short and (is_left or has_to_stand):
        yield from _suspects(closed, library)


def _names(sets: Sequence[_Set]) -> list[str]:
    """Returns a name for each of some sets, of those effects that not all have."""
    common = set.intersection(*({e.name for e in each.effects} for each in sets))
    own = [[e.name for e in each.effects if e.name not in common] for each in sets]
    short = [short_names(names) for names in own]
    found = short if len(set(short)) == len(short) else map(" and ".join, own)
    return [name or NOTHING for name in found]


def twin_rival(name: str, fit: Fit, weight: float, loss: float) -> TwinRival | None:
    """Returns the hypothesis of a fit to a log of a station in contact; see `Make`."""
    scenario = fit.model.scenario_at(fit.theta)
    if scenario is None:
        return None
    varied = [fit.model.scenario_at(theta) for theta in varied_parameters(fit)]
    known = tuple(each for each in varied if each is not None)
    return TwinRival(name, weight, loss, scenario, varied=known)


def varied_parameters(fit: Fit) -> Iterator[Array]:
    """Yields a fit's parameters (p,), moved along each axis of their covariance.

    By a standard deviation each.
    """
    scaling, u = Scaling(fit.model.parameters), fit.linearisation.u
    covariance = np.nan_to_num(fit.covariance) if len(u) else np.zeros((0, 0))
    variances, axes = np.linalg.eigh(covariance)
    for variance, axis in zip(variances.tolist(), axes.T, strict=True):
        moved = u + axis * math.sqrt(max(variance, 0.0))
        yield scaling.from_unit(np.clip(moved, 0.0, 1.0))


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


def _ambiguous_sets(closed: ClosedLoop, library: Sequence[Candidate]) -> Iterator[_Set]:
    """Yields sets of effects that are left, the verdict's first.

    One rival of a kind at several joints replaces it at all of them.
    """
    chosen, together = closed.last.effects, defaultdict(list)
    yield _Set(chosen)
    for standing in closed.verdict.standings:
        if standing.status == "suggested":
            rest = tuple(e for e in chosen if e.name != standing.name)
            yield _Set(rest, is_equal=False)
        kind = standing.name.partition(".")[0]
        for names in standing.rivals:
            together[kind, names].append(standing.name)
    for (_, names), replaced in together.items():
        rest = tuple(e for e in chosen if e.name not in replaced)
        new = [name for name in names if name not in [e.name for e in rest]]
        yield _Set((*rest, *(_shaped(closed, name, library) for name in new)))


def _shaped(closed: ClosedLoop, name: str, library: Sequence[Candidate]) -> Candidate:
    """Returns an effect in the shape that gained most, all its amplitudes free."""
    reach = closed.last.model.reach
    for gain in closed.search.begin:
        for candidate in gain.term.candidates:
            if candidate.name == name:
                return Candidate.of(slower(candidate.effect, reach))
    return next(each for each in library if each.name == name)


def slower(effect: Effect, reach: Reach) -> Effect:
    """Returns an effect, if as slow as a log shows, as slow as a longer one would.

    Within its bounds, and never quicker.

    Args:
        effect: in the shape that gained most.
        reach: of the log.
    """
    most = effect.greatest_shapes(reach)
    ahead = effect.greatest_shapes(reach.longer(_AHEAD))
    found = {}
    for field in dataclasses.fields(effect):
        own = getattr(effect, field.name)
        if field.name in most and own >= most[field.name]:
            found[field.name] = max(own, min(ahead[field.name], field.metadata["high"]))
    return dataclasses.replace(effect, **found)


def _suspects(closed: ClosedLoop, library: Sequence[Candidate]) -> Iterator[_Set]:
    """Yields the verdict, less each of several, and what else explains most alone."""
    chosen = closed.last.effects
    yield _Set(chosen, is_equal=bool(chosen))
    for number in range(len(chosen)) if len(chosen) > 1 else ():
        yield _Set((*chosen[:number], *chosen[number + 1 :]), is_guess=True)
    names = dict.fromkeys(gain.term.names for gain in closed.search.begin)
    single = [own[0] for own in names if len(own) == 1]
    others = [name for name in single if name not in [e.name for e in chosen]]
    for name in others[:_SUSPECTS]:
        yield _Set((_shaped(closed, name, library),), is_guess=True)


def fitter_of(
    closed: ClosedLoop, model: LogModel, workers: Workers, folder: Path | None
) -> Fitter:
    """Returns a fitter of a model as that of a verdict was fitted.

    Args:
        closed: the verdict.
        model: of the log.
        workers: fit.
        folder: of a cache of fits.
    """
    delta = model.default_huber_delta
    return Fitter.of(model, workers, delta, closed.last.settings, folder)

"""From a fit without effects to one with those that lower the held-out error."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drake_disasm.common.progress import Progress, ProgressUpdate
from sysid.effect_selection.forward_selection import (
    Gain,
    Selection,
    Step,
    ranked,
    select,
)
from sysid.effect_selection.linear_account import LinearAccount
from sysid.effect_selection.linear_system import LinearSystem, linear_system
from sysid.effect_selection.refit_selection import RefitSelection
from sysid.effect_selection.replication import (
    Standing,
    standings,
    votes_of_gains,
    votes_of_selections,
)
from sysid.effect_selection.rival_fits import judged_by_all_rows
from sysid.fitting.candidates import Candidate
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter

_STAGE = "selecting effects"


@dataclass(frozen=True)
class SearchResult:
    """What a search found.

    Attributes:
        first, last: the fits without effects and with those that were selected.
        begin: what each candidate would gain without effects, the best first.
        account: of the model with the effects.
        steps: how the effects were chosen.
        standings: of the effects.
        untested: candidates, as text, for which the time was not enough.
        is_complete: whether it ended by itself, not because its time was over.
        invalid: why the model does not hold for the log, in words; empty if it does.
        doubted: see RefitSelection.
    """

    first: Fit
    last: Fit
    begin: tuple[Gain, ...]
    account: LinearAccount
    steps: tuple[Step, ...]
    standings: tuple[Standing, ...]
    untested: tuple[str, ...]
    is_complete: bool
    invalid: str = ""
    doubted: tuple[Fit, ...] = ()

    @property
    def phase(self) -> str:
        """What was being done when the time was over; empty if it was not."""
        if self.is_complete:
            return ""
        if self.untested:
            return "candidates were compared"
        if self.first.model.affine:
            return "parts of the log were left out in turn"
        return "effects were fitted"


def search(
    fitter: Fitter, library: Sequence[Candidate], progress: Progress, deadline: float
) -> SearchResult:
    """Returns the effects that lower the held-out error, and where each stands.

    Args:
        fitter: of all rows.
        library: candidates.
        progress: gets a line after each step.
        deadline: when to stop, by `time.monotonic` [s].
    """
    if fitter.base.affine:
        return _linear_search(fitter, library, progress, deadline)
    return _refit_search(fitter, library, progress, deadline)


def _linear_search(
    fitter: Fitter, library: Sequence[Candidate], progress: Progress, deadline: float
) -> SearchResult:
    """Returns what the linear account of all rows selects.

    It is exact but for shapes and for effects that are not linear themselves, as a mass
    and its place are. The fit tells, in which nothing has to stand for these.
    """
    _say(progress, "fitting the model without effects")
    first = fitter.fit(())
    _say(progress, f"comparing {len(library)} candidates")
    begin = time.monotonic()
    half = begin + 0.5 * (deadline - begin)  # the rest is for what is made of them
    system = linear_system(fitter, first, library, half)
    begin = time.monotonic()
    found = _selection(system)
    took = time.monotonic() - begin
    _say(progress, f"{len(found.names)} effects lower the held-out error")

    def _told(done: int, count: int) -> None:
        _say(progress, f"selecting without part {done} of {count} of the log")

    votes, is_complete = votes_of_selections(system, _told, deadline - took)
    effects = tuple(_candidates(system, found))
    _say(progress, "fitting the model with the effects")
    last = _needed(fitter, first, fitter.fit(effects, first)) if effects else first
    kept = {effect.name for effect in last.effects}
    account = LinearAccount.of_selection(system, found, kept)
    if not _is_exact(account, first, last):
        _say(progress, f"comparing {len(library)} candidates with the effects")
        account = LinearAccount.of_fit(
            linear_system(fitter, last, library, deadline), last
        )
    recordings = len(fitter.base.measurements.names)
    steps = tuple(s for s in found.steps if kept.intersection(s.chosen.term.names))
    rivals = _rivals(steps)
    placed = standings(account, votes, rivals, last.effects, recordings)
    gains = ranked(system.equations(), system.terms, system.settings)
    return SearchResult(
        first,
        last,
        tuple(gains),
        account,
        steps,
        placed,
        system.untested,
        is_complete and not system.untested,
    )


def _needed(fitter: Fitter, first: Fit, last: Fit) -> Fit:
    """Returns the fit without effects that gain too little once all are fitted."""
    kept = last.effects
    while kept:
        gains = last.gains_of(kept)
        worst = min(gains, key=lambda name: gains[name])
        if gains[worst] >= fitter.settings.min_gain:
            break
        kept = tuple(each for each in kept if each.name != worst)
    if not kept:
        return first
    return last if kept == last.effects else fitter.fit(kept, last)


def _is_exact(account: LinearAccount, first: Fit, last: Fit) -> bool:
    """Returns whether a fit leaves what the linear account says, but for `min_gain`."""
    squares = first.linearisation.weights * last.linearisation.residual**2
    fitted = float(np.sum(account.weights * squares.sum(axis=0)))
    linear = float(account.equations.losses.sum())
    return abs(fitted - linear) <= account.settings.min_gain * linear


def _selection(system: LinearSystem) -> Selection:
    return select(
        system.grams,
        system.own,
        system.terms,
        system.settings,
        system.weights,
        system.labels,
    )


def _candidates(system: LinearSystem, found: Selection) -> list[Candidate]:
    """Returns the effects of a selection, each once, with their amplitudes."""
    each = [c for term in found.terms for c in system.candidates_of(term)]
    merged: dict[str, Candidate] = {}
    for candidate in each:
        known = merged.setdefault(candidate.name, candidate)
        fields = dict.fromkeys((*known.fields, *candidate.fields))
        merged[candidate.name] = known.only(tuple(fields))
    return list(merged.values())


def _refit_search(
    fitter: Fitter, library: Sequence[Candidate], progress: Progress, deadline: float
) -> SearchResult:
    """Returns what fits select, on few rows where an evaluation takes long."""
    few = fitter.affordable
    _say(progress, "fitting the model without effects")
    start = few.fit(())
    selection = RefitSelection(few, library, progress, deadline)
    reached = selection.run(start)
    first, last = start, reached
    if few is not fitter and time.monotonic() < deadline:
        _say(progress, "fitting all rows")
        exact = fitter.with_exact_derivatives() if fitter.base.costly else fitter
        first, last = exact.fit(()), exact.fit(reached.effects, reached)
    steps = selection.steps
    if few is not fitter and not fitter.base.costly:
        last, steps = judged_by_all_rows(fitter, library, last, steps, deadline)
        if last.effects != reached.effects:
            reached = few.fit(last.effects, last)
    is_complete = selection.is_complete and time.monotonic() < deadline
    _say(progress, f"comparing {len(library)} candidates with the effects")
    system = linear_system(few, reached, library, deadline)
    account = LinearAccount.of_fit(system, reached)
    placed = standings(
        account,
        votes_of_gains(account),
        _rivals(steps),
        reached.effects,
        len(fitter.base.measurements.names),
    )
    return SearchResult(
        first,
        last,
        selection.begin,
        account,
        tuple(steps),
        placed,
        system.untested,
        is_complete,
        selection.invalid,
        tuple(selection.doubted),
    )


def _rivals(steps: Sequence[Step]) -> Mapping[str, tuple[tuple[str, ...], ...]]:
    """Returns the rivals of each effect; of one at all joints, those of its joint."""
    found: dict[str, tuple[tuple[str, ...], ...]] = {}
    for step in steps:
        for name in step.chosen.term.names:
            joint = name.partition(".")[2]
            own = [_at_joint(gain.term.names, joint) for gain in step.rivals]
            known = found.get(name, ())
            unique = dict.fromkeys(names for names in own if name not in names)
            found[name] = known or tuple(unique)
    return found


def _at_joint(names: tuple[str, ...], joint: str) -> tuple[str, ...]:
    """Returns the effect at a joint, of one kind at several; else all."""
    same = [name for name in names if joint and name.endswith(f".{joint}")]
    return tuple(same) if len(names) > 2 and same else names


def _say(progress: Progress, text: str) -> None:
    progress(ProgressUpdate(_STAGE, message=text))

"""Whether stretches of the log that had no say in choosing an effect ask for it, too.

Each part of the log is left out in turn. *Confirmed* is an effect that the others
select, but for one part, which may be the only one in which it shows, and whose size
agrees from one stretch to the next; *ambiguous* one for which they select it or a
rival; *suggested* what lowers the error and is neither.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import false_discovery_control

from sysid.effect_selection.forward_selection import select
from sysid.effect_selection.linear_account import LinearAccount
from sysid.effect_selection.linear_system import LinearSystem
from sysid.fitting.block_grams import Columns, NormalEquations, fold_numbers
from sysid.fitting.candidates import Candidate

Status = Literal["confirmed", "ambiguous", "suggested"]


@dataclass(frozen=True)
class Standing:
    """Where an effect stands.

    Attributes:
        name: of the effect.
        status: "confirmed", "ambiguous" or "suggested".
        gain: share of the held-out loss without it that it takes away.
        votes: number of selections, each without one part, that have it or a rival.
        parts: number of parts.
        rivals: names of effects, or of several, that explain about as much.
        reason: why it is not confirmed, in words; empty if it is.
    """

    name: str
    status: Status
    gain: float
    votes: int
    parts: int
    rivals: tuple[tuple[str, ...], ...] = ()
    reason: str = ""


def standings(
    account: LinearAccount,
    votes: Sequence[frozenset[str]],
    rivals: Mapping[str, tuple[tuple[str, ...], ...]],
    effects: Sequence[Candidate],
    recordings: int,
) -> tuple[Standing, ...]:
    """Returns where each effect stands, those that gain most first.

    Args:
        account: of the model with the effects.
        votes: names that are selected without each part.
        rivals: of each effect.
        effects: of the model.
        recordings: number of recordings that the log is of.
    """
    settings = account.settings
    equations, owners = account.equations_of_effects()
    folds = equations.folds(settings.folds)
    by_chance = _adjusted(account)
    slow = _slow_names(effects, account.system.noise_is_stated, recordings)
    found = []
    for name, columns in owners.items():
        own = rivals.get(name, ())
        asked = sum(bool(vote & {name, *(n for r in own for n in r)}) for vote in votes)
        reason = ""
        if name in slow:
            reason = "noise that is slow looks like it; a second session would tell"
        elif asked < settings.parts - 1:
            reason = f"{asked} of {settings.parts} parts of the log ask for it"
        elif by_chance[name] >= settings.alpha:
            reason = "its size differs from one stretch of the log to the next"
        status: Status = "suggested" if reason else "ambiguous" if own else "confirmed"
        gain = _gain(folds, columns)
        found.append(Standing(name, status, gain, asked, settings.parts, own, reason))
    return tuple(sorted(found, key=lambda each: -each.gain))


def _adjusted(account: LinearAccount) -> dict[str, float]:
    """Returns each effect's p-value, adjusted for all that might have been selected.

    So that of the effects below a level no larger share is there by chance (Benjamini
    and Hochberg 1995).
    """
    p = account.p_values
    names = {name for term in account.system.terms for name in term.names}
    others = np.ones(len(names.difference(p)))
    adjusted = false_discovery_control(np.append(list(p.values()), others))
    return dict(zip(p, adjusted.tolist(), strict=False))


def part_numbers(episode: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Returns the part (B,) of each block: contiguous, of whole episodes if it can.

    Args:
        episode: (B,) number of each block's.
        count: of parts.
    """
    episodes, number = np.unique(episode, return_inverse=True)
    if len(episodes) >= count:
        return fold_numbers(len(episodes), count)[number]
    return fold_numbers(len(episode), count)


def votes_of_selections(
    system: LinearSystem, progress: Callable[[int, int], None], deadline: float
) -> tuple[list[frozenset[str]], bool]:
    """Returns the names that are selected when each part is left out in turn.

    And whether there was time for all of them.

    Args:
        system: linear in its effects.
        progress: is told the number of selections that are done, and of all.
        deadline: by `time.monotonic` [s], after which none is begun.
    """
    grams, settings = system.grams, system.settings
    part = part_numbers(grams.episode, settings.parts)
    found: list[frozenset[str]] = []
    for number in range(int(part.max()) + 1):
        if time.monotonic() > deadline:
            return found, False
        others = grams.select(part != number)
        selected = select(
            others, system.own, system.terms, settings, system.weights, system.labels
        )
        found.append(frozenset(selected.names))
        progress(number + 1, int(part.max()) + 1)
    return found, True


def votes_of_gains(account: LinearAccount) -> list[frozenset[str]]:
    """Returns the effects that gain enough when each part is left out in turn.

    Where a selection takes minutes of fits, it is not made anew: an effect has the vote
    of the others if they would miss it.
    """
    equations, owners = account.equations_of_effects()
    part = part_numbers(equations.episode, account.settings.parts)
    found = []
    for number in range(int(part.max(initial=-1)) + 1):
        folds = equations.select(part != number).folds(account.settings.folds)
        gains = {name: _gain(folds, columns) for name, columns in owners.items()}
        least = account.settings.min_gain
        found.append(frozenset(name for name, gain in gains.items() if gain >= least))
    return found


def _gain(folds: NormalEquations, columns: Columns) -> float:
    """Returns the share of the loss without columns that they take away."""
    rest = np.setdiff1d(np.arange(len(folds.power)), columns)
    return folds.projected(rest).held_out_gain(columns)


def _slow_names(
    effects: Sequence[Candidate], noise_is_stated: bool, recordings: int
) -> set[str]:
    """Returns effects of time alone, which one recording can't tell from slow noise."""
    if noise_is_stated or recordings > 1:
        return set()
    return {e.name for e in effects if type(e.effect).is_of_time}

"""Whether parts of a log that had no say in choosing an effect ask for it, too.

Each part of the log is left out in turn. *Confirmed* is an effect that the others
select without it, and of a compatible size in each part; *ambiguous* one for which they
select it or a rival; *suggested* what lowers the error and is neither.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sysid.effect_selection.block_grams import Columns, NormalEquations, fold_numbers
from sysid.effect_selection.candidates import Candidate
from sysid.effect_selection.forward_selection import select
from sysid.effect_selection.linear_account import LinearAccount
from sysid.effect_selection.linear_system import LinearSystem

Status = Literal["confirmed", "ambiguous", "suggested"]

_INFORMED = 0.25  # of a part's fair share of what all say of an effect


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
    equations, owners = account.equations_of_effects()
    parts = equations.merged(part_numbers(equations.episode, account.settings.parts))
    folds = equations.folds(account.settings.folds)
    slow = _slow_names(effects, account.noise_is_stated, recordings)
    found = []
    for name, columns in owners.items():
        own = rivals.get(name, ())
        asked = sum(bool(vote & {name, *(n for r in own for n in r)}) for vote in votes)
        reason = ""
        if name in slow:
            reason = "noise that is slow looks like it; a second session would tell"
        elif asked < account.settings.parts - account.settings.missing_votes:
            reason = f"{asked} of {account.settings.parts} parts of the log ask for it"
        elif not _is_compatible(parts, columns, account.settings.missing_votes):
            reason = "its size differs between parts of the log"
        status: Status = "suggested" if reason else "confirmed"
        if own and not reason:
            status = "ambiguous"
        gain = _gain(folds, columns)
        parts_count = account.settings.parts
        found.append(Standing(name, status, gain, asked, parts_count, own, reason))
    return tuple(sorted(found, key=lambda each: -each.gain))


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


def _is_compatible(parts: NormalEquations, columns: Columns, most: int) -> bool:
    """Returns whether parts by themselves ask for coefficients of a compatible size.

    That is for at least half of what all ask for together, along the same direction, of
    which a part is then predicted better than without. So many parts may ask for less,
    none for the opposite. A part in which the effect hardly shows is not asked.

    Args:
        parts: equations of the effects.
        columns: of the effect.
        most: parts that may ask for less.
    """
    rest = np.setdiff1d(np.arange(len(parts.power)), columns)
    without = parts.projected(rest)
    x = without.solution(columns)
    inner = without.blocks[:, columns][:, :, columns]
    information = np.einsum("i,bij,j->b", x, inner, x)
    informed = information >= _INFORMED * information.mean()
    share = -(without.blocks[informed][:, columns, -1] @ x) / information[informed]
    return bool((share >= 0.0).all() and np.sum(share < 0.5) <= most)


def _slow_names(
    effects: Sequence[Candidate], noise_is_stated: bool, recordings: int
) -> set[str]:
    """Returns effects of time alone, which one recording can't tell from slow noise."""
    if noise_is_stated or recordings > 1:
        return set()
    return {e.name for e in effects if type(e.effect).is_of_time}

"""Where held-out rows cost most: the stretches, the channels, and single rows."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.objective import pseudo_residual
from sysid.residuals.held_out import HeldOut

Array = NDArray[np.float64]

_STRETCHES = 40  # of a single episode, that a figure shows
_COSTLY = 10  # stretches, and readings, that are marked
_OUTSTANDING = 20.0, 0.01  # times the mean loss of a reading, and of all loss


@dataclass(frozen=True)
class CostlyRow:
    """The worst reading of a stretch that takes much of the loss, or one by itself.

    Attributes:
        row: its number among the held-out rows.
        channel: its number.
        where: the episode and the time in it, or the row of the episode.
        size: of its residual, in units of the channel's noise.
        share: of all loss that the stretch takes in this channel, or the reading.
    """

    row: int
    channel: int
    where: str
    size: float
    share: float


@dataclass(frozen=True)
class LossMap:
    """What each channel of each episode costs; of a single episode, each stretch.

    Attributes:
        labels: of the S episodes or stretches.
        before, after: (channels, S) rms of the residual in units of the noise.
        stretches: those that cost most after, by their worst reading.
        outstanding: single readings that cost far more than others.
    """

    labels: tuple[str, ...]
    before: Array
    after: Array
    stretches: tuple[CostlyRow, ...]
    outstanding: tuple[CostlyRow, ...]


def loss_map(errors: HeldOut, huber_delta: float) -> LossMap:
    """Returns what held-out rows cost.

    Args:
        errors: with the noise of each channel, and the model's own error.
        huber_delta: residual, in units of the noise, beyond which the loss is linear.
    """
    before, after = (
        (predicted - errors.measured) / errors.sigma
        for predicted in (errors.before, errors.after)
    )
    parts, labels = _stretches(errors)
    count = len(labels)
    loss = np.asarray(pseudo_residual(after, huber_delta)) ** 2
    total = max(float(loss.sum()), 1e-300)
    return LossMap(
        labels,
        _rms(before, parts, count),
        _rms(after, parts, count),
        _costly_stretches(errors, after, loss / total, parts),
        _outstanding(errors, after, loss / total),
    )


def place(errors: HeldOut, row: int) -> str:
    """Returns where a held-out row is, in words: the episode, and time or row in it."""
    episode = int(errors.episode[row])
    inside = row - int(np.argmax(errors.episode == episode))
    name = errors.names[episode] if errors.names else ""
    when = f"{inside * errors.period:.3f} s" if errors.period else f"row {inside}"
    return f"{name}, {when}" if name else when


def _stretches(errors: HeldOut) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Returns the stretch of each row (rows,), and what each is called."""
    rows, episodes = len(errors.episode), int(errors.episode.max()) + 1
    if episodes > 1:
        return errors.episode, errors.names or tuple(map(str, range(episodes)))
    count = min(rows, _STRETCHES)
    parts = np.arange(rows) * count // rows
    begins = np.unique(parts, return_index=True)[1]
    if errors.period:
        return parts, tuple(f"{begin * errors.period:.3g} s" for begin in begins)
    return parts, tuple(f"row {begin}" for begin in begins)


def _rms(residual: Array, parts: NDArray[np.int64], count: int) -> Array:
    """Returns the rms (channels, count) of each part of a residual."""
    rows = np.bincount(parts, minlength=count)
    sums = [np.bincount(parts, column**2, minlength=count) for column in residual.T]
    return np.sqrt(np.array(sums) / rows)


def _costly_stretches(
    errors: HeldOut, residual: Array, share: Array, parts: NDArray[np.int64]
) -> tuple[CostlyRow, ...]:
    """Returns the worst reading of each of the costliest stretches of a channel."""
    count, channels = int(parts.max()) + 1, share.shape[1]
    sums = np.array([np.bincount(parts, own, minlength=count) for own in share.T])
    order = np.argsort(-sums, axis=None)[: min(_COSTLY, count * channels // 4)]
    found = []
    for channel, part in zip(*np.unravel_index(order, sums.shape), strict=True):
        inside = np.flatnonzero(parts == part)
        row = inside[np.argmax(np.abs(residual[inside, channel]))]
        found.append(
            _reading(errors, residual, int(row), int(channel), sums[channel, part])
        )
    return tuple(found)


def _outstanding(
    errors: HeldOut, residual: Array, share: Array
) -> tuple[CostlyRow, ...]:
    times, least = _OUTSTANDING
    order = np.argsort(-share, axis=None)[:_COSTLY]
    rows, channels = np.unravel_index(order, share.shape)
    return tuple(
        _reading(errors, residual, int(row), int(channel), share[row, channel])
        for row, channel in zip(rows, channels, strict=True)
        if share[row, channel] > max(times / share.size, least)
    )


def _reading(
    errors: HeldOut, residual: Array, row: int, channel: int, share: float
) -> CostlyRow:
    size = float(residual[row, channel])
    return CostlyRow(row, channel, place(errors, row), size, float(share))

"""Spikes: single rows far from their neighbours."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sysid.data_checks.expectation import Expectation
from sysid.data_checks.finding import DataFinding
from sysid.data_checks.subject import Subject
from sysid.data_checks.tails import tail_limit
from sysid.models.base import Array
from sysid.models.measurements import Measurements

_REMEDY = "look at them, or leave them out: `drop_flagged_rows`"


def spike_findings(subject: Subject, expected: Expectation) -> list[DataFinding]:
    """Finds rows of a column whose error is far from that of the rows around them.

    Where a joint reverses, what was measured has to stand alone more than what is
    expected: dry friction is expected to jump there, which a filter rounds.
    """
    measured, settings = subject.model.measurements, subject.settings
    columns, errors = _columns(subject, expected)
    found = []
    for number, name in enumerate(subject.column_names):
        alone = _alone(errors[:, number], subject.model.piece)
        limit, usual = tail_limit(alone, settings.spike_alpha)
        unit = measured.channels[number].unit
        noise = [
            scale
            for scale, c in zip(expected.scale, measured.channels, strict=True)
            if c.unit == unit
        ]
        limit = np.clip(limit, settings.least_spike * usual, settings.spike * usual)
        limit = max(float(limit), settings.spike_noise * max(noise))
        read, said = (
            np.abs(_alone(own[:, number], subject.model.piece))
            for own in (columns, columns - errors)
        )
        is_read = (read > said) | ~_reverses(subject, number)
        rows = np.flatnonzero((np.abs(alone) > limit) & is_read)
        if not usual or not 0 < len(rows) <= settings.most_spikes * measured.rows:
            continue
        what = f"{name}: {len(rows)} of {measured.rows} rows are far from the others"
        places = dict(_places(rows, measured, subject))
        found.append(DataFinding("spikes", what, _REMEDY, rows=places))
    return found


def _reverses(subject: Subject, channel: int) -> NDArray[np.bool_]:
    """Returns at which rows (n,) a channel's joint reverses, of the four around too."""
    v = subject.model.covariates(channel).get("velocity")
    if v is None:
        return np.zeros(subject.model.measurements.rows, dtype=bool)
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(v, 2, mode="edge"), 5)
    return np.asarray((windows.min(axis=1) <= 0.0) & (windows.max(axis=1) >= 0.0))


def _columns(subject: Subject, expected: Expectation) -> tuple[Array, Array]:
    """Returns what was measured (rows, channels) in the table's frame, and errors."""
    measured = subject.model.measurements
    explained = measured.values - expected.all_residuals() * expected.scale
    table = subject.model.frames(np.arange(measured.rows))[0]
    values = table.of(measured.values)
    return values, values - table.of(explained)


def _alone(r: Array, piece: NDArray[np.int64]) -> Array:
    """Returns by how much rows of a residual (n,) are off the median of four around.

    Or off a line through the next two, if that is less, at the ends of a piece: there
    are no rows on one side, and a residual that grows is no spike.

    Args:
        r: the residual.
        piece: of each row; a residual may jump between two pieces.
    """
    found = np.zeros(len(r))
    for number in np.unique(piece):
        own = np.flatnonzero(piece == number)
        if len(own) > 2:
            padded = np.pad(r[own], 2, mode="reflect")
            windows = np.lib.stride_tricks.sliding_window_view(padded, 5)
            found[own] = r[own] - np.median(windows[:, [0, 1, 3, 4]], axis=1)
            for end in (own[:3], own[::-1][:3]):
                a, b, c = r[end]
                off = np.array([a - 2.0 * b + c, b - 0.5 * (a + c)])
                found[end[:2]] = np.minimum(np.abs(found[end[:2]]), np.abs(off))
    return found


def _places(
    rows: NDArray[np.int64], measured: Measurements, subject: Subject
) -> Iterator[tuple[str, tuple[int, ...]]]:
    """Yields an episode and its rows, of the model's rows."""
    for number in np.unique(measured.episode[rows]):
        of_episode, first = subject.model_rows(int(number))
        own = np.flatnonzero(np.isin(of_episode, rows)) + first
        yield measured.names[number], tuple(int(row) for row in own)

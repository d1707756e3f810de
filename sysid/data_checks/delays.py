"""Whether a channel is late by whole rows."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from drake_disasm.logs.schema import SLOW_KINDS
from sysid.data_checks.expectation import Expectation
from sysid.data_checks.finding import DataFinding
from sysid.data_checks.settings import DataSettings
from sysid.data_checks.subject import Subject
from sysid.data_checks.units import RATES, derivatives
from sysid.models.base import Array

_REMEDY = "shift the column in the log, or let the loop find whether a lag explains it"


def delay_findings(subject: Subject, expected: Expectation) -> list[DataFinding]:
    """Finds channels that agree with what is expected of rows before or after.

    Poses and wrenches of transitions are shifted as a whole, torques joint by joint.
    Readings of a load alone, which turns slowly, have no delay.
    """
    if subject.kind in SLOW_KINDS:
        return []
    shifts = {
        name: _best_shift(subject, expected, channels)
        for name, channels in _groups(subject).items()
    }
    if subject.kind == "joint_motion":
        shifts |= {by: _rate_shift(subject, of, by) for of, by in RATES}
    return [_late(name, *shift) for name, shift in shifts.items() if shift[0]]


def _late(name: str, shift: int, left: float) -> DataFinding:
    late = "late" if shift > 0 else "early"
    rows = f"{abs(shift)} row{'s' * (abs(shift) > 1)}"
    what = (
        f"{name} is {late} by {rows}: shifted by that, its error falls to "
        f"{100 * left:.0f} %"
    )
    return DataFinding("late", what, _REMEDY)


def _rate_shift(subject: Subject, of: str, by: str) -> tuple[int, float]:
    """Returns by how many rows a rate is late, beside the derivative of a quantity.

    And the share of its error that is left then; zero and 1 if it is not late.
    """
    slopes, rates = derivatives(subject, of, by)
    most = subject.settings.most_shift
    if len(slopes) <= 4 * most:
        return 0, 1.0
    inner = slice(most, len(slopes) - most)
    errors = {
        shift: float(np.mean(np.abs(np.roll(rates, -shift, axis=0) - slopes)[inner]))
        for shift in range(-most, most + 1)
    }
    return _least(errors, float(np.mean(np.abs(slopes))), subject.settings)


def _least(
    errors: Mapping[int, float], size: float, settings: DataSettings
) -> tuple[int, float]:
    """Returns the shift with the least error, and its share of that without a shift.

    Zero and 1 where it is not far better, leaves much of the size, or is the last one
    that was tried.
    """
    best = min(errors, key=lambda shift: errors[shift])
    ratio = errors[best] / max(errors[0], 1e-300)
    is_known = errors[best] < settings.explained_share * size
    is_last = abs(best) == settings.most_shift
    if ratio > settings.explained or not is_known or is_last:
        return 0, 1.0
    return best, ratio


def _groups(subject: Subject) -> dict[str, NDArray[np.int64]]:
    """Returns the numbers of the channels that are shifted together, by their name."""
    channels = subject.model.measurements.channels
    if subject.kind == "transitions":
        return {"X_GB_measured": np.arange(6), "wrench": np.arange(6, 12)}
    return {f"tau.{i} ({c.name})": np.array([i]) for i, c in enumerate(channels)}


def _best_shift(
    subject: Subject, expected: Expectation, channels: NDArray[np.int64]
) -> tuple[int, float]:
    """Returns the shift that explains channels far better, and what it leaves.

    Zero and 1 if there is none. Only channels that show something count.
    """
    settings, measured = subject.settings, subject.model.measurements
    values = measured.values
    shifts = range(-settings.most_shift, settings.most_shift + 1)
    ok = _inside(measured.episode, expected.rows, settings)
    size = np.mean(np.abs(values - values.mean(axis=0)), axis=0) / expected.scale
    shown = channels[size[channels] > settings.least_signal]
    if not len(shown) or ok.sum() < settings.stuck_rows:
        return 0, 1.0
    errors = {}
    for shift in shifts:
        shifted = values[expected.rows].copy()
        source = np.where(ok, expected.rows + shift, expected.rows)
        shifted[:, channels] = values[source][:, channels]
        left = np.abs(expected.residual(shifted))[ok][:, shown]
        errors[shift] = float(left.mean())
    return _least(errors, float(size[shown].mean()), settings)


def _inside(
    episode: NDArray[np.int64], rows: NDArray[np.int64], settings: DataSettings
) -> NDArray[np.bool_]:
    """Returns which rows (n,) have as many on either side as the most shift."""
    last = len(episode) - 1
    sides: Sequence[Array] = [
        np.clip(rows + side * settings.most_shift, 0, last) for side in (-1, 1)
    ]
    exist = (rows >= settings.most_shift) & (rows <= last - settings.most_shift)
    same = [episode[side] == episode[rows] for side in sides]
    return np.asarray(exist & same[0] & same[1])

"""Rows that are not what the kind of a log says: motion and contact among rests."""

import numpy as np
from numpy.typing import NDArray

from sysid.data_checks.finding import DataFinding, rows_of
from sysid.data_checks.settings import DEFAULT_DATA_SETTINGS, DataSettings
from sysid.models.base import Array, LogModel
from sysid.models.bookkeeping import Poses
from sysid.models.measurements import Measurements

_SLOW = 8  # cosines over a log: drift, warm-up and a step are made of these


def contradicting_rows(
    model: LogModel, settings: DataSettings = DEFAULT_DATA_SETTINGS
) -> list[DataFinding]:
    """Finds rows of a model's log that contradict the kind of the log.

    Of readings at rest: rows that move, and a sensor's forces that change at one
    orientation, as in contact. A model that leaves such rows unexplained does not lack
    an effect, and what it leaves is not noise. Of readings in free space: the same
    forces, and rows that move if they are off by more than those at rest.

    Args:
        model: of all rows, or of those that are to be explained.
        settings: thresholds.

    Returns:
        Findings; rows are numbered in the model's episodes.
    """
    poses, measured = model.poses, model.measurements
    if poses is None:
        return []
    moving = _moving_rows(poses, measured, settings)
    if poses.R_WS is None:
        return _moving(measured, moving, settings)
    if poses.at_rest:
        found = _moving(measured, moving, settings)
    else:
        found = _inertial(poses.R_WS, measured, moving, settings)
    return found + _contact(poses, poses.R_WS, measured, ~moving, settings)


def _moving(
    measured: Measurements, moving: NDArray[np.bool_], settings: DataSettings
) -> list[DataFinding]:
    """Returns the finding of rows (n,) that move."""
    if not moving.any():
        return []
    what = (
        "readings that should be at rest, but move within "
        f"{settings.rest_window:g} s before and after"
    )
    return [_moving_finding(measured, moving, what)]


def _moving_finding(
    measured: Measurements, moving: NDArray[np.bool_], what: str
) -> DataFinding:
    rows = rows_of(
        {
            name: moving[measured.episode == number]
            for number, name in enumerate(measured.names)
        }
    )
    remedy = "leave them out: `drop_flagged_rows`"
    return DataFinding("moving", what, remedy, rows=rows)


def _inertial(
    R_WS: Array,
    measured: Measurements,
    moving: NDArray[np.bool_],
    settings: DataSettings,
) -> list[DataFinding]:
    """Returns the finding of rows (n,) that turn, if their forces are off by more.

    Weight, a zero and what changes slowly are taken away: a load that is accelerated
    exerts more than that.
    """
    if min(moving.sum(), (~moving).sum()) <= settings.contact_rows:
        return []
    force = measured.values[:, :3]
    row = np.arange(len(force), dtype=float)
    left = _fast(force, np.swapaxes(R_WS, 1, 2), row)
    turning, resting = (
        float(np.sqrt(np.mean(left[rows] ** 2))) for rows in (moving, ~moving)
    )
    if turning <= settings.contact_noise * resting:
        return []
    what = (
        f"forces in free space are off by {turning:.2g} N (rms) while the sensor turns "
        f"and by {resting:.2g} N at rest: the load's inertia"
    )
    return [_moving_finding(measured, moving, what)]


def _moving_rows(
    poses: Poses, measured: Measurements, settings: DataSettings
) -> NDArray[np.bool_]:
    """Returns which rows (n,) turn on both sides, as far as there are rows near.

    Those that do so once others are left out, too: what remains has none.
    """
    resting = np.ones(len(poses.clock), dtype=bool)
    for number in np.unique(measured.episode):
        own = np.flatnonzero(measured.episode == number)
        while len(own):
            moving = _turning(poses, own, settings)
            resting[own[moving]] = False
            if not moving.any():
                break
            own = own[~moving]
    return ~resting


def _turning(
    poses: Poses, rows: NDArray[np.int64], settings: DataSettings
) -> NDArray[np.bool_]:
    """Returns which of some rows (n,) of an episode turn on both sides.

    A row that has no other one near in time may well be at rest.
    """
    near, resting = np.zeros((2, len(rows)), dtype=bool)
    for side in (-1, 1):
        some, still = _still(poses, rows[::side], settings)
        near |= some[::side]
        resting |= (some & still)[::side]
    return near & ~resting


def _still(
    poses: Poses, rows: NDArray[np.int64], settings: DataSettings
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Returns which rows (n,) have rows before them in the window, and rest in it.

    Args:
        poses: of readings at rest.
        rows: (n,) of an episode, one way or the other.
        settings: thresholds.
    """
    n, time = len(rows), poses.clock[rows]
    some, still = np.zeros(n, dtype=bool), np.ones(n, dtype=bool)
    for back in range(1, n):
        since = np.abs(time[back:] - time[:-back])
        near = since <= settings.rest_window
        if not near.any():
            break
        limit = settings.rest_angle + settings.rest_rate * since
        some[back:] |= near
        still[back:] &= ~near | (poses.turned(rows[back:], rows[:-back]) <= limit)
    return some, still


def _contact(
    poses: Poses,
    R_WS: Array,
    measured: Measurements,
    resting: NDArray[np.bool_],
    settings: DataSettings,
) -> list[DataFinding]:
    """Returns a finding if forces change where a load at rest changes nothing.

    Two readings of an episode under gravity of one direction in S differ by noise, and
    by what the sensor does slowly: its drift is taken out first. They contradict a load
    if they differ by more than row-to-row noise, and by much of what all orientations
    make.
    """
    squares = []
    for number in np.unique(measured.episode):
        own = resting & (measured.episode == number)
        force, R_SW = measured.values[own, :3], np.swapaxes(R_WS[own], 1, 2)
        squares.append(_changes(force, R_SW, poses.clock[own], settings))
    changes = np.concatenate(squares)
    if not len(changes):
        return []
    force = measured.values[resting, :3]
    varied = float(np.mean((force - force.mean(axis=0)) ** 2))
    changed, noise = float(np.mean(changes)), _step_noise(force)
    is_large = changed > settings.contact_share * varied
    if not is_large or changed < settings.contact_noise**2 * noise**2:
        return []
    what = (
        f"forces change by {np.sqrt(changed):.2g} N (rms) at one orientation, and by "
        f"{noise:.2g} N from one row to the next: these are no readings of a load "
        f"{'at rest' if poses.at_rest else 'in free space'}"
    )
    remedy = (
        "record the raw reading of the sensor in free space, at rest in six or more "
        "orientations"
    )
    if poses.at_rest:
        remedy += "; if it is of a task with contact, import it as `kind` contact"
    return [DataFinding("contact", what, remedy)]


def _changes(force: Array, R_SW: Array, clock: Array, settings: DataSettings) -> Array:
    """Returns half the squared changes (pairs, 3) of forces at one orientation [N^2].

    None, if too few rows have another one with their orientation.

    Args:
        force: (n, 3) of an episode's rows at rest [N].
        R_SW: (n, 3, 3).
        clock: (n,) [s].
        settings: thresholds.
    """
    if len(force) <= settings.contact_rows:
        return np.zeros((0, 3))
    first, second = _pairs(R_SW[:, :, 2], settings)
    if len(np.union1d(first, second)) <= settings.contact_rows:
        return np.zeros((0, 3))
    left = _fast(force, R_SW, clock)
    return 0.5 * np.asarray(left[first] - left[second]) ** 2


def _fast(force: Array, R_SW: Array, clock: Array) -> Array:
    """Returns forces (n, 3) without a weight, a bias and what changes slowly."""
    n = len(force)
    span = max(float(np.ptp(clock)), 1e-300)
    phase = np.pi * (clock - clock.min()) / span
    slow = np.cos(phase[:, None] * np.arange(_SLOW + 1))
    of_slow = np.einsum("nk,ij->nijk", slow, np.eye(3)).reshape(n, 3, -1)
    columns = np.concatenate([R_SW, of_slow], axis=2).reshape(3 * n, -1)
    flat = force.reshape(-1)
    fit = np.linalg.lstsq(columns, flat, rcond=None)[0]
    return np.asarray((flat - columns @ fit).reshape(n, 3))


def _pairs(
    up_S: Array, settings: DataSettings
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Returns pairs of rows with the vertical (n, 3) in one direction in S.

    Of rows that are spread evenly, if there are many.
    """
    rows = np.arange(0, len(up_S), -(-len(up_S) // settings.contact_most_rows))
    cosine = np.clip(up_S[rows] @ up_S[rows].T, -1.0, 1.0)
    first, second = np.nonzero(np.triu(np.arccos(cosine) < settings.contact_angle, 1))
    return rows[first], rows[second]


def _step_noise(force: Array) -> float:
    """Returns the noise of forces (n, 3) by differences of neighbours [N]."""
    steps = np.median(np.abs(np.diff(force, axis=0)), axis=0)
    return float(np.sqrt(np.mean((1.4826 * steps) ** 2) / 2.0))

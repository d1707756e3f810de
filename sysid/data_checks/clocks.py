"""Time that jumps or stands, and readings at rest that move."""

import numpy as np
from numpy.typing import NDArray

from drake_disasm.importing.signals import stretches
from drake_disasm.logs import Episode, rotation_matrices
from sysid.data_checks.finding import DataFinding, rows_of
from sysid.data_checks.settings import DataSettings
from sysid.data_checks.subject import Subject
from sysid.models.base import Array


def clock_findings(subject: Subject) -> list[DataFinding]:
    """Finds what is wrong with `time`, and rows that moved though they say they rest.

    Readings at rest may be as far apart as they like.
    """
    if subject.kind == "static_wrench":
        return _moving(subject)
    return _jumps(subject) + _wrong_periods(subject)


def _jumps(subject: Subject) -> list[DataFinding]:
    """Finds steps of time that are far from the median step."""
    jumping = _lost if subject.kind == "joint_response" else _jumping
    rows = rows_of(subject.where(lambda e: jumping(e["time"], subject.settings)))
    if not rows:
        return []
    what = "time jumps, or nearly stands, in the step before these rows"
    remedy = "split the episode there, or find out what the clock did"
    return [DataFinding("time", what, remedy, rows=rows)]


def _jumping(time: Array, settings: DataSettings) -> NDArray[np.bool_]:
    """Returns the rows (n,) that a step leads to which is far off the median one."""
    steps = np.diff(time)
    if len(steps) < 3:
        return np.zeros(len(time), dtype=bool)
    median = float(np.median(steps))
    off = np.abs(steps - median)
    limit = settings.time_deviation * median
    limit = max(limit, settings.time_mads * float(np.median(off)))
    return np.concatenate([[False], off > limit])


def _lost(time: Array, settings: DataSettings) -> NDArray[np.bool_]:
    """Returns the rows (n,) before which some are lost.

    A motion that is simulated may be sampled at any times: only gaps hide what was
    commanded.
    """
    found = np.zeros(len(time), dtype=bool)
    found[[rows.start for rows in stretches(time)[1:]]] = True
    return found


def _wrong_periods(subject: Subject) -> list[DataFinding]:
    """Finds episodes whose median step is not the period that the log states."""
    found = []
    for log in subject.logs:
        period = log.header.period
        steps = [np.median(np.diff(e["time"])) for e in log.episodes if e.rows > 1]
        if period is None or not steps:
            continue
        median = float(np.median(steps))
        if abs(median - period) > subject.settings.period_deviation * period:
            what = f"{log.folder.name}: steps of {median:.4g} s, the period is {period}"
            remedy = "give time in seconds, and the period between rows"
            found.append(DataFinding("time", what, remedy))
    return found


def _moving(subject: Subject) -> list[DataFinding]:
    rows = rows_of(subject.where(lambda e: _turning(e, subject.settings)))
    if not rows:
        return []
    what = (
        "readings that should be at rest, but whose orientation changes within "
        f"{subject.settings.rest_window:g} s before and after"
    )
    return [
        DataFinding("moving", what, "leave them out: `drop_flagged_rows`", rows=rows)
    ]


def _turning(episode: Episode, settings: DataSettings) -> NDArray[np.bool_]:
    """Returns the rows (n,) that turn on both sides, as far as there are rows near.

    A row that has no other one near in time may well be at rest.
    """
    if "time" not in episode or episode.rows < 2:
        return np.zeros(episode.rows, dtype=bool)
    time, R_WS = episode["time"], rotation_matrices(episode["R_WS"])
    near, resting = np.zeros((2, episode.rows), dtype=bool)
    for side in (-1, 1):
        some, still = _still(time[::side], R_WS[::side], settings)
        near |= some[::side]
        resting |= (some & still)[::side]
    return near & ~resting


def _still(
    time: Array, R_WS: Array, settings: DataSettings
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Returns which rows (n,) have rows before them in the window, and rest in it."""
    n = len(time)
    some, still = np.zeros(n, dtype=bool), np.ones(n, dtype=bool)
    for back in range(1, n):
        since = np.abs(time[back:] - time[:-back])
        near = since <= settings.rest_window
        if not near.any():
            break
        trace = np.einsum("nij,nij->n", R_WS[back:], R_WS[:-back])
        angle = np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0))
        limit = settings.rest_angle + settings.rest_rate * since
        some[back:] |= near
        still[back:] &= ~near | (angle <= limit)
    return some, still

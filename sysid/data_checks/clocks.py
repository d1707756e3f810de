"""Time that jumps or stands."""

import numpy as np
from numpy.typing import NDArray

from drake_disasm.logs.importing.signals import stretches
from drake_disasm.logs.schema import SLOW_KINDS
from sysid.data_checks.finding import DataFinding, rows_of
from sysid.data_checks.settings import DataSettings
from sysid.data_checks.subject import Subject
from sysid.models.base import Array


def clock_findings(subject: Subject) -> list[DataFinding]:
    """Finds what is wrong with `time`; readings of a load may be far apart."""
    if subject.kind in SLOW_KINDS:
        return []
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

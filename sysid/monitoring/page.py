"""The page of a watch: the course of the evidence, and of what is suspected."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sysid.monitoring.detector import Array
from sysid.monitoring.monitor import Monitor
from sysid.monitoring.statistics import Statistic
from sysid.report.figures import as_data_url
from sysid.report.templates import render

_DRAWN = 3  # statistics
_FLOOR = -2.0  # log10 of evidence: less is none
_BAND = 2.0  # standard deviations of the reference


def monitor_page(monitor: Monitor, watched: Path, origin: Mapping[str, Any]) -> str:
    """Returns the page as one self-contained HTML file.

    Args:
        monitor: what it has come to.
        watched: folder that is watched.
        origin: provenance of the program.
    """
    return render(
        "monitoring.html.j2",
        monitor=monitor,
        watched=watched,
        recent=monitor.recent[::-1],
        alarm=next((r for r in monitor.recent[::-1] if r.get("alarm")), None),
        pictures={
            "course": as_data_url(course_figure(monitor)),
            "suspects": as_data_url(suspects_figure(monitor)),
        },
        origin=origin,
    )


def course_figure(monitor: Monitor) -> Figure:
    """Returns log10 R_n by episode, with the line of the alarm."""
    figure = Figure(figsize=(9.0, 3.0), layout="constrained")
    ax = figure.subplots()
    points, line = monitor.course.points, float(np.log10(monitor.every))
    ax.plot(points[:, 0], np.maximum(points[:, 1], _FLOOR), color="#2060a0", lw=1.2)
    ax.axhline(line, color="#c03030", ls="--", lw=1.0, label="alarm")
    ax.set_xlabel("episode")
    ax.set_ylabel("log10 of the evidence R")
    ax.set_ylim(_FLOOR - 0.2, None)
    ax.legend(fontsize=8, loc="upper left")
    return figure


def suspects_figure(monitor: Monitor) -> Figure:
    """Returns the most suspicious statistics by episode, with the reference's band."""
    found, known = monitor.detector.evidence(), monitor.statistics.all
    named = (
        {s["parameter"] for s in monitor.recent[-1]["suspects"]}
        if monitor.has_alarm
        else {}
    )
    first = np.array([each.text not in named for each in known])
    order = np.lexsort([-found.log_each, first]).tolist()
    names = [known[i].name for i in order]
    numbers = [i for n, i in enumerate(order) if names.index(names[n]) == n][:_DRAWN]
    figure = Figure(figsize=(9.0, 2.3 * len(numbers)), layout="constrained")
    axes = np.atleast_1d(figure.subplots(len(numbers), 1, sharex=True))
    for ax, number in zip(axes, numbers, strict=True):
        values = monitor.history.values[:, number]
        _draw(ax, known[number], values, monitor.baseline.values[:, number])
    axes[-1].set_xlabel("episode, of those that are kept; the last one is 0")
    return figure


def _draw(ax: Axes, statistic: Statistic, values: Array, baseline: Array) -> None:
    """Draws a statistic by episode."""
    at = np.arange(len(values)) - len(values) + 1
    ax.plot(at, values, ".", ms=4, color="#2060a0")
    if np.isfinite(baseline).sum() > 1:
        middle = float(np.nanmean(baseline))
        reach = _BAND * float(np.nanstd(baseline, ddof=1))
        ax.axhspan(middle - reach, middle + reach, color="#202020", alpha=0.1, lw=0)
    unit = "log of the rms / noise" if statistic.is_residual else statistic.unit
    ax.set_title(f"{statistic.text} [{unit}]", fontsize=9, loc="left")

"""The report of a closed loop, and its figures."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sysid.effect_selection.close_loop import ClosedLoop
from sysid.effect_selection.evidence import Evidence
from sysid.effect_selection.held_out import HeldOut
from sysid.effect_selection.output import to_mapping
from sysid.effect_selection.survey import Survey
from sysid.report.figures import as_data_url
from sysid.report.templates import render

_BEFORE, _AFTER, _DARK = "#b0b0b0", "#c03030", "#202020"
_PASSES, _FAILS = "#2060a0", "#c8d0d8"
_SHOWN = 15
_SHOWN_ROWS = 2000


def closing_page(closed: ClosedLoop, origin: Mapping[str, Any]) -> str:
    """Returns the report of a closed loop as one self-contained HTML page.

    Args:
        closed: what was found.
        origin: its provenance, as in `result.json`.
    """
    pictures = {
        "residual": residual_figure(closed.errors),
        "ranking": ranking_figure([r.survey for r in closed.rounds] + [closed.end]),
    }
    return render(
        "closing.html.j2",
        result=to_mapping(closed),
        settings=closed.last.settings,
        pictures={name: as_data_url(figure) for name, figure in pictures.items()},
        origin=origin,
    )


def residual_figure(errors: HeldOut) -> Figure:
    """Returns each channel's error on held-out rows, before and after."""
    channels = errors.channels
    columns = min(3, len(channels))
    lines = -(-len(channels) // columns)
    figure = Figure(figsize=(4.2 * columns, 2.0 * lines), layout="constrained")
    axes = figure.subplots(lines, columns, squeeze=False, sharex=True).reshape(-1)
    for number, ax in enumerate(axes[: len(channels)]):
        _draw_errors(ax, errors, number)
    for ax in axes[len(channels) :]:
        ax.set_visible(False)
    axes[0].legend(fontsize=7)
    figure.supxlabel("held-out row", fontsize=9)
    return figure


def _draw_errors(ax: Axes, errors: HeldOut, number: int) -> None:
    """Draws a channel's error before and after, over a band of its noise."""
    channel = errors.channels[number]
    every = max(1, len(errors.measured) // _SHOWN_ROWS)
    rows = np.arange(0, len(errors.measured), every)
    for predicted, colour, label in (
        (errors.before, _BEFORE, "before"),
        (errors.after, _AFTER, "after"),
    ):
        error = (predicted - errors.measured)[rows, number]
        ax.plot(rows, error, color=colour, lw=0.9, label=label)
    ax.axhspan(-channel.noise, channel.noise, color=_DARK, alpha=0.08, lw=0)
    ax.set_title(f"{channel.name} [{channel.unit}]", fontsize=9)
    ax.tick_params(labelsize=7)


def ranking_figure(surveys: Sequence[Survey]) -> Figure:
    """Returns what each candidate would explain, in the first and the last survey."""
    shown = {"without added effects": surveys[0], "with added effects": surveys[-1]}
    figure = Figure(figsize=(11.0, 4.6), layout="constrained")
    for ax, (title, survey) in zip(figure.subplots(1, 2), shown.items(), strict=True):
        best = _best_shapes(survey.effects)[:_SHOWN][::-1]
        gains = [max(100.0 * e.gain, 0.0) for e in best]
        colours = [_PASSES if e.accepted else _FAILS for e in best]
        ax.barh(range(len(best)), gains, color=colours)
        names = [f"{e.name}  (p {e.p:.2g})" for e in best]
        ax.set_yticks(range(len(best)), names, fontsize=7)
        ax.set_xlabel("share of the held-out loss explained, %", fontsize=8)
        ax.set_title(title, fontsize=9)
    return figure


def _best_shapes(evidence: Sequence[Evidence]) -> list[Evidence]:
    """Returns each effect once, with the shape parameters that explain most."""
    found: dict[str, Evidence] = {}
    for each in evidence:
        found.setdefault(" and ".join(each.effects), each)
    return list(found.values())

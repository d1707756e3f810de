"""The page of a closed loop, and its pictures."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from sysid.effect_selection.close_loop import Closed
from sysid.effect_selection.evidence import Evidence
from sysid.effect_selection.held_out import HeldOut
from sysid.effect_selection.output import to_mapping
from sysid.effect_selection.search import Survey
from sysid.report.figures import as_data_url
from sysid.report.templates import render

_BEFORE, _AFTER, _DARK = "#b0b0b0", "#c03030", "#202020"
_PASSES, _FAILS = "#2060a0", "#c8d0d8"
_SHOWN = 15
_SHOWN_ROWS = 2000


def closing_page(closed: Closed, origin: Mapping[str, Any]) -> str:
    """Returns the report of a closed loop as one HTML page that needs nothing else.

    Args:
        closed: what was found.
        origin: where it is from, as `result.json` has it.
    """
    pictures = {
        "residual": residual_figure(closed.errors),
        "ranking": ranking_figure([r.survey for r in closed.rounds] + [closed.end]),
    }
    return render(
        "closing.html.j2",
        result=to_mapping(closed),
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
    every = max(1, len(errors.measured) // _SHOWN_ROWS)
    rows = np.arange(0, len(errors.measured), every)
    for i, (ax, channel) in enumerate(zip(axes, channels, strict=False)):
        for predicted, colour, label in (
            (errors.before, _BEFORE, "before"),
            (errors.after, _AFTER, "after"),
        ):
            error = (predicted - errors.measured)[rows, i]
            ax.plot(rows, error, color=colour, lw=0.9, label=label)
        ax.axhspan(-channel.noise, channel.noise, color=_DARK, alpha=0.08, lw=0)
        ax.set_title(f"{channel.name} [{channel.unit}]", fontsize=9)
        ax.tick_params(labelsize=7)
    for ax in axes[len(channels) :]:
        ax.set_visible(False)
    axes[0].legend(fontsize=7)
    figure.supxlabel("held-out row", fontsize=9)
    return figure


def ranking_figure(surveys: Sequence[Survey]) -> Figure:
    """Returns what each candidate would explain, in the first and the last survey."""
    shown = {"on the model as it was": surveys[0], "at the end": surveys[-1]}
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
    """Returns each effect once, in the shape that explains most."""
    found: dict[str, Evidence] = {}
    for e in evidence:
        assert isinstance(e.what, tuple)
        found.setdefault(" and ".join(c.name for c in e.what), e)
    return list(found.values())

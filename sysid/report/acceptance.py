"""The report on which policies the corrected twin accepts."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from sysid.acceptance.acceptance import Acceptance
from sysid.acceptance.corrected_twin import CorrectedTwin
from sysid.acceptance.trials import Trial
from sysid.acceptance.words import to_mapping
from sysid.report.plots import AFTER, PASSES, Plot, finish
from sysid.report.templates import render

_SPREAD = 0.25  # of dots about their policy's row
_ROW = 60  # pixels for a policy


def acceptance_page(
    judged: Sequence[Acceptance], twin: CorrectedTwin, origin: Mapping[str, Any]
) -> str:
    """Returns the report as one self-contained HTML page.

    Args:
        judged: policies, the best first.
        twin: on which they were tried.
        origin: provenance, as in `result.json`.
    """
    limit = twin.scenario.task.reward.f_max
    result = to_mapping(judged, twin)
    plot = strip_plot(judged, limit)
    return render("acceptance.html.j2", result=result, plot=plot, origin=origin)


def strip_plot(judged: Sequence[Acceptance], limit: float) -> Plot:
    """Returns the peak force of each trial, policy by policy, and the limit [N]."""
    figure = go.Figure()
    rows = {each.policy: -number for number, each in enumerate(judged)}
    for name, colour, passed in (("success", PASSES, True), ("failure", AFTER, False)):
        for twin, symbol, size in (("draws", "circle", 7), ("values", "diamond", 13)):
            marker = {"color": colour, "symbol": symbol, "size": size, "opacity": 0.7}
            x, y, text = _dots(judged, rows, passed, twin)
            label = name if twin == "draws" else f"{name} at the verdict's values"
            figure.add_trace(
                go.Scatter(
                    x=x, y=y, mode="markers", marker=marker, name=label, hovertext=text
                )
            )
    figure.add_vline(limit, line={"dash": "dash", "width": 1}, annotation_text="limit")
    figure.update_xaxes(title_text="peak force [N]", rangemode="tozero")
    names, places = list(rows), list(rows.values())
    figure.update_yaxes(tickvals=places, ticktext=names, automargin=True)
    finish(figure, 180 + _ROW * len(judged))
    return Plot(figure, "A dot for each draw from the verdict's 95 % intervals.")


def _dots(
    judged: Sequence[Acceptance], rows: Mapping[str, int], passed: bool, twin: str
) -> tuple[list[float], list[float], list[str]]:
    """Returns places of dots, and what each says."""
    x, y, text = [], [], []
    for each in judged:
        trials = each.draws if twin == "draws" else (each.values,)
        offsets = np.linspace(-_SPREAD, _SPREAD, len(trials)) if trials[1:] else [0.0]
        for trial, offset in zip(trials, offsets, strict=True):
            if trial.succeeded is passed:
                x.append(trial.peak_force)
                y.append(rows[each.policy] + float(offset))
                text.append(_said(trial))
    return x, y, text


def _said(trial: Trial) -> str:
    values = [f"{name} {value:.4g}" for name, value in trial.drawn.items()]
    return "<br>".join([f"seed {trial.seed}: {trial.outcome.label}", *values])

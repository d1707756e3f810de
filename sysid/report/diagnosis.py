"""The story of a diagnosis: what was left, what was done about it, what came out."""

import itertools
from collections.abc import Mapping
from typing import Any

import plotly.graph_objects as go
from plotly.colors import qualitative

from sysid.diagnosis import Diagnosis, Round
from sysid.report.plots import MEASURED, Plot, finish
from sysid.report.templates import render

_HEIGHT = 280  # pixels
_COLOURS = qualitative.D3


def diagnosis_page(
    found: Diagnosis, origin: Mapping[str, Any], is_watched: bool = False
) -> str:
    """Returns the report as one self-contained HTML page.

    Args:
        found: the diagnosis.
        origin: provenance.
        is_watched: whether there is a page of each experiment in `meshcat`.
    """
    names = dict.fromkeys(name for one in found.rounds for name in one.predicted)
    colours = dict(zip(names, itertools.cycle(_COLOURS), strict=False))
    plots = [
        experiment_plot(one, colours) if one.experiment else None
        for one in found.rounds
    ]
    rounds = list(zip(found.rounds, plots, strict=True))
    return render(
        "story.html.j2",
        found=found,
        rounds=rounds,
        origin=origin,
        is_watched=is_watched,
    )


def experiment_plot(one: Round, colours: Mapping[str, str]) -> Plot:
    """Returns what each rival predicted of an experiment, and what was measured.

    Args:
        one: round with an experiment.
        colours: of rivals, by name.
    """
    figure, (predicted, measured) = go.Figure(), one.periods
    for name, values in one.predicted.items():
        line = {"color": colours[name]}
        figure.add_trace(
            go.Scatter(y=values, dx=predicted, mode="lines", line=line, name=name)
        )
    figure.add_trace(
        go.Scatter(
            y=one.measured,
            dx=measured,
            mode="markers",
            marker={"color": MEASURED, "size": 4},
            name="measured",
        )
    )
    figure.update_xaxes(title_text="time [s]")
    figure.update_yaxes(title_text=f"{one.channel} [{one.unit}]")
    finish(figure, _HEIGHT)
    return Plot(figure, "In the channel in which the hypotheses differ most.")

"""The pictures of a report on an identification, as pure functions of a result."""

import base64
import io
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sysid.identification.profile import Profile
from sysid.identification.result import Identification, MethodResult
from sysid.identification.sensitivity import LOOSE

Array = NDArray[np.float64]

_COLOURS = {"bees": "#d98c00", "nlopt": "#2060a0"}
_BEFORE, _AFTER, _MEASURED = "#b0b0b0", "#c03030", "#202020"
_DPI = 100


def as_data_url(figure: Figure) -> str:
    """Returns a figure as a PNG inside a `data:` address."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=_DPI)
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()


def trace_figure(methods: Sequence[MethodResult], floor: float) -> Figure:
    """Returns the best value against evaluations, like the thesis's figure 4.6."""
    names = [stage.name.split(", ")[1] for stage in methods[0].stages]
    figure = Figure(figsize=(4.4 * len(names), 3.2), layout="constrained")
    for number, ax in enumerate(np.atleast_1d(figure.subplots(1, len(names)))):
        for method in methods:
            _draw_trace(ax, method, number)
        ax.axhline(floor, color=_MEASURED, lw=0.8, ls="--", label="perfect model")
        rows = methods[0].stages[number].rows
        ax.set_title(f"{names[number]} search, {rows} rows", fontsize=9)
        ax.set_yscale("log")
        ax.set_xlabel("evaluations", fontsize=9)
        ax.set_ylabel("objective, best so far", fontsize=9)
        ax.legend(fontsize=8)
    return figure


def correlation_figure(found: Identification) -> Figure:
    """Returns the correlation of the estimates as a coloured matrix."""
    names = [p.name for p in found.parameters]
    size = min(3.0 + 0.45 * len(names), 12.0)
    figure = Figure(figsize=(size + 1.0, size), layout="constrained")
    ax = figure.subplots()
    C = found.uncertainty.correlation
    image = ax.imshow(C, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    figure.colorbar(image, ax=ax, shrink=0.7)
    ax.set_xticks(range(len(names)), names, rotation=90, fontsize=7)
    ax.set_yticks(range(len(names)), names, fontsize=7)
    if len(names) <= 12:
        for i, j in np.ndindex(C.shape):
            dark = abs(C[i, j]) > 0.6
            ax.text(j, i, f"{C[i, j]:.2f}", ha="center", va="center", fontsize=7,
                    color="white" if dark else "black")  # fmt: skip
    return figure


def identifiability_figure(found: Identification) -> Figure:
    """Returns how precisely the log determines each orthogonal combination."""
    figure = Figure(figsize=(6.5, 2.6), layout="constrained")
    ax = figure.subplots()
    for label, sensed, colour in (
        ("at the start", found.sensitivity_before, _BEFORE),
        ("at the result", found.sensitivity_after, _AFTER),
    ):
        widths = [c.interval for c in sensed.combinations]
        ax.plot(
            range(1, len(widths) + 1), widths, "o-", ms=4, color=colour, label=label
        )
    ax.axhline(LOOSE, color=_MEASURED, ls="--", lw=0.8, label="not determined above")
    ax.set_yscale("log")
    ax.set_xlabel("combination, the best determined first", fontsize=9)
    ax.set_ylabel("95 % half width / range", fontsize=9)
    ax.legend(fontsize=8)
    return figure


def profile_figure(profiles: Sequence[Profile]) -> Figure:
    """Returns profile likelihoods with the edge of the 95 % interval."""
    figure = Figure(figsize=(3.6 * len(profiles), 2.8), layout="constrained")
    axes = np.atleast_1d(figure.subplots(1, len(profiles)))
    for ax, p in zip(axes, profiles, strict=True):
        ax.plot(p.theta, p.values, "o-", ms=4, color=_AFTER)
        ax.axhline(p.edge, color=_MEASURED, ls="--", lw=0.8)
        ax.set_title(p.name, fontsize=9)
        ax.tick_params(labelsize=7)
    return figure


def _draw_trace(ax: Axes, method: MethodResult, number: int) -> None:
    trace = method.stages[number].trace
    evaluations = np.arange(1, trace.evaluations + 1)
    colour = _COLOURS.get(method.name)
    ax.step(
        evaluations, trace.best_so_far(), where="post", color=colour, label=method.name
    )
    ax.plot(evaluations, trace.values, ".", ms=1.5, color=colour, alpha=0.4)

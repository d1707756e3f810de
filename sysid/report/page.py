"""The page: a result and its figures in a template."""

from collections.abc import Mapping, Sequence
from typing import Any

from sysid.data_checks import DataFinding
from sysid.identification.output import to_mapping
from sysid.identification.result import Comparison, Identification
from sysid.report import figures, plots
from sysid.report.templates import render
from sysid.residuals.held_out import HeldOut

_DRAWS = 200  # of the bootstrap of an error


def report_page(
    found: Identification,
    origin: Mapping[str, Any],
    findings: Sequence[DataFinding] = (),
) -> str:
    """Returns the report of a result as one HTML page that needs nothing else.

    Args:
        found: the result.
        origin: its provenance, as in `result.json`.
        findings: of the check of the data.
    """
    shown = found.held_out or found.fitted
    return render(
        "identification.html.j2",
        result=to_mapping(found),
        shown="held-out" if found.held_out else "fitted",
        pictures=_pictures(found),
        drawn=_plots(found, shown),
        origin=origin,
        findings=findings,
        conclusion=_conclusion(found),
    )


def _plots(found: Identification, shown: Comparison) -> dict[str, plots.Plot]:
    rows = HeldOut(
        shown.measured,
        shown.before,
        shown.after,
        shown.episode,
        tuple(found.channels),
        "",
        _DRAWS,
        shown.names,
    )
    return {"fit": plots.fit_plot(rows), "errors": plots.error_plot(rows)}


def _pictures(found: Identification) -> dict[str, str]:
    methods = list(found.methods.values())
    drawn = {
        "traces": figures.trace_figure(methods, found.noise_floor),
        "correlation": figures.correlation_figure(found),
        "identifiability": figures.identifiability_figure(found),
    }
    if found.profiles:
        drawn["profiles"] = figures.profile_figure(found.profiles)
    return {name: figures.as_data_url(figure) for name, figure in drawn.items()}


def _conclusion(found: Identification) -> str:
    """Returns one sentence on whether the model explains the log."""
    judged, where = found.fitted, "fitted"
    if found.held_out:
        judged, where = found.held_out, "held-out"
    ratio = judged.value_after / found.noise_floor
    if any(channel.origin == "first fit" for channel in found.channels):
        coloured = int((found.whiteness < 0.05).sum())
        return (
            "The sensors' noise is not stated, so it was estimated from this fit. "
            f"{coloured} of {len(found.channels)} channels leave a residual that is "
            "not white noise (Ljung-Box, p < 0.05)."
        )
    if ratio < 1.1:
        return f"The model explains the {where} rows down to the sensors' noise."
    return (
        f"The error on {where} rows is {ratio:.1f} times what noise explains: the "
        "model lacks something, or the stated noise of a channel is too small."
    )

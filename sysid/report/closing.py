"""The report of a closed loop."""

from collections.abc import Mapping, Sequence
from typing import Any

from sysid.data_checks import DataFinding
from sysid.effect_selection.change_words import changes_mapping
from sysid.effect_selection.changes import Changes, Course
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.effect_selection.output import to_mapping
from sysid.report import plots
from sysid.report.effect_table import kind_rows
from sysid.report.loss_map import LossMap, loss_map
from sysid.report.next_recordings import limit_rows, recordings
from sysid.report.templates import render


def closing_page(
    closed: ClosedLoop,
    origin: Mapping[str, Any],
    findings: Sequence[DataFinding] = (),
    exported: Mapping[str, Any] | None = None,
) -> str:
    """Returns the report of a closed loop as one self-contained HTML page.

    Args:
        closed: what was found.
        origin: its provenance, as in `result.json`.
        findings: of the check of the data.
        exported: robots' files that were written, as in `result.json`.
    """
    result = to_mapping(closed) | {"export": exported}
    return _page(closed, result, origin, findings)


def changes_page(
    changes: Changes,
    origin: Mapping[str, Any],
    findings: Sequence[DataFinding] = (),
) -> str:
    """Returns the report of what has changed as one self-contained HTML page.

    Args:
        changes: what was found.
        origin: its provenance, as in `result.json`.
        findings: of the check of the data.
    """
    result = changes_mapping(changes)
    return _page(changes.closed, result, origin, findings, changes.courses)


def _page(
    closed: ClosedLoop,
    result: Mapping[str, Any],
    origin: Mapping[str, Any],
    findings: Sequence[DataFinding],
    courses: Sequence[Course] = (),
) -> str:
    found = loss_map(closed.errors, closed.last.linearisation.huber_delta)
    return render(
        "closing.html.j2",
        result=result,
        courses=plots.course_plot(courses) if courses else None,
        verdict=closed.verdict,
        kinds=kind_rows(closed.verdict),
        limits=limit_rows(closed.verdict.limits),
        recordings=recordings(closed.verdict, closed.last.model.setting),
        worse=_made_worse(closed),
        losses=found,
        noise=_noise_origin(closed),
        settings=closed.last.settings,
        drawn=_plots(closed, found),
        origin=origin,
        findings=findings,
        exported=result.get("export"),
    )


def _plots(closed: ClosedLoop, found: LossMap) -> dict[str, plots.Plot | None]:
    errors, model = closed.errors, closed.last.model
    channels = model.measurements.channels
    residuals = [fit.linearisation.residual for fit in (closed.first, closed.last)]
    covariates = [model.covariates(number) for number in range(len(channels))]
    marked = [(each.row, each.channel) for each in found.stretches + found.outstanding]
    return {
        "fit": plots.fit_plot(errors, marked),
        "errors": plots.error_plot(errors),
        "losses": plots.loss_plot(found, errors.channels),
        "dependence": plots.dependence_plot(residuals, covariates, channels),
        "candidates": plots.candidate_plot(
            closed.search.begin,
            closed.search.account.gains(),
            closed.last.settings.min_gain,
        ),
    }


def _made_worse(closed: ClosedLoop) -> set[str]:
    """Returns the channels that effects make worse on held-out rows."""
    errors = closed.errors
    before, after = (errors.interval(p) for p in (errors.before, errors.after))
    return {
        channel.name
        for channel, (_, high), (low, _) in zip(
            errors.channels, before, after, strict=True
        )
        if low > high
    }


def _noise_origin(closed: ClosedLoop) -> str:
    """Returns what the noise is, and where it is from, in words."""
    text = "the channel's noise"
    if closed.last.states_model_error:
        text += " and, with it, what the model states of its own error in that row"
    if closed.last.noise_is_stated:
        return text
    return f"{text} (not stated: estimated from the residual of the first fit)"

"""One check of the data before any fit: all findings, and the rows that they flag."""

from collections.abc import Sequence
from typing import TypeVar

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs import Log
from sysid.data_checks.axes import axes_findings
from sysid.data_checks.clocks import clock_findings
from sysid.data_checks.constancy import (
    dead_channels,
    quantum_findings,
    stuck_findings,
)
from sysid.data_checks.contradictions import contradicting_rows
from sysid.data_checks.delays import delay_findings
from sysid.data_checks.derivatives import (
    derivative_findings,
    limit_findings,
    stillness_findings,
)
from sysid.data_checks.expectation import expectation_of
from sysid.data_checks.finding import DataFinding, Severity
from sysid.data_checks.processing import processing_findings
from sysid.data_checks.settings import DEFAULT_DATA_SETTINGS, DataSettings
from sysid.data_checks.spikes import spike_findings
from sysid.data_checks.subject import Subject, kept_rows
from sysid.data_checks.torques import torque_findings
from sysid.data_checks.units import log_unit_findings, predicted_unit_findings
from sysid.models.base import LogModel
from sysid.workers import Workers

Model = TypeVar("Model", bound=LogModel)


def assumption_findings(subject: Subject) -> list[DataFinding]:
    """Returns what the model takes for granted."""
    return [
        DataFinding("assumed", each.what, each.remedy)
        for each in subject.model.assumptions
    ]


def kind_findings(subject: Subject) -> list[DataFinding]:
    """Returns rows that contradict the kind of the log."""
    return contradicting_rows(subject.model, subject.settings)


#: What logs show by themselves, and what shows against a model's expectation.
_OF_LOGS = (
    clock_findings,
    kind_findings,
    derivative_findings,
    stillness_findings,
    stuck_findings,
    processing_findings,
    log_unit_findings,
    assumption_findings,
)
_OF_MODEL = (axes_findings, delay_findings, spike_findings, quantum_findings)


def check_data(
    logs: Sequence[Log],
    model: LogModel,
    settings: DataSettings = DEFAULT_DATA_SETTINGS,
    workers: Workers | None = None,
) -> tuple[DataFinding, ...]:
    """Returns what the data are not, though they say so; those to be refused first.

    Args:
        logs: of one kind.
        model: of these logs, all rows, at its nominal parameters.
        settings: thresholds.
        workers: evaluate the model; this process if left out.
    """
    subject = Subject.of(logs, model, settings)
    found = [finding for check in _OF_LOGS for finding in check(subject)]
    found += dead_channels(model, settings)
    if not _is_refused(found):
        expected = expectation_of(model, settings, workers or Workers())
        found += limit_findings(subject)
        found += predicted_unit_findings(subject, expected)
        if not _is_refused(found):  # the rest takes the scale as it is
            found += [f for check in _OF_MODEL for f in check(subject, expected)]
        if not _is_refused(found):  # and the order
            found += torque_findings(subject, expected)
    found = [subject.as_read(finding) for finding in found]
    return tuple(sorted(found, key=lambda f: f.severity is not Severity.REFUSE))


def _is_refused(found: Sequence[DataFinding]) -> bool:
    return any(finding.severity is Severity.REFUSE for finding in found)


def without_flagged_rows(
    logs: Sequence[Log],
    model: Model,
    findings: Sequence[DataFinding],
    whole_episodes: bool = False,
) -> Model:
    """Returns the model of the rows that no finding flags.

    Args:
        logs: of the model.
        model: of all their rows.
        findings: of these logs.
        whole_episodes: whether an episode with such a row goes as a whole.

    Raises:
        DisasmError: no row is left.
    """
    flagged: dict[str, set[int]] = {}
    for finding in findings:
        for name, rows in finding.rows.items():
            flagged.setdefault(name, set()).update(rows)
    if not flagged:
        return model
    subject = Subject.of(logs, model, DEFAULT_DATA_SETTINGS)
    kept = kept_rows(subject, flagged, whole_episodes)
    if not kept.any():
        raise DisasmError(
            "`drop_flagged_rows`: leaves no row of these logs; record them anew"
        )
    return model.of_rows(kept)

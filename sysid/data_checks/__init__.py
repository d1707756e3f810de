"""Data that are not what they say: found before any fit, by name, with the rows.

::

    findings = check_data(logs, model)
    for finding in findings:
        print(finding.text)
    refuse(findings)
    model = without_flagged_rows(logs, model, findings)

Each kind of finding is listed in `KINDS`; `docs/guides/identify.md` says what each one
looks at. `DataSettings` has the thresholds.
"""

from sysid.data_checks.check import check_data, without_flagged_rows
from sysid.data_checks.contradictions import contradicting_rows
from sysid.data_checks.finding import (
    ACCEPTABLE,
    KINDS,
    DataFinding,
    Severity,
    refuse,
)
from sysid.data_checks.settings import DEFAULT_DATA_SETTINGS, DataSettings

__all__ = [
    "ACCEPTABLE",
    "DEFAULT_DATA_SETTINGS",
    "KINDS",
    "DataFinding",
    "DataSettings",
    "Severity",
    "check_data",
    "contradicting_rows",
    "refuse",
    "without_flagged_rows",
]

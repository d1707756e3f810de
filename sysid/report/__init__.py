"""Reports that open offline: one HTML page with figures and their script inside."""

from sysid.report.acceptance import acceptance_page
from sysid.report.closing import changes_page, closing_page
from sysid.report.diagnosis import diagnosis_page
from sysid.report.page import report_page

__all__ = [
    "acceptance_page",
    "changes_page",
    "closing_page",
    "diagnosis_page",
    "report_page",
]

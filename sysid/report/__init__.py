"""Reports that open offline: one HTML page with its pictures inside."""

from sysid.report.page import report_page

__all__ = ["report_page"]

"""Fits the parameters of a model to its log, and says how certain they are.

found = identify(model)
print(summary(found), found.values, found.interval_bootstrap)
"""

from sysid.identification.identify import identify
from sysid.identification.journal import Journal
from sysid.identification.output import summary
from sysid.identification.result import Identification
from sysid.identification.settings import SearchSettings, Settings

__all__ = [
    "Identification",
    "Journal",
    "SearchSettings",
    "Settings",
    "identify",
    "summary",
]

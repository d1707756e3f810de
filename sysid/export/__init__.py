"""What closing the loop identified, written back into robots' files."""

from sysid.export.identified_effects import add_identified_effects
from sysid.export.write import FORMATS, Exports, make_exports, refuse_export

__all__ = [
    "FORMATS",
    "Exports",
    "add_identified_effects",
    "make_exports",
    "refuse_export",
]

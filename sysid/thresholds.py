"""Thresholds as fields of a dataclass, each with its unit and the reason for it."""

import dataclasses
from typing import Any

NOT_MEASURED = "not measured"


def threshold(
    default: Any, unit: str, reason: str, measured: str = NOT_MEASURED
) -> Any:
    """Returns a field with its unit, why it has its value, and what was measured."""
    metadata = {"unit": unit, "reason": reason, "measured": measured}
    return dataclasses.field(default=default, metadata=metadata)

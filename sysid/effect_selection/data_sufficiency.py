"""Whether a log is long enough, and moves, to decide anything."""

from drake_disasm.common.errors import DisasmError
from sysid.models.base import LogModel

_LEAST_ROWS = 6  # poses, as the guide asks for of readings at rest
_PER_PARAMETER = 2  # readings, so that half of them can be held out


def refuse_few_rows(model: LogModel) -> None:
    """Refuses logs that the model's own parameters could fit exactly.

    Raises:
        DisasmError: there are too few rows; states how many are needed.
    """
    rows, channels = model.measurements.values.shape
    count = len(model.parameters)
    needed = max(_LEAST_ROWS, -(-_PER_PARAMETER * count // channels))
    if rows < needed:
        raise DisasmError(
            f"the log is too short to decide: {rows} rows of {channels} channels, for "
            f"a model of {count} parameters; record at least {needed - rows} rows more"
        )


def refuse_rest(model: LogModel) -> None:
    """Refuses logs of joints none of which moves.

    Raises:
        DisasmError: no joint does; names the first.
    """
    travel = model.travel
    if travel and not any(travel.values()):
        joint = next(iter(travel))
        raise DisasmError(
            f"{joint}: does not move in any row, nor does another joint; record a "
            "motion, or several poses, or map the columns of its positions"
        )

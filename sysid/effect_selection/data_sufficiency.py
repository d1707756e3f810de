"""Whether a log is long enough to decide anything."""

import numpy as np

from drake_disasm.common.errors import DisasmError
from sysid.effect_selection.fit import Fit
from sysid.models.base import LogModel

_LEAST_ROWS = 10
_ROWS_EACH = 2  # for each parameter, so that some can be held out
_MOST_EXCESS = 1.0  # of the loss of a block that is not fitted
_AT_MOST = 20  # times the log: beyond that, the estimate means nothing


def refuse_few_rows(model: LogModel) -> None:
    """Refuses logs that the model's own parameters could follow at will.

    Raises:
        DisasmError: there are too few readings; it says how many are needed.
    """
    rows, channels = model.measurements.values.shape
    count = len(model.parameters)
    needed = max(_LEAST_ROWS, _ROWS_EACH * count)
    if rows < needed:
        raise DisasmError(
            f"the log is too short to decide: {rows} rows of {channels} channels, for "
            f"a model of {count} parameters; record at least {needed - rows} rows more"
        )


def refuse_short_logs(last: Fit) -> None:
    """Refuses to guess where a part of the log does not carry over to the rest.

    Half of the blocks cost several times as much when they are predicted by a fit to
    all others as in the fit to all: each shows something else, and whatever is added
    to the model follows that. The excess is in proportion to the parameters over the
    independent data (Akaike's final prediction error), so it says how much is lacking.

    Args:
        last: the fit with all effects that were found.

    Raises:
        DisasmError: there are too few; it says how much more is needed.
    """
    regression = last.regression()
    alone = regression.losses(np.arange(len(last.theta)))
    excess = float(np.median(alone / np.maximum(regression.energy, 1e-300))) - 1.0
    if excess <= _MOST_EXCESS:
        return
    rows = last.model.measurements.rows
    more = min(int(np.ceil(rows * (excess / _MOST_EXCESS - 1.0))), _AT_MOST * rows)
    raise DisasmError(
        f"the log is too short to decide: a fit to all but a part of its {rows} rows "
        f"misses that part by {np.sqrt(1.0 + excess):.1f} times as much as a fit to "
        f"all; record at least {max(more, 1)} rows more, of other motion or poses"
    )

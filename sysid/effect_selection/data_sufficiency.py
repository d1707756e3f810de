"""Whether a log is long enough to decide anything."""

import numpy as np

from drake_disasm.common.errors import DisasmError
from sysid.effect_selection.fit import Fit
from sysid.effect_selection.settings import SelectionSettings
from sysid.models.base import LogModel


def refuse_few_rows(model: LogModel, settings: SelectionSettings) -> None:
    """Refuses logs that the model's own parameters could fit exactly.

    Raises:
        DisasmError: there are too few rows; states how many are needed.
    """
    rows, channels = model.measurements.values.shape
    count = len(model.parameters)
    needed = max(settings.min_rows, settings.rows_per_parameter * count)
    if rows < needed:
        raise DisasmError(
            f"the log is too short to decide: {rows} rows of {channels} channels, for "
            f"a model of {count} parameters; record at least {needed - rows} rows more"
        )


def refuse_short_logs(last: Fit) -> None:
    """Refuses logs whose parts do not predict one another.

    There half of the blocks have a loss several times as large when they are predicted
    by a fit to all others as in the fit to all: whatever is added to the model overfits
    them. The excess is in proportion to the parameters over the independent data
    (Akaike's final prediction error), from which follows how much more is needed.

    Args:
        last: the fit with all effects that were found.

    Raises:
        DisasmError: there are too few rows; states how many more are needed.
    """
    if last.effects:
        return
    regression = last.regression()
    alone = regression.held_out_losses(np.arange(len(last.theta)))
    fitted = np.maximum(regression.block_losses, 1e-300)
    excess = float(np.median(alone / fitted)) - 1.0
    limit = last.settings.max_block_excess
    if excess <= limit:
        return
    rows = last.model.measurements.rows
    longest = last.settings.max_extrapolation * rows
    more = min(int(np.ceil(rows * (excess / limit - 1.0))), longest)
    raise DisasmError(
        f"the log is too short to decide: the residual of a part of its {rows} rows is "
        f"{np.sqrt(1.0 + excess):.1f} times as large when that part is not fitted; "
        f"record at least {max(more, 1)} rows more, of other motion or poses"
    )

"""Whether a log is long enough to decide anything."""

from collections.abc import Sequence

import numpy as np

from drake_disasm.common.errors import DisasmError
from sysid.effect_selection.detection import DetectionLimit
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


def refuse_short_logs(last: Fit, limits: Sequence[DetectionLimit]) -> None:
    """Refuses logs that show nothing, and could not have.

    More than a noise that is known is something, whatever effect it is of. Either no
    effect would have been found, whatever its amplitude. Or parts of the log
    do not predict one another: half of the blocks have a loss several times as large
    when they are predicted by a fit to all others as in the fit to all. The excess is
    in proportion to the parameters over the independent data (Akaike's final prediction
    error), from which follows how much more is needed.

    Args:
        last: the fit with all effects that were found.
        limits: of detection, at that fit.

    Raises:
        DisasmError: there are too few rows; states how many more are needed.
    """
    if last.effects:
        return
    rows = last.model.measurements.rows
    nearest = min((limit.share for limit in limits), default=0.0)
    at_noise = last.settings.max_objective_at_noise
    shows_more = last.noise_is_stated and last.objective > at_noise
    if nearest > 1.0 and not shows_more:
        raise DisasmError(
            f"the log is too short to decide: in its {rows} rows no effect of the "
            f"library would have been found, however large; record at least "
            f"{_more_rows(last, nearest**2 - 1.0)} rows more, of other motion or poses"
        )
    regression = last.regression()
    alone = regression.held_out_losses(np.arange(len(last.theta)))
    fitted = np.maximum(regression.block_losses, 1e-300)
    excess = float(np.median(alone / fitted)) - 1.0
    limit = last.settings.max_block_excess
    if excess > limit:
        raise DisasmError(
            f"the log is too short to decide: the residual of a part of its {rows} rows"
            f" is {np.sqrt(1.0 + excess):.1f} times as large when that part is not "
            f"fitted; record at least {_more_rows(last, excess / limit - 1.0)} rows "
            "more, of other motion or poses"
        )


def _more_rows(last: Fit, times: float) -> int:
    """Returns so many times the rows of a log, as far as can be foreseen."""
    rows = last.model.measurements.rows
    return max(
        int(min(np.ceil(times * rows), last.settings.max_extrapolation * rows)), 1
    )

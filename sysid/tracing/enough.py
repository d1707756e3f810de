"""Whether a log is long enough to decide anything."""

import numpy as np
from numpy.typing import NDArray

from drake_disasm.errors import DisasmError
from sysid.identification.uncertainty import block_length
from sysid.models.base import ScenarioModel
from sysid.tracing.empirical import curves
from sysid.tracing.evidence import LEAST_GAIN
from sysid.tracing.selection import Fit, Survey

Array = NDArray[np.float64]

LEAST_BLOCKS = 6  # one in 64 by chance that an effect betters them all
_LEAST_ROWS = 10
_ROWS_EACH = 2  # for each parameter, so that some can be held out


def refuse_few_rows(model: ScenarioModel) -> None:
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


def refuse_short_logs(last: Fit, end: Survey) -> None:
    """Refuses to guess where there are too few independent pieces of data.

    They are counted in what nothing explains: while an effect is missing, residuals
    stay correlated for as long as it lasts, which says nothing of the log. Curves
    that may be more than chance are taken out, too, and the median over channels is
    taken, since one channel's wandering does not make the others' readings fewer.

    Args:
        last: the fit with all effects that were found.
        end: the survey beside it.

    Raises:
        DisasmError: there are too few; it says how much more is needed.
    """
    episode = last.model.measurements.episode
    rows = len(episode)
    left = _unexplained(last, end)
    lengths = [block_length(r[:, None], episode, most=0.5) for r in left.T]
    length = int(np.median(lengths))
    blocks = rows // length
    if blocks >= LEAST_BLOCKS:
        return
    needed = LEAST_BLOCKS * length
    raise DisasmError(
        f"the log is too short to decide: what is left of it stays correlated over "
        f"{length} of its {rows} rows, so it has {blocks} independent pieces, and "
        f"{LEAST_BLOCKS} are needed; record at least {needed - rows} rows more, at the "
        "same rate"
    )


def _unexplained(last: Fit, end: Survey) -> Array:
    """Returns the residual (rows, channels) beside all curves that may be in it."""
    residual = last.here.residual
    columns, found = curves(last.model)
    likely = [e.what for e in end.dependences if e.gain >= LEAST_GAIN]
    kept = [i for d in found if d in likely for i in d.columns]
    if not kept:
        return residual
    A = columns[..., kept].reshape(-1, len(kept))
    fit = A @ np.linalg.lstsq(A, residual.reshape(-1), rcond=None)[0]
    return np.asarray(residual - fit.reshape(residual.shape))

"""Whether a residual is white: what is correlated from row to row is no noise."""

import numpy as np

from sysid.fitting.fit import Fit
from sysid.identification.whiteness import ljung_box

_ALPHA = 0.001  # of one channel: there are up to a dozen


def correlated_channels(fit: Fit) -> tuple[str, ...]:
    """Returns the channels whose residual is correlated over rows.

    Rows nearer than the log's own filter reaches are correlated by that, and not
    compared. Of a noise that is stated, what is far below it is of no consequence.
    """
    model, residual = fit.model, fit.linearisation.residual
    step = max(1, model.filter_rows)
    found = []
    for number, channel in enumerate(model.measurements.channels):
        r = residual[::step, number]
        is_small = np.sqrt(np.mean(r**2)) < fit.noticeable(number)
        if len(r) > 2 and not is_small and ljung_box(r) < _ALPHA:
            found.append(channel.name)
    return tuple(found)

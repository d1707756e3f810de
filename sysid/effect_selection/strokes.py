"""Joints that hardly reverse in a log: it can't tell kinds of friction apart."""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from sysid.models.base import LogModel

_TURNS = 0.05  # of a joint's travel: by less it does not turn back
_POSITION = "position"  # the covariate of a joint's own motion


def joints_of_one_stroke(model: LogModel, joints: Collection[str]) -> tuple[str, ...]:
    """Returns those of some joints that move one way, or there and back, an episode.

    Args:
        model: whose channels are joints, each with its position as a covariate; of any
            other there are none.
        joints: their names.
    """
    found, episode = [], model.measurements.episode
    for number, channel in enumerate(model.measurements.channels):
        if channel.name in joints:
            q = model.covariates(number).get(_POSITION)
            if q is None:
                continue
            each = [q[episode == one] for one in np.unique(episode)]
            if all(_reversals(own) < 2 for own in each):
                found.append(channel.name)
    return tuple(found)


def _reversals(q: NDArray[np.float64]) -> int:
    """Returns how often a position (n,) turns back, by more than a share of its range.

    A cut that begins a few rows too early, or the noise of a rest, is no reversal.
    """
    least = _TURNS * np.ptp(q)
    return sum(len(find_peaks(way * q, prominence=least)[0]) for way in (1.0, -1.0))

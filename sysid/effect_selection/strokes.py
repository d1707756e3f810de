"""Joints that hardly reverse in a log: it can't tell kinds of friction apart."""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from sysid.effect_selection.settings import SelectionSettings
from sysid.models.base import LogModel

_VELOCITY = "velocity"  # the covariate of a joint's own motion


def joints_of_one_stroke(
    model: LogModel, joints: Collection[str], settings: SelectionSettings
) -> tuple[str, ...]:
    """Returns those of some joints that move one way only, or there and back once.

    Args:
        model: whose channels are joints, each with its velocity as a covariate; of any
            other there are none.
        joints: their names.
        settings: thresholds.
    """
    found = []
    for number, channel in enumerate(model.measurements.channels):
        if channel.name in joints:
            v = model.covariates(number).get(_VELOCITY)
            if v is not None and _reversals(v, settings) < 2:
                found.append(channel.name)
    return tuple(found)


def _reversals(v: NDArray[np.float64], settings: SelectionSettings) -> int:
    """Returns how often a velocity (n,) changes its sign, rests left out."""
    moving = v[np.abs(v) > settings.stroke_speed * np.abs(v).max()]
    return int(np.count_nonzero(np.diff(np.sign(moving))))

"""The wrench on the flange in place of a sensor's, by the arm's own estimate."""

import dataclasses
from collections.abc import Callable

import numpy as np

from drake_disasm.devices.iiwa.status import JOINTS, IiwaStatusMonitor
from drake_disasm.devices.reading import Reading


class EstimatedWrench:
    """Reads external torques in the arm's status as a sensor's client reads a wrench.

    Args:
        arm: whose status it is.
        reading: of a sensor on the flange (6,), [f; tau] in S, by joint angles (7,)
            [rad] and external torques (7,) [N m].
    """

    def __init__(
        self,
        arm: IiwaStatusMonitor,
        reading: Callable[[np.ndarray, np.ndarray], np.ndarray],
    ) -> None:
        self._arm, self._reading = arm, reading

    def start(self) -> None:
        """Does nothing: the arm's monitor listens anyway."""

    def stop(self) -> None:
        """Does nothing."""

    def read(self) -> Reading:
        """Returns the newest wrench (6,)."""
        newest = self._arm.read_with_external()
        values = np.full(6, np.nan)
        if np.isfinite(newest.values).all():
            q, external = newest.values[:JOINTS], newest.values[JOINTS:]
            values = self._reading(q, external)
        return dataclasses.replace(newest, values=values)

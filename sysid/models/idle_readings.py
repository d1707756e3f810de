"""What a sensor reads where nothing loads it: an offset, which moves no bolt."""

import dataclasses
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sysid.models.base import Array

#: Standard deviations of an average beyond which it is an offset: by chance three times
#: in a million logs of six channels.
_OFFSET = 5.0
_FREE = 3.0  # standard deviations of a force that may be none
_AROUND = 2  # steps before and after, whose readings count, too
_OF_MEDIAN = np.sqrt(np.pi / 2.0)  # its standard deviation, by that of the mean


@dataclasses.dataclass(frozen=True)
class IdleReadings:
    """The offset of a log's sensor as its episodes go on, by readings without a load.

    Each episode begins without one. It goes on without, as long as the force does not
    change: in the groove there may be a couple without a force, but not one that slides
    without friction. What the moment about the bolt's head is then is the sensor's own,
    as it warms up, say, and later the last that was seen. An offset within chance is
    taken for a load: the noise of a reading moves the bolt as far as that does.

    Attributes:
        is_free: of each episode, which readings (n,) are without a load.
        p_SoBo_S: (3,) the bolt's head in the sensor's frame [m].
        loads: (m, 6) what of the readings at each step is taken for a load, at So in S.
    """

    is_free: tuple[NDArray[np.bool_], ...]
    p_SoBo_S: Array
    loads: Array

    @classmethod
    def of(cls, readings: Sequence[Array], noise: Array, p_SoBo_S: Array) -> Self:
        """Returns what is an offset, and what is not, in a log.

        Args:
            readings: (n, 6) of each episode, [f; tau] at So in S.
            noise: (6,) of a reading.
            p_SoBo_S: (3,) see the class.
        """
        first = _first(readings)
        is_free = tuple(
            np.all(np.abs(each - first)[:, :3] <= _FREE * noise[:3], axis=1)
            for each in readings
        )
        found = cls(is_free, p_SoBo_S, np.zeros((max(map(len, readings)), 6)))
        lever = np.cross(p_SoBo_S, np.diag(noise[:3]))  # of each force, in its row
        moment = np.sqrt(noise[3:] ** 2 + np.sum(lever**2, axis=0))
        by_chance = _OFFSET * noise / np.sqrt(len(readings))
        loads = found.loads + np.where(np.abs(first) > by_chance, 0.0, first)
        later, counts = found._moments(readings)
        spread = _OFFSET * _OF_MEDIAN * moment / np.sqrt(counts)[:, None]
        loads[:, 3:] += np.where(np.abs(later) > spread, 0.0, later)
        return dataclasses.replace(found, loads=loads)

    def offsets(self, readings: Sequence[Array]) -> Array:
        """Returns the offset (m, 6) at each step of the episodes, at So in S.

        Args:
            readings: (n, 6) of each episode, maybe with some of it taken off already.
        """
        moments, _ = self._moments(readings)
        return _first(readings) + np.pad(moments, ((0, 0), (3, 0))) - self.loads

    def _moments(self, readings: Sequence[Array]) -> tuple[Array, NDArray[np.int64]]:
        """Returns the moment (m, 3) of idle readings at each step, since the first.

        And of how many readings (m,) it is the median.
        """
        count, first = len(self.loads), _first(readings)
        changes = np.full((len(readings), count, 3), np.nan)
        for own, each, free in zip(changes, readings, self.is_free, strict=True):
            f, tau = np.hsplit(each - first, 2)
            own[: len(each)][free] = (tau - np.cross(self.p_SoBo_S, f))[free]
        found, counts = np.zeros((count, 3)), np.ones(count, np.int64)
        for k in range(1, count):
            near = changes[:, max(1, k - _AROUND) : k + 1 + _AROUND].reshape(-1, 3)
            near = near[~np.isnan(near[:, 0])]
            found[k], counts[k] = found[k - 1], counts[k - 1]
            if len(near):
                found[k], counts[k] = np.median(near, axis=0), len(near)
        return found, counts


def _first(readings: Sequence[Array]) -> Array:
    """Returns the episodes' first readings on average (6,)."""
    return np.mean([each[0] for each in readings], axis=0)

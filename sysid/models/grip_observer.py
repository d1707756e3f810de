"""How far the grip gives as a step begins, of the step before as a model has it."""

import dataclasses
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.systems.observation import Mounting
from sysid.models.base import Array
from sysid.models.grip_state import GripState
from sysid.models.sensor_reading import at_bolt
from sysid.models.transitions import Transitions

_SURE = 3.0  # standard deviations: by chance one in four hundred
_BY_CHANCE = 22.5  # of the squares of six standard normal variables: once in a thousand
#: Standard deviation of a standard normal variable once it is shrunk: of (m - 1 / m)^2
#: where |m| > 1, the mean is 4 (phi(1) - Q(1)).
_OF_NOISE = 0.577


@dataclasses.dataclass(frozen=True)
class Led:
    """Where a model leads some steps.

    Attributes:
        give: (n, 6) by how much the grip gives at their ends, in coordinates.
        states: (n, 12) there, the wrench at So in S, without effects on the sensor.
    """

    give: Array
    states: Array


@dataclasses.dataclass(frozen=True)
class GripObserver:
    """Estimates how a step begins from a model of the step before, and the wrench.

    Between two readings `GripState` takes the wrench for linear in time. It is not
    where the force on the bolt jumps as a step begins: a drag that grows with the
    commanded velocity, friction that turns with the sliding. The springs, which lag by
    half a step, then carry up to half of the jump more or less. A model of that step
    has the jump in it. What it misses of the wrench at the step's end is taken to have
    grown evenly, and is believed as far as it exceeds the sensor's noise: the mean of a
    normal variable with an unknown mean, shrunk by its positive part (James and Stein
    1961), b = max(0, 1 - (sigma / m)^2) m of what is missed, m.

    Attributes:
        grip: that lags.
        noise: (6,) of the sensor's readings.
        mounting: of the sensor.
    """

    grip: GripState
    noise: Array
    mounting: Mounting

    @classmethod
    def of(cls, whole: Transitions, noise: Array, mounting: Mounting) -> Self:
        """Returns the observer of a log.

        Args:
            whole: all transitions.
            noise: (6,) of the sensor's readings.
            mounting: of the sensor.
        """
        return cls(whole.episodes[0].grip, noise, mounting)

    def corrected(
        self, whole: Transitions, ends: NDArray[np.int64], led: Led, read: Array
    ) -> Transitions:
        """Returns all transitions, some of which begin where the step before led.

        Others are left as they are: after a step of which the model has no balance, or
        says less of the wrench than that it stays as it was.

        Args:
            whole: all transitions.
            ends: (n,) numbers of those that begin where the others end.
            led: where the n steps before them lead.
            read: (steps, 12) states that were measured as all steps begin, without
                effects.
        """
        change = (read[ends] - read[ends - 1])[:, 6:]
        missed = (read[ends] - led.states)[:, 6:]
        excess = np.sum((missed / self.noise) ** 2 - (change / self.noise) ** 2, axis=1)
        is_known = excess < _BY_CHANCE  # and a number
        ends, missed, give = ends[is_known], missed[is_known], led.give[is_known]
        read = read[ends]
        believed = shrunk(missed, self.noise)
        elastic = self.grip.carried(give)
        elastic += self.grip.after_growth(self._on_bolt(read, believed))
        wrench = self._on_bolt(read, led.states[is_known, 6:] + believed)
        return whole.beginning(ends, elastic, self.grip.rates(elastic, wrench))

    def change(self, one: Transitions, other: Transitions) -> Array:
        """Returns how differently the grip begins (n, 6), in units of what is known.

        That is the standard deviation of what `GripState` makes of noise, at the pads.
        """
        change = (one.steps.wrench - other.steps.wrench) @ self.grip.to_grip.T
        return np.asarray(
            change / self.grip.scatter(self.noise, self.mounting, of_growth=False)
        )

    def changed(self, one: Transitions, other: Transitions) -> NDArray[np.bool_]:
        """Returns which steps (n,) surely begin differently."""
        return np.asarray(np.abs(self.change(one, other)).max(axis=1) > _SURE)

    def uncertain(self, whole: Transitions, signs: Array) -> Transitions:
        """Returns all transitions, which begin elsewhere by a standard deviation.

        By that of what is believed of noise.

        Args:
            whole: all transitions.
            signs: (steps, 6) to which side, along and about the axes of the pads.
        """
        sigma = self.grip.scatter(_OF_NOISE * self.noise, self.mounting, of_growth=True)
        away = self.grip.from_pads(signs * sigma)
        rates = self.grip.rates(away, np.zeros_like(away))
        steps, every = whole.steps, np.arange(len(whole.steps))
        return whole.beginning(every, steps.wrench + away, steps.give_rate + rates)

    def _on_bolt(self, states: Array, wrench: Array) -> Array:
        """Returns wrenches (n, 6) at Bo in Gn, of those at So in S."""
        return at_bolt(np.hstack([states[:, :6], wrench]), self.mounting)[:, 6:]


def shrunk(missed: Array, noise: Array) -> Array:
    """Returns how much of what is missed is believed: see `GripObserver`."""
    share = 1.0 - (noise / np.maximum(np.abs(missed), noise)) ** 2
    return np.asarray(share * missed)

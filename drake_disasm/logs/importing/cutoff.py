"""The cut-off that a motion asks for.

A motion's acceleration fades towards high frequencies; that of noise, whether of
rounding, of jitter or of an encoder, grows. Between the two the spectrum of the
acceleration has a valley. A filter that cuts below it loses motion, one that cuts above
it passes noise, and neither should come to more than a hundredth of the variance:
regressors with that much noise bias an inertia by a hundredth (errors in variables:
Fuller, 1987, section 1.1).
"""

import dataclasses
import functools
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from drake_disasm.logs.importing.signals import LARGEST_CUTOFF

Array = NDArray[np.float64]

_SHARE = 0.01  # of a variance: what may be lost, or be noise
#: A square wave, as dry friction is of a velocity, has all but that share of its
#: variance below this multiple of its frequency: 8 / pi^2 sum of 1 / k^2, k odd.
_HARMONICS = 40.0
_NOISE_GROWS = 5.0  # of white noise f^4, times f, to its integral
_SEGMENTS = 3  # of the longest stretch, half of it each, that overlap by half
_WINDOW = "blackmanharris"  # a slow motion is 1e9 times as strong as its noise
_FEWEST = 16  # rows of a segment
_TOP = 0.95  # of the Nyquist frequency: the spectrum of a window ends there


@dataclasses.dataclass(frozen=True)
class MotionSpectrum:
    """Of one joint's position, with the frequencies that a cut-off depends on.

    Attributes:
        joint: its number.
        frequency: (n,) [Hz].
        density: (n,) of the acceleration.
        valley: number of the frequency at which noise takes over from the motion.
    """

    joint: int
    frequency: Array
    density: Array
    valley: int

    @property
    def motion(self) -> float:
        """The frequency that all but a hundredth of the acceleration lies below."""
        return self._reached(self._variance, 1.0 - _SHARE)

    @property
    def noise(self) -> float:
        """The frequency at which noise has come to a hundredth of the acceleration."""
        return self._reached(self._variance, 1.0 + _SHARE)

    @property
    def friction(self) -> float:
        """The frequency that dry friction of this motion lies below."""
        speed = np.cumsum(self.density / self.frequency**2)
        return _HARMONICS * self._reached(speed, 1.0 - _SHARE)

    @functools.cached_property
    def is_resolved(self) -> bool:
        """Whether the motion stands out of the noise, which is most at the valley."""
        at = _smoothed(self.frequency, self.density)[self.valley]
        below = at * self.frequency[self.valley] / _NOISE_GROWS
        step = self.frequency[1] - self.frequency[0]
        return bool(below <= _SHARE * step * self._variance[self.valley])

    def noise_share(self, cutoff: float) -> float:
        """Returns the noise in what a filter passes, as a share of its rms."""
        number = int(np.searchsorted(self.frequency, cutoff))
        passed = self._variance[min(number, len(self.frequency) - 1)]
        noise = passed - self._variance[self.valley]
        return float(np.sqrt(max(noise, 0.0) / passed)) if passed > 0.0 else 0.0

    @functools.cached_property
    def _variance(self) -> Array:
        """(n,) up to each frequency, in steps of the frequency."""
        return np.cumsum(self.density)

    def _reached(self, total: Array, share: float) -> float:
        """Returns where [Hz] a sum (n,) is a share of what it is at the valley."""
        number = int(np.searchsorted(total, share * total[self.valley]))
        return float(self.frequency[min(number, len(total) - 1)])


def motion_spectra(stretches: Sequence[Array], period: float) -> list[MotionSpectrum]:
    """Returns the spectra of the joints that move.

    Args:
        stretches: of one recording, each (n, k) evenly spaced positions. Those shorter
            than half of the longest can't be resolved as well, and are left out.
        period: of their rows [s].
    """
    longest = max(len(q) for q in stretches)
    rows = min(longest, max(_FEWEST, 2 * longest // (_SEGMENTS + 1)))
    used = [q for q in stretches if len(q) >= rows]
    found = []
    for joint in range(used[0].shape[1]):
        columns = [q[:, joint] for q in used]
        if any(np.ptp(column) > 0.0 for column in columns):
            found.append(_spectrum(joint, columns, period, rows))
    return [each for each in found if each is not None]


def chosen_cutoff(spectra: Iterable[MotionSpectrum], period: float) -> float:
    """Returns the cut-off [Hz] of one filter for all joints of all recordings.

    As high as the noise of any joint permits, up to where even friction would have no
    more to show, but not so low that any joint's motion is cut. Joints whose motion
    does not stand out of their noise have no say.

    Args:
        spectra: by `motion_spectra`.
        period: of the rows [s].
    """
    found = list(spectra)
    spectra = [each for each in found if each.is_resolved] or found
    largest = LARGEST_CUTOFF * 0.5 / period
    if not spectra:
        return largest
    noise = min(each.noise for each in spectra)
    friction = max(each.friction for each in spectra)
    motion = max(each.motion for each in spectra)
    return min(max(min(noise, friction), motion), largest)


def _spectrum(
    joint: int, stretches: Sequence[Array], period: float, rows: int
) -> MotionSpectrum | None:
    """Returns a joint's spectrum; None if it is noise up to the last frequency."""
    frequency: Array = np.asarray(np.fft.rfftfreq(rows, period)[1:], float)
    density = np.zeros(len(frequency))
    for position in stretches:
        n = len(position)
        swing = position - np.linspace(position[0], position[-1], n)
        density += n * welch(swing, 1.0 / period, _WINDOW, rows)[1][1:]
    within = np.cumsum(density) >= (1.0 - _SHARE) * np.sum(density)
    beyond = np.flatnonzero(within & (frequency <= _TOP * frequency[-1]))
    if not len(beyond):
        return None
    density *= (2.0 * np.pi * frequency) ** 4
    smooth = _smoothed(frequency, density)
    valley = int(beyond[np.argmin(smooth[beyond])])
    return MotionSpectrum(joint, frequency, density, valley)


def _smoothed(frequency: Array, density: Array) -> Array:
    """Returns the mean over an octave on either side of each frequency."""
    ends = np.searchsorted(frequency, np.outer((0.5, 2.0), frequency))
    total = np.concatenate([[0.0], np.cumsum(density)])
    low, high = ends[0], np.maximum(ends[1], ends[0] + 1)
    return np.asarray((total[high] - total[low]) / (high - low))

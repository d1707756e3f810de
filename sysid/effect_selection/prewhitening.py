"""Prewhitening: takes out of residuals what their own past predicts.

Residuals of real devices are correlated from row to row, and a block of rows has to be
longer than that to be evidence of its own. Filtered by an autoregressive model of each
channel, as in feasible generalised least squares (Cochrane and Orcutt 1949, Prais and
Winsten 1954), they and the columns that may explain them need short blocks only.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from sysid.effect_selection.settings import SelectionSettings
from sysid.identification.linearisation import Linearisation
from sysid.identification.uncertainty import block_numbers
from sysid.objective import huber_weights

Array = NDArray[np.float64]

_MOST = 0.9999  # of a reflection coefficient: the filter stays stable


@dataclass(frozen=True)
class ArFilter:
    """Prediction errors of a channel by an autoregressive model of it.

    Errors at an episode's begin are those of the lower orders, scaled to the same
    variance. The filter leaves the power of what it was made from as it is, so that
    channels keep their weights.

    Attributes:
        predictors: for each order m from 0 on, (m + 1,) weights of a row and its past.
        variances: of their errors.
    """

    predictors: tuple[Array, ...]
    variances: tuple[float, ...]

    @classmethod
    def of(
        cls,
        parts: Sequence[Array],
        most: int,
        *,
        fitted: float = 0.0,
        errors: float = 0.0,
    ) -> Self:
        """Returns the filter that Burg's method gives; its order is Akaike's.

        The first coefficient, how slow residuals are, decides whether a slow effect
        passes for noise or noise for a slow effect. Its estimate is short of the truth
        by about (1 + 3 rho) / n (Kendall 1954), and more if parameters were fitted.

        Args:
            parts: residuals (n,) of each episode.
            most: greatest order.
            fitted: number of parameters that the residuals were fitted by.
            errors: standard errors that are added to the first coefficient.
        """
        rows = sum(len(part) for part in parts)
        power = sum(float(part @ part) for part in parts) / max(rows, 1)
        predictor, variance = np.ones(1), power
        predictors, variances = [predictor], [variance]
        ahead, behind = list(parts), list(parts)
        for order in range(1, most + 1 if power > 0.0 else 1):
            ahead, behind = [f[1:] for f in ahead], [b[:-1] for b in behind]
            crossed = sum(float(f @ b) for f, b in zip(ahead, behind, strict=True))
            size = sum(float(f @ f) for f in ahead) + sum(float(b @ b) for b in behind)
            if size <= 0.0:
                break
            k = -2.0 * crossed / size
            if order == 1:
                k = -_slowest(-k, rows, fitted, errors)
            k = float(np.clip(k, -_MOST, _MOST))
            padded = np.append(predictor, 0.0)
            predictor = padded + k * padded[::-1]
            variance *= 1.0 - k**2
            pairs = list(zip(ahead, behind, strict=True))
            ahead = [f + k * b for f, b in pairs]
            behind = [b + k * f for f, b in pairs]
            predictors.append(predictor)
            variances.append(variance)
        end = _akaike_order(variances, rows) + 1
        return cls(tuple(predictors[:end]), tuple(variances[:end]))

    @property
    def order(self) -> int:
        """How many rows back it looks."""
        return len(self.predictors) - 1

    def __call__(self, x: Array) -> Array:
        """Returns an episode's rows (n, ...) filtered along their first axis."""
        if not self.order or not x.size:
            return x
        scales = np.sqrt(self.variances[0] / np.array(self.variances))
        filtered = scales[-1] * lfilter(self.predictors[-1], np.ones(1), x, axis=0)
        for row in range(min(self.order, len(x))):
            past = x[row::-1]
            filtered[row] = scales[row] * np.tensordot(self.predictors[row], past, 1)
        return np.asarray(filtered)


@dataclass(frozen=True)
class Prewhitening:
    """Means of some rows, and a filter for each channel, within each episode.

    Attributes:
        filters: of the channels.
        cells: (rows,) number of the cell that each row is averaged in.
        episode: (cells,) number of each cell's episode.
    """

    filters: tuple[ArFilter, ...]
    cells: NDArray[np.int64]
    episode: NDArray[np.int64]

    @classmethod
    def of(
        cls,
        residual: Array,
        episode: NDArray[np.int64],
        huber_delta: float,
        settings: SelectionSettings,
        columns: Sequence[Array] = (),
        fitted: int = 0,
    ) -> Self:
        """Returns what whitens a residual.

        Args:
            residual: (rows, channels).
            episode: (rows,) number of each row's episode.
            huber_delta: residual beyond which rows have less weight: one row that is
                missed by far says nothing of how rows are correlated.
            settings: greatest order.
            columns: (rows, channels, k) each, derivatives by what may be in the
                residual, which tell how fast that changes; none if it is not known.
            fitted: number of parameters that all channels were fitted by.
        """
        bent = residual * huber_weights(residual, huber_delta)
        cells = _cells(bent, columns, episode, settings)
        means, of_cell = _means(bent, cells), episode[_begins(cells)]
        most = min(settings.max_ar_order, len(means) // settings.cells_per_ar_order)
        filters = tuple(
            ArFilter.of(
                [channel[part] for part in _episodes(of_cell)],
                most,
                fitted=fitted / means.shape[1],
                errors=settings.ar_errors,
            )
            for channel in means.T
        )
        return cls(filters, cells, of_cell)

    def whitened(self, linearisation: Linearisation) -> Linearisation:
        """Returns residuals and derivatives of the cells, with weights of their own."""
        residual = self(linearisation.residual)
        return dataclasses.replace(
            linearisation,
            residual=residual,
            jacobian=self(linearisation.jacobian),
            weights=huber_weights(residual, linearisation.huber_delta),
        )

    def __call__(self, values: Array) -> Array:
        """Returns values (rows, channels, ...) averaged and filtered, (cells, ...)."""
        found = _means(values, self.cells)
        for part in _episodes(self.episode):
            for number, own in enumerate(self.filters):
                found[part, number] = own(found[part, number])
        return found


def _cells(
    residual: Array,
    columns: Sequence[Array],
    episode: NDArray[np.int64],
    settings: SelectionSettings,
) -> NDArray[np.int64]:
    """Returns the cell (rows,) of each row: as long as means keep residuals' power.

    A residual that is sampled far more often than it changes is decimated, as is usual
    in the identification of arms (Gautier 1997): else its model is of frequencies
    at which filters have left nothing. Where columns are as slow, white noise upon it,
    a sensor's own, is averaged, too: no autoregressive model of a usual order knows
    both, and what is slow would pass for an effect.
    """
    power = np.mean(residual**2, axis=0)
    # Neighbours have in common what is slow; their mean loses half of what is white.
    white = 2.0 * (power - _kept_power(residual, block_numbers(episode, 2)))
    white = np.clip(white, 0.0, power)
    slow = power - white
    error = settings.ar_errors * np.sqrt(white * power / len(residual))
    is_used, is_slow = power > 0.0, slow > error
    found = [(np.arange(len(episode)), True)]
    for length in settings.cell_lengths:
        cells = block_numbers(episode, length)
        if cells[-1] + 1 < settings.min_cells:
            break
        kept = _kept_power(residual, cells)
        is_kept = not (kept < settings.cell_power * power)[is_used].any()
        lost = kept - white / length < settings.cell_power * slow - error
        if not is_kept and (lost[is_slow].any() or not is_slow.any()):
            break
        found.append((cells, is_kept))
    while not (found[-1][1] or _are_smooth(columns, found[-1][0], settings)):
        found.pop()
    return found[-1][0]


def _are_smooth(
    columns: Sequence[Array], cells: NDArray[np.int64], settings: SelectionSettings
) -> bool:
    """Returns whether means of cells keep the power of columns: of nearly all of them.

    Some of a whole library may be faster: friction that falls with speed within a
    moment of a reversal.
    """
    if not columns:
        return False
    parts = [_kept_and_power(each, cells) for each in columns]
    kept, power = np.concatenate(parts, axis=1)
    used = power > 0.0
    share = kept[used] / power[used]
    is_kept = share >= settings.cell_power
    return bool(used.any() and is_kept.mean() >= settings.cell_power)


def _kept_and_power(columns: Array, cells: NDArray[np.int64]) -> Array:
    """Returns the power (2, k) of columns (rows, channels, k), in means and in all."""
    kept, power = np.zeros((2, columns.shape[2]))
    for channel in range(columns.shape[1]):  # one at a time: of hundreds of columns
        own = columns[:, channel]
        kept += _kept_power(own, cells)
        power += np.einsum("nk,nk->k", own, own) / len(own)
    return np.stack([kept, power])


def _kept_power(values: Array, cells: NDArray[np.int64]) -> Array:
    """Returns the power (k,) of values (rows, k) whose cells are taken for means."""
    sizes = np.bincount(cells)[:, None]
    kept = np.sum(sizes * _means(values, cells) ** 2, axis=0) / len(values)
    return np.asarray(kept)


def _means(values: Array, cells: NDArray[np.int64]) -> Array:
    """Returns the mean (cells, ...) of the values (rows, ...) of each cell."""
    begins = _begins(cells)
    sizes = np.diff(begins, append=len(cells))
    sums = np.add.reduceat(values, begins, axis=0)
    return np.asarray(sums / sizes.reshape(-1, *[1] * (values.ndim - 1)))


def _begins(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.flatnonzero(np.diff(cells, prepend=-1))


def _akaike_order(variances: Sequence[float], rows: int) -> int:
    """Returns the order whose error's variance is worth its coefficients."""
    fit = rows * np.log(np.maximum(variances, 1e-300))
    return int(np.argmin(fit + 2.0 * np.arange(len(variances))))


def _slowest(rho: float, rows: int, fitted: float, errors: float) -> float:
    """Returns the upper end of what rows' correlation with the next may be."""
    if rho <= 0.0:
        return rho
    bias = (1.0 + 3.0 * rho + fitted * (1.0 + rho) / 2.0) / rows
    return rho + bias + errors * float(np.sqrt(max(1.0 - rho**2, 0.0) / rows))


def _episodes(episode: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Returns the rows of each episode."""
    return [np.flatnonzero(episode == number) for number in np.unique(episode)]

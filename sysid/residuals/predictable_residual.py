"""How much of a residual could be explained at all: a bound, by a flexible learner.

Gradient-boosted trees see motion, load, time and their recent past, and nothing of
physics. What they predict of rows that they were not fitted to is there to be
explained, whether or not the library has an effect for it. Where they find nothing,
there may still be something: a bound is as good as its learner.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.stats import wilcoxon
from sklearn.ensemble import (  # type: ignore[import-untyped]
    HistGradientBoostingRegressor,
)
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from sysid.fitting.fit import Fit
from sysid.models.base import HUBER_DELTA
from sysid.objective import pseudo_residual

Array = NDArray[np.float64]

_ROWS = 1000  # more are thinned out evenly: a channel then takes a third of a second
_LAGS = (1, 4, 16)  # rows back in time, at which quantities are seen, too
_ALPHA = 0.001  # of one channel: there are up to a dozen
_IMPORTANCE = 0.25  # of what the most important quantity is worth, to be listed
FOLDS = 5  # contiguous, so that time can't be read off
_SHOWN = 3  # quantities that a text lists: a size of output, no threshold


@dataclass(frozen=True)
class Learner:
    """Boosted trees: a standard model of a small table, near scikit-learn's defaults.

    Attributes:
        rate: shrinkage of each tree.
        trees: number of them.
        leaves: of a tree: interactions of up to three quantities.
        leaf_rows: rows in a leaf.
    """

    rate: float = 0.15
    trees: int = 50
    leaves: int = 8
    leaf_rows: int = 20


LEARNER = Learner()


@dataclass(frozen=True)
class PredictableResidual:
    """What a flexible learner explains of a channel that the effects leave.

    Attributes:
        channel: its name.
        share: of the mean squared residual, in rows that were not fitted.
        size: rms of what it explains, in the channel's unit.
        unit: of the channel.
        depends_on: the quantities that it needs for that, the most important first.
    """

    channel: str
    share: float
    size: float
    unit: str
    depends_on: tuple[str, ...]


@dataclass(frozen=True)
class _Inputs:
    """What the learner sees of a channel's rows.

    Attributes:
        values: (rows, k).
        names: of the quantity that each column (k,) is, or was a while ago.
    """

    values: Array
    names: NDArray[np.str_]

    @classmethod
    def of(
        cls,
        own: Mapping[str, Array],
        other: Mapping[str, Array],
        episode: NDArray[np.int64],
    ) -> Self:
        """Returns quantities (rows,) by name, and the recent past of some.

        Args:
            own: those whose past is seen, too.
            other: those as they are now.
            episode: (rows,) of each row; there is no past before it.
        """
        columns = [*other.values(), *own.values()]
        names = [*other, *own]
        for back in _LAGS:
            before = _rows_before(episode, back)
            columns += [values[before] for values in own.values()]
            names += own
        return cls(np.column_stack(columns), np.array(names))

    def select(self, mask: NDArray[np.bool_]) -> Self:
        """Returns the rows where a mask (rows,) is true."""
        return type(self)(self.values[mask], self.names)


def predictable_residual(fit: Fit) -> list[PredictableResidual]:
    """Returns what a flexible learner explains of each channel's residual.

    Of channels where that is significant (by contiguous folds that were not fitted,
    and blocks within them; Bonferroni over the channels) and more than a small share.
    """
    measured, settings = fit.model.measurements, fit.settings
    kept = every_few(measured.rows, _ROWS)
    blocks = fit.blocks[kept]
    folds = contiguous_blocks(blocks, FOLDS)
    sigma = np.broadcast_to(measured.sigma, measured.values.shape)
    covariates = [fit.model.covariates(n) for n in range(len(measured.channels))]
    found = []
    for number, channel in enumerate(measured.channels):
        inputs = _inputs_of(fit, number, covariates).select(kept)
        target = pseudo_residual(fit.linearisation.residual[kept, number], HUBER_DELTA)
        learned = _Learned.of(inputs, target, folds)
        gains = np.bincount(blocks, learned.gain).astype(float)
        share = float(gains.sum() / max(np.sum(target**2), 1e-300))
        p = len(measured.channels) * _gained_p(gains)
        if share < settings.min_left_over or p >= _ALPHA:
            continue
        if gains.sum() < fit.noticeable(number) ** 2 * len(target):
            continue
        size = float(np.sqrt(np.mean((learned.predicted * sigma[kept, number]) ** 2)))
        needed = learned.depends_on(inputs, target, folds)
        found.append(
            PredictableResidual(channel.name, share, size, channel.unit, needed)
        )
    return found


@dataclass(frozen=True)
class _Learned:
    """What learners predict of the folds that they were not fitted to.

    Attributes:
        learners: one for each fold.
        predicted: (rows,).
        gain: (rows,) by which squared residuals fall.
    """

    learners: Sequence[HistGradientBoostingRegressor]
    predicted: Array
    gain: Array

    @classmethod
    def of(
        cls,
        inputs: _Inputs,
        target: Array,
        folds: NDArray[np.int64],
    ) -> Self:
        """Returns learners of a residual (rows,), each fitted to all folds but one."""
        learners, predicted = [], np.zeros_like(target)
        with threadpool_limits(1):  # threads cost more than they gain on so few rows
            for fold in range(int(folds.max()) + 1):
                out = folds == fold
                learner = _learner().fit(inputs.values[~out], target[~out])
                predicted[out] = learner.predict(inputs.values[out])
                learners.append(learner)
        gain = target**2 - (target - predicted) ** 2
        return cls(learners, predicted, gain)

    def depends_on(
        self, inputs: _Inputs, target: Array, folds: NDArray[np.int64]
    ) -> tuple[str, ...]:
        """Returns the quantities without which the gain is lost, the first the most.

        Each is shuffled within the folds that were not fitted (Breiman 2001). Those
        count that are worth a share of the first.
        """
        random, lost = np.random.default_rng(0), {}
        for name in dict.fromkeys(inputs.names.tolist()):
            shuffled = inputs.values.copy()
            columns = np.flatnonzero(inputs.names == name)
            worse = 0.0
            for fold, learner in enumerate(self.learners):
                out = np.flatnonzero(folds == fold)
                mixed = random.permutation(out)
                shuffled[np.ix_(out, columns)] = inputs.values[np.ix_(mixed, columns)]
                error = target[out] - learner.predict(shuffled[out])
                worse += float(np.sum(error**2 - (target - self.predicted)[out] ** 2))
            lost[name] = worse
        most = max(lost.values())
        ranked = sorted(lost, key=lambda name: -lost[name])
        return tuple(n for n in ranked[:_SHOWN] if lost[n] >= _IMPORTANCE * most)


def _learner() -> HistGradientBoostingRegressor:
    return HistGradientBoostingRegressor(
        learning_rate=LEARNER.rate,
        max_iter=LEARNER.trees,
        max_leaf_nodes=LEARNER.leaves,
        min_samples_leaf=LEARNER.leaf_rows,
        early_stopping=False,
        random_state=0,
    )


def _gained_p(gains: Array) -> float:
    """Returns the p-value that blocks gain (B,) by chance, by their signed ranks."""
    changed = gains[np.abs(gains) > 0.0]
    if not len(changed):
        return 1.0
    return float(wilcoxon(changed, alternative="greater").pvalue)


def _inputs_of(
    fit: Fit, channel: int, covariates: Sequence[Mapping[str, Array]]
) -> _Inputs:
    """Returns what may explain a channel: its own covariates, load, and the others'.

    Args:
        fit: whose residual it is.
        channel: its number.
        covariates: of each channel; the others' count where they are not this one's.
    """
    measured = fit.model.measurements
    other = {
        f"{name} of {each.name}": values
        for each, known in zip(measured.channels, covariates, strict=True)
        for name, values in known.items()
        if not np.array_equal(values, covariates[channel].get(name, np.zeros(0)))
    }
    load = measured.predicted(fit.linearisation.residual)[:, channel]
    own = {**covariates[channel], "the load": load}
    own.setdefault("time", np.arange(measured.rows, dtype=float))
    return _Inputs.of(own, other, measured.episode)


def _rows_before(episode: NDArray[np.int64], back: int) -> NDArray[np.int64]:
    """Returns the row (rows,) that lies before each; an episode's first at most."""
    first = np.searchsorted(episode, episode)
    return np.asarray(np.maximum(np.arange(len(episode)) - back, first))


def every_few(rows: int, most: int) -> NDArray[np.bool_]:
    """Returns which rows (rows,) are kept, evenly."""
    return np.asarray(np.arange(rows) % max(1, -(-rows // most)) == 0)


def contiguous_blocks(blocks: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    """Returns the fold (rows,) of each row: contiguous runs of whole blocks.

    A learner that sees time could read slow noise from blocks on either side.
    """
    known, number = np.unique(blocks, return_inverse=True)
    return np.asarray(number * min(most, len(known)) // len(known))

"""A learned model of what the effects leave: better predictions, no explanation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import (  # type: ignore[import-untyped]
    GradientBoostingRegressor,
)

from drake_disasm.effects import Effect
from drake_disasm.effects.learned import BoostedTrees, LearnedFunctions
from sysid.fitting.candidates import extended
from sysid.fitting.fit import Fit
from sysid.models.base import HUBER_DELTA, LogModel
from sysid.objective import pseudo_residual
from sysid.residuals.predictable_residual import (
    FOLDS,
    LEARNER,
    PredictableResidual,
    contiguous_blocks,
    every_few,
)

Array = NDArray[np.float64]

_ROWS = 5000  # more are thinned out evenly: a channel then takes a second
_LEAST_GAIN = 0.1  # of the held-out error: a residual model that gains less is no use


@dataclass(frozen=True)
class ChannelError:
    """The error of a channel in rows that were not fitted.

    Attributes:
        channel, unit: its name and unit.
        before, after: rms without and with the residual model.
    """

    channel: str
    unit: str
    before: float
    after: float

    @property
    def gain(self) -> float:
        """The share by which the error falls."""
        return 1.0 - self.after / self.before if self.before > 0.0 else 0.0


@dataclass(frozen=True)
class ResidualModel:
    """Learned functions that take the place of an effect that nobody knows.

    Attributes:
        kind: of effect that applies them.
        functions: of each channel that gains by them.
        errors: of those channels.
    """

    kind: type[Effect]
    functions: LearnedFunctions
    errors: tuple[ChannelError, ...]

    def effect(self, file: str) -> Effect:
        """Returns the effect that applies functions saved to a file."""
        return self.kind(file=file, share=1.0)  # type: ignore[call-arg]

    @property
    def text(self) -> str:
        """What it gains, in words."""
        each = ", ".join(
            f"{e.channel} {e.before:.2g} -> {e.after:.2g} {e.unit}" for e in self.errors
        )
        return f"a residual model, learned and not physical: {each}"


def fit_residual_model(
    last: Fit, left: Sequence[PredictableResidual], held_out: LogModel | None
) -> ResidualModel | None:
    """Returns a model of what the effects leave, if it lowers the held-out error.

    Of channels of which a learner found something, by what an effect can know of them.

    Args:
        last: the fit with the effects.
        left: what a flexible learner found.
        held_out: model of the held-out episodes; None if there are none: then
            contiguous folds are predicted by what all others teach.
    """
    kind = last.model.residual_effect
    channels = [c.name for c in last.model.measurements.channels]
    wanted = [channels.index(x.channel) for x in left] if kind else []
    known = last.model.residual_inputs(last.theta) if wanted else {}
    test = _Rows.held_out(last, held_out) if wanted and held_out else None
    rows = _Rows.fitted(last, known)
    outputs, errors = {}, []
    for number in (n for n in wanted if channels[n] in known):
        name = channels[number]
        learned = rows.learned(number, name)
        error = (
            test.error(number, name, learned)
            if test
            else rows.cross_error(number, name)
        )
        if error.gain >= _LEAST_GAIN:
            outputs[name] = learned
            errors.append(error)
    if kind is None or not outputs:
        return None
    functions = LearnedFunctions(kind.inputs, outputs)  # type: ignore[attr-defined]
    return ResidualModel(kind, functions, tuple(errors))


@dataclass(frozen=True)
class _Rows:
    """Rows of a log, with what may explain them.

    Attributes:
        model: of them.
        inputs: (rows, k) by channel.
        missing: (rows, channels) measured minus predicted, SI.
        blocks: (rows,) longer than the residual stays correlated.
    """

    model: LogModel
    inputs: Mapping[str, Array]
    missing: Array
    blocks: NDArray[np.int64]

    @classmethod
    def fitted(cls, fit: Fit, inputs: Mapping[str, Array]) -> "_Rows":
        """Returns the rows of a fit, single ones of them not counted in full."""
        residual = pseudo_residual(fit.linearisation.residual, HUBER_DELTA)
        missing = -residual * fit.model.measurements.sigma
        return cls(fit.model, inputs, missing, fit.blocks)

    @classmethod
    def held_out(cls, fit: Fit, rows: LogModel) -> "_Rows":
        """Returns rows that a fit has not seen, predicted by it."""
        model, _ = extended(rows, fit.effects, with_shapes=True)
        model = model.with_begins(fit.theta)
        missing = model.measurements.values - model.predictions(fit.theta)
        inputs = model.residual_inputs(fit.theta)
        return cls(model, inputs, missing, model.measurements.episode)

    def learned(self, channel: int, name: str) -> BoostedTrees:
        """Returns what a channel's rows teach."""
        return _taught(self.inputs[name], self.missing[:, channel])

    def error(self, channel: int, name: str, learned: BoostedTrees) -> ChannelError:
        """Returns a channel's error without and with what other rows taught."""
        missing = self.missing[:, channel]
        return self._error(channel, missing - learned(self.inputs[name]))

    def cross_error(self, channel: int, name: str) -> ChannelError:
        """Returns a channel's error where each fold is predicted by all others."""
        folds = contiguous_blocks(self.blocks, FOLDS)
        inputs, missing = self.inputs[name], self.missing[:, channel]
        left = missing.copy()
        for fold in range(int(folds.max()) + 1):
            out = folds == fold
            left[out] -= _taught(inputs[~out], missing[~out])(inputs[out])
        return self._error(channel, left)

    def _error(self, channel: int, left: Array) -> ChannelError:
        each = self.model.measurements.channels[channel]
        before, after = (
            float(np.sqrt(np.mean(values**2)))
            for values in (self.missing[:, channel], left)
        )
        return ChannelError(each.name, each.unit, before, after)


def _taught(inputs: Array, missing: Array) -> BoostedTrees:
    """Returns what rows of inputs (n, k) teach of what is missing (n,) there."""
    kept = every_few(len(inputs), _ROWS)
    learner = _learner().fit(inputs[kept], missing[kept])
    return _trees(learner, inputs[kept])


def _learner() -> GradientBoostingRegressor:
    """Returns boosted trees whose nodes scikit-learn shows, to be written to a file."""
    return GradientBoostingRegressor(
        learning_rate=LEARNER.rate,
        n_estimators=LEARNER.trees,
        max_leaf_nodes=LEARNER.leaves,
        min_samples_leaf=LEARNER.leaf_rows,
        random_state=0,
    )


def _trees(learner: GradientBoostingRegressor, inputs: Array) -> BoostedTrees:
    """Returns a learner's trees as plain arrays, padded to the largest of them."""
    trees = [each.tree_ for each in learner.estimators_[:, 0]]
    nodes = max(tree.node_count for tree in trees)
    feature = np.full((len(trees), nodes), -1, dtype=np.int64)
    threshold, value = np.zeros((2, len(trees), nodes))
    children = np.tile(np.arange(nodes)[:, None], (len(trees), 1, 2))
    for i, tree in enumerate(trees):
        own = slice(0, tree.node_count)
        inner = tree.children_left >= 0
        feature[i, own] = np.where(inner, tree.feature, -1)
        threshold[i, own] = tree.threshold
        both = np.stack([tree.children_left, tree.children_right], axis=-1)
        children[i, own][inner] = both[inner]
        value[i, own] = learner.learning_rate * tree.value[:, 0, 0]
    base = np.asarray(learner.init_.constant_, dtype=float).reshape(-1)[0]
    ends = inputs.min(axis=0), inputs.max(axis=0)
    return BoostedTrees(feature, threshold, children, value, np.array(base), *ends)

"""Ranks all candidate effects at a fit, by one linearisation and no further fit."""

import dataclasses
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sysid.effect_selection.block_regression import (
    BlockRegression,
    Columns,
    blocks_of,
)
from sysid.effect_selection.candidates import Candidate, extended, joint_groups
from sysid.effect_selection.evidence import (
    Evidence,
    Explanation,
    rank_by_regression,
)
from sysid.effect_selection.fit import Fit
from sysid.effect_selection.fitter import Fitter
from sysid.effect_selection.prewhitening import Prewhitening
from sysid.effect_selection.residual_curves import Dependence, dependence_curves
from sysid.effect_selection.settings import SelectionSettings
from sysid.identification.linearisation import Linearisation, extend
from sysid.models.base import LogModel
from sysid.objective import huber_weights
from sysid.parameters import Parameter, nominal_values

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LinearSurvey:
    """A fit linearised with all candidates at null, and its normal equations.

    Attributes:
        linearisation: at the fit, with the candidates' amplitudes as parameters.
        parameters: of the fit and of the candidates.
        regression: of the candidates' parameters, by blocks, with the fit's projected
            out.
        whitened: the same of the prewhitened residual, by short blocks.
        blocks: (rows,) number of each row's block.
        curves: (rows, channels, k) columns of dependence curves.
        groups: columns of each candidate, by its text; none of one that looks like
            another shape of the same effect.
        dependences: curves, and the columns of each.
        episodes: (B,) number of the episode that each block is of.
        is_further: whether the fit has effects: the model surely lacked something.
        noise_decides: whether what exceeds the stated noise is found: where fits
            decide, and not this linear account.
        model_error_share: (rows, channels) see Measurements; None: none is stated.
    """

    linearisation: Linearisation
    parameters: tuple[Parameter, ...]
    regression: BlockRegression
    whitened: BlockRegression
    blocks: NDArray[np.int64]
    curves: Array
    groups: Mapping[str, Columns]
    dependences: Sequence[tuple[Dependence, Columns]]
    episodes: NDArray[np.int64]
    is_further: bool
    noise_decides: bool
    model_error_share: Array | None

    @property
    def settings(self) -> SelectionSettings:
        """Thresholds."""
        return self.regression.settings

    def raw(self) -> BlockRegression:
        """Returns the regression of the fit's and the candidates' parameters."""
        linear = self.linearisation
        return BlockRegression.of(linear, self.blocks, self.settings, self.curves)

    @property
    def fields(self) -> tuple[str, ...]:
        """Of each parameter, the last part of its name."""
        return tuple(p.name.rpartition(".")[2] for p in self.parameters)

    def rank(
        self, sets: Sequence[tuple[Candidate, ...]]
    ) -> tuple[list[Evidence], list[Evidence]]:
        """Returns the evidence for sets of candidates, and for curves, the best first.

        They are one family: a log without an effect raises neither alarm.
        """
        columns = [*self._columns(sets), *self.dependences]
        found = self._ranked(columns)
        return (
            [e for e in found if not isinstance(e.explanation, Dependence)],
            [e for e in found if isinstance(e.explanation, Dependence)],
        )

    def accepted_pairs(self, singles: Sequence[Evidence]) -> list[Evidence]:
        """Returns accepted pairs of the best: some effects show only together.

        The p-values count all pairs, since the best are chosen by the same data.
        """
        promising: dict[str, Candidate] = {}
        for one in singles:
            if len(one.candidates) == 1:
                promising.setdefault(one.candidates[0].name, one.candidates[0])
        best = list(promising.values())[: self.settings.pair_pool]
        pairs = list(itertools.combinations(best, 2))
        tests = math.comb(len(promising), 2) / max(1, len(pairs))
        found = self._ranked(self._columns(pairs))
        return [
            counted
            for e in found
            if (counted := dataclasses.replace(e, p=min(1.0, e.p * tests))).accepted
        ]

    def pruned(self, added: Sequence[Candidate]) -> list[Candidate]:
        """Returns effects with only those amplitudes free that held-out blocks need.

        Backward elimination: the amplitude that is missed least goes, one by one.
        """
        tolerance = 1.0 + self.settings.min_amplitude_gain
        kept = [int(c) for candidate in added for c in self.groups[candidate.text]]
        now = self._held_out_loss(kept)
        while len(kept) > 1:
            without = {
                c: self._held_out_loss([k for k in kept if k != c]) for c in kept
            }
            least = min(without, key=lambda c: without[c])
            if without[least] > tolerance * now:
                break
            kept.remove(least)
            now = without[least]
        found = []
        for candidate in added:
            own = [c for c in self.groups[candidate.text] if c in kept]
            if own:
                found.append(candidate.only([self.fields[c] for c in own]))
        return found

    def derivatives(self, added: Sequence[Candidate]) -> dict[str, Array]:
        """Returns the derivatives (rows, channels) by effects' amplitudes, by name."""
        return {
            f"{effect.name}.{self.fields[c]}": self.linearisation.jacobian[..., c]
            for effect in added
            for c in self.groups[effect.text]
        }

    def _ranked(self, columns: Sequence[tuple[Explanation, Columns]]) -> list[Evidence]:
        return rank_by_regression(
            self.regression, self.whitened, columns, self.is_further
        )

    def _held_out_loss(self, columns: Sequence[int]) -> float:
        return float(self.regression.held_out_losses(np.array(columns)).sum())

    def _columns(
        self, sets: Sequence[tuple[Candidate, ...]]
    ) -> list[tuple[Explanation, Columns]]:
        """Returns sets of candidates with their columns, those that have any."""
        columns = [np.concatenate([self.groups[c.text] for c in s]) for s in sets]
        return [(s, c) for s, c in zip(sets, columns, strict=True) if len(c)]


@dataclass(frozen=True)
class Survey:
    """The evidence for each candidate, and for each dependence, at a fit.

    Attributes:
        effects, dependences: the best first.
        blocks: number of blocks.
        linear: what it was made of; None in a survey that is kept as a record.
        untested: candidates, as text, for which the time was not enough.
    """

    effects: list[Evidence]
    dependences: list[Evidence]
    blocks: int
    linear: LinearSurvey | None
    untested: tuple[str, ...] = ()

    @property
    def linearised(self) -> LinearSurvey:
        """What the survey was made of.

        Raises:
            ValueError: it is a record.
        """
        if self.linear is None:
            raise ValueError("a recorded survey has no linearisation")
        return self.linear

    def record(self) -> "Survey":
        """Returns the survey without its linearisation, which takes memory."""
        return dataclasses.replace(self, linear=None)


def survey_candidates(
    fitter: Fitter,
    fit: Fit,
    library: Sequence[Candidate],
    deadline: float = math.inf,
) -> Survey:
    """Returns the evidence for each candidate of a library that a fit does not have.

    Costs one evaluation of the model for each amplitude of each candidate. Those whose
    turn comes after a deadline, by `time.monotonic` [s], are not tested.
    """
    names = {candidate.name for candidate in fit.effects}
    rest = [c for c in library if c.name not in names]
    tested = _Tested.of(fitter, fit, rest, deadline)
    linear = _linear_survey(fitter, fit, tested)
    sets = [(c,) for c in tested.candidates] + joint_groups(tested.candidates)
    effects, dependences = linear.rank(sets)
    blocks = len(linear.regression.begins)
    untested = tuple(c.text for c in rest[len(tested.candidates) :])
    return Survey(effects, dependences, blocks, linear, untested)


@dataclass(frozen=True)
class _Tested:
    """Candidates for which the time was enough, and a fit linearised with them.

    Attributes:
        candidates: the first of a library, if not all.
        model: the fit's with the candidates at null.
        groups: columns of each.
        linearisation: at the fit, of the model's parameters.
    """

    candidates: Sequence[Candidate]
    model: LogModel
    groups: Sequence[range]
    linearisation: Linearisation

    @classmethod
    def of(
        cls, fitter: Fitter, fit: Fit, library: Sequence[Candidate], deadline: float
    ) -> Self:
        """Returns as many of a library as are tested by a deadline."""
        model, groups = extended(fit.model, library)
        objective = fitter.objective(model)
        rest = nominal_values(model.parameters)[len(fit.theta) :]
        u = objective.scaling.to_unit(np.concatenate([fit.theta, rest]))
        found = extend(fit.linearisation, objective, u, deadline=deadline)
        if len(found.u) < len(u):
            count = sum(group.stop <= len(found.u) for group in groups)
            library = library[:count]
            model, groups = extended(fit.model, library)
            found = found.of_first(len(model.parameters))
        return cls(library, model, groups, found)


def _linear_survey(fitter: Fitter, fit: Fit, tested: _Tested) -> LinearSurvey:
    """Returns the normal equations of a fit and of what was tested at null."""
    model, linearisation = tested.model, tested.linearisation
    library = tested.candidates
    count, begin = len(fit.theta), len(model.parameters)
    episode = model.measurements.episode
    curves, dependences = dependence_curves(model, fitter.settings)
    blocks = blocks_of(linearisation.residual, episode, fitter.settings)
    columns = _distinct(library, tested.groups, linearisation.jacobian)
    of_curves = [(d, begin + np.array(d.columns, np.int64)) for d in dependences]
    regression = BlockRegression.of(linearisation, blocks, fitter.settings, curves)
    regression = regression.project_out(np.arange(count))
    sets = [columns[c.text] for c in library] + [c for _, c in of_curves]
    sets += [_of_group(group, columns) for group in joint_groups(library)]
    best = regression.best_of([group for group in sets if len(group)])
    known = np.append(np.arange(count), best)
    whitened = _whitened(linearisation, episode, curves, known, count, fitter)
    return LinearSurvey(
        linearisation,
        model.parameters,
        regression,
        whitened,
        blocks,
        curves,
        columns,
        of_curves,
        episode[np.unique(blocks, return_index=True)[1]],
        bool(fit.effects),
        fit.noise_is_stated and not model.affine,
        model.measurements.model_error_share if fit.states_model_error else None,
    )


def _distinct(
    library: Sequence[Candidate], groups: Sequence[range], jacobian: Array
) -> dict[str, Columns]:
    """Returns the columns of each candidate, by its text.

    None of a shape that looks exactly like an earlier one of the same effect in this
    log, or shows in none of its rows: a drift that ends after the log has.
    """
    found = dict[str, Columns]()
    shapes: dict[str, list[Array]] = {}
    for candidate, group in zip(library, groups, strict=True):
        own = jacobian[..., group.start : group.stop]
        seen = shapes.setdefault(candidate.name, [])
        adds = not seen or (own.any() and not any(np.array_equal(own, s) for s in seen))
        columns = group if adds else range(0)
        found[candidate.text] = np.array(columns, dtype=np.int64)
        seen.append(own)
    return found


def _of_group(group: Sequence[Candidate], columns: Mapping[str, Columns]) -> Columns:
    return np.concatenate([columns[c.text] for c in group])


def _least_squares(J: Array, r: Array, weights: Array) -> Array:
    """Returns coefficients (k,) of columns (rows, channels, k) that fit a residual."""
    root = np.sqrt(weights)
    a, b = (root[..., None] * J).reshape(r.size, J.shape[2]), (root * r).reshape(-1)
    return np.asarray(np.linalg.lstsq(a, b, rcond=None)[0])


def _of_both(first: Array, second: Array, columns: Columns) -> Array:
    """Returns columns (rows, channels, k) of two arrays as if they were one."""
    found = np.empty((*first.shape[:2], len(columns)))
    count = first.shape[2]
    is_first = columns < count
    found[..., is_first] = first[..., columns[is_first]]
    found[..., ~is_first] = second[..., columns[~is_first] - count]
    return found


def _whitened(
    linearisation: Linearisation,
    episode: NDArray[np.int64],
    curves: Array,
    known: Columns,
    own: int,
    fitter: Fitter,
) -> BlockRegression:
    """Returns the regression of the prewhitened residual.

    Args:
        linearisation: with all candidates at null.
        episode: (rows,) of each row.
        curves: (rows, channels, k) columns of dependence curves.
        known: columns of what may be in the residual: the filter is made of what they
            leave, since it would take a slow effect for noise.
        own: number of the fit's own, the first of them; they are projected out.
        fitter: its settings.
    """
    settings, r = fitter.settings, linearisation.residual
    columns = (linearisation.jacobian, curves)
    J = _of_both(*columns, known)
    delta, weights = linearisation.huber_delta, linearisation.weights
    left = r - J @ _least_squares(J, r, weights)
    filtered = Prewhitening.of(left, episode, delta, settings, columns, len(known))
    few = settings.whitened_per_parameter * len(known)
    for _ in range(settings.whitening_steps):
        whitened = filtered(r)
        if whitened.size >= few:
            break
        by = _least_squares(filtered(J), whitened, huber_weights(whitened, delta))
        left = r - J @ by
        filtered = Prewhitening.of(left, episode, delta, settings, columns, len(known))
    found = filtered.whitened(linearisation)
    most = settings.max_test_blocks
    blocks = blocks_of(filtered(left), filtered.episode, settings, most)
    regression = BlockRegression.of(found, blocks, settings, filtered(curves))
    noise = settings.noise_safety * regression.noise_left_by(known)
    return dataclasses.replace(regression.project_out(known[:own]), noise=noise)

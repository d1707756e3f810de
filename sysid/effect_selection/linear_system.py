"""A fit linearised with all candidates at null: what the selection works on."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from sysid.effect_selection.exceeds_noise import lengths_and_errors
from sysid.effect_selection.forward_selection import Term, channel_weights
from sysid.fitting.block_grams import (
    BlockGrams,
    Columns,
    NormalEquations,
    blocks_of,
)
from sysid.fitting.candidates import Candidate, extended, joint_groups
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import SelectionSettings
from sysid.identification.linearisation import Linearisation
from sysid.models.base import LogModel
from sysid.models.effects import field_of
from sysid.parameters import Parameter, nominal_values

Array = NDArray[np.float64]

_AT_BOUND = 1e-9  # of a parameter's range: rounding of a point on the bound


@dataclass(frozen=True)
class LinearSystem:
    """Gram matrices of a fit's parameters and of candidates.

    Attributes:
        grams: by blocks; of one channel if the noise of all is stated.
        own: columns of the fit's parameters.
        terms: what may be added.
        labels: for each channel of the Gram matrices; those of one label have one
            unknown noise.
        noise_is_stated: whether channels keep their weights.
        parameters: of the fit and of the candidates, as the columns are.
        linearisation: from which fits with candidates begin; None where the model is
            affine, so that they need no such.
        untested: candidates, as text, for which the time was not enough.
        settings: thresholds.
        unseen: candidates that no row depends on, in whatever shape.
        model_error_share: (rows, channels) of what is stated, the model's own error;
            None where nothing is stated.
    """

    grams: BlockGrams
    own: Columns
    terms: tuple[Term, ...]
    labels: tuple[int, ...]
    noise_is_stated: bool
    parameters: tuple[Parameter, ...]
    linearisation: Linearisation | None
    untested: tuple[str, ...]
    settings: SelectionSettings
    unseen: tuple[Candidate, ...] = ()
    model_error_share: Array | None = None

    @property
    def weights(self) -> Array | None:
        """Weight of each channel; None where it has to be estimated."""
        if not self.noise_is_stated:
            return None
        return np.ones(self.grams.grams.shape[1])

    @property
    def first_weights(self) -> Array:
        """Weights of channels by what is left of each without candidates."""
        if self.weights is not None:
            return self.weights
        return channel_weights(self.grams, self.own, self.labels)

    def equations(self) -> NormalEquations:
        """Returns the normal equations with the fit's parameters projected out."""
        return self.grams.weighted(self.first_weights).projected(self.own)

    def derivatives(self, term: Term) -> dict[str, Array]:
        """Returns the derivatives (rows, channels) by a term's amplitudes, by name."""
        if self.linearisation is None:
            return {}
        found = {}
        for number, column in zip(term.owners, term.columns, strict=True):
            field = field_of(self.parameters[column])
            name = f"{term.candidates[number].name}.{field}"
            found[name] = self.linearisation.jacobian[..., column]
        return found

    def least_beyond_noise(self, column: int, alpha: float, above: float) -> float:
        """Returns how far along a column noise and the model's own error may lead.

        The latter were it in each row as large as stated, and of the sign that the
        column has; in all channels, or in the one that shows it best: see
        `exceeds_noise_p`.

        Args:
            column: of a candidate.
            alpha: how often noise may be taken for more.
            above: standard deviations beyond what it may lead to.
        """
        if self.model_error_share is None or self.linearisation is None:
            return 0.0
        lengths, errors = lengths_and_errors(
            self.linearisation.jacobian[..., column],
            self.settings.model_error_reach * self.model_error_share,
        )
        deviations = norm.isf(0.5 * alpha / len(lengths)) + above
        return float(np.min((errors + deviations) / lengths))

    def candidates_of(self, term: Term) -> list[Candidate]:
        """Returns a term's effects with those amplitudes that it has columns of."""
        fields: list[list[str]] = [[] for _ in term.candidates]
        for number, column in zip(term.owners, term.columns, strict=True):
            fields[number].append(field_of(self.parameters[column]))
        pairs = zip(term.candidates, fields, strict=True)
        return [candidate.only(own) for candidate, own in pairs]


def linear_system(
    fitter: Fitter,
    fit: Fit,
    library: Sequence[Candidate],
    deadline: float = math.inf,
) -> LinearSystem:
    """Returns the linear account of a fit and of the candidates that it does not have.

    Costs one evaluation of the model for each amplitude of each candidate. Those whose
    turn comes after a deadline, by `time.monotonic` [s], are not tested.
    """
    names = {candidate.name for candidate in fit.effects}
    rest = [candidate for candidate in library if candidate.name not in names]
    model, groups, linear = _linearised(fitter, fit, rest, deadline)
    tested = rest[: len(groups)]
    measured = model.measurements
    grams = BlockGrams.of(
        [linear.jacobian],
        linear.residual,
        linear.weights,
        blocks_of(measured.episode, fitter.settings.blocks),
        measured.episode,
        _bounds(linear.u),
        pooled=fit.noise_is_stated,
    )
    own_columns = _distinct(tested, groups, linear.jacobian)
    labels = list(dict.fromkeys(model.noise_groups))
    return LinearSystem(
        grams,
        np.arange(len(fit.theta)),
        tuple(_terms(tested, own_columns)),
        tuple(labels.index(label) for label in model.noise_groups),
        fit.noise_is_stated,
        model.parameters,
        None if model.affine else linear,
        tuple(candidate.text for candidate in rest[len(tested) :]),
        fitter.settings,
        tuple(_unseen(tested, groups, own_columns)),
        measured.model_error_share if fit.noise_is_stated else None,
    )


def _unseen(
    library: Sequence[Candidate], groups: Sequence[range], columns: Sequence[Columns]
) -> list[Candidate]:
    """Returns a candidate of each effect none of whose shapes has columns.

    But those that are the model's own parameters.
    """
    each = list(zip(library, groups, columns, strict=True))
    seen = {candidate.name for candidate, _, own in each if len(own)}
    hidden = {c.name: c for c, group, _ in each if len(group) and c.name not in seen}
    return list(hidden.values())


def _linearised(
    fitter: Fitter, fit: Fit, library: Sequence[Candidate], deadline: float
) -> tuple[LogModel, list[range], Linearisation]:
    """Returns the model with as many candidates as there is time for, linearised."""
    model, groups = extended(fit.model, library)
    objective = fitter.objective(model)
    rest = nominal_values(model.parameters)[len(fit.theta) :]
    u = objective.scaling.to_unit(np.concatenate([fit.theta, rest]))
    found = fitter.extended(fit.linearisation, objective, u, deadline)
    if len(found.u) < len(u):
        count = sum(group.stop <= len(found.u) for group in groups)
        model, groups = extended(fit.model, library[:count])
        found = found.of_first(len(model.parameters))
    return model, groups, found


def _bounds(u: Array) -> Array:
    """Returns how far parameters (p,) of the unit box may go down and up (p, 2)."""
    return np.column_stack([-u - _AT_BOUND, 1.0 - u + _AT_BOUND])


def _distinct(
    library: Sequence[Candidate], groups: Sequence[range], jacobian: Array
) -> list[Columns]:
    """Returns the columns of each candidate that show in the log.

    None of a shape that looks exactly like an earlier one of the same effect: a drift
    that ends after the log has.
    """
    found: list[Columns] = []
    shapes: dict[str, list[Array]] = {}
    for candidate, group in zip(library, groups, strict=True):
        own = jacobian[..., group.start : group.stop]
        seen = shapes.setdefault(candidate.name, [])
        is_known = any(np.array_equal(own, each) for each in seen)
        shows = own.any(axis=(0, 1)) & (not is_known)
        found.append(np.array(group, dtype=np.int64)[shows])
        seen.append(own)
    return found


def _terms(library: Sequence[Candidate], columns: Sequence[Columns]) -> list[Term]:
    """Returns each candidate by itself, and kinds that are common at all joints."""
    pairs = zip(library, columns, strict=True)
    of = {candidate.text: own for candidate, own in pairs if len(own)}
    shown = [candidate for candidate in library if candidate.text in of]
    sets = [(candidate,) for candidate in shown] + joint_groups(shown)
    return [_term(each, [of[candidate.text] for candidate in each]) for each in sets]


def _term(candidates: tuple[Candidate, ...], columns: Sequence[Columns]) -> Term:
    owners = [np.full(len(own), i) for i, own in enumerate(columns)]
    return Term(candidates, np.concatenate(columns), np.concatenate(owners))

"""The linear account of a selection: what its effects and all others are worth."""

import dataclasses
import functools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sysid.effect_selection.block_grams import (
    Array,
    BlockGrams,
    Columns,
    NormalEquations,
)
from sysid.effect_selection.candidates import Candidate
from sysid.effect_selection.fit import Fit
from sysid.effect_selection.forward_selection import (
    Gain,
    Selection,
    Term,
    channel_weights,
    owned_columns,
    ranked,
    wald_p,
)
from sysid.effect_selection.linear_system import LinearSystem
from sysid.effect_selection.residual_curves import Dependence
from sysid.effect_selection.settings import SelectionSettings
from sysid.models.effects import field_of
from sysid.parameters import Parameter


@dataclass(frozen=True)
class LinearAccount:
    """Gram matrices, what is in the model, and what is not.

    Attributes:
        grams: of all columns.
        weights: of the channels.
        columns: of the model, its effects included.
        owners: columns of each effect that the model has, by its name.
        terms: what it has not.
        dependences: curves of covariates, with their columns.
        parameters: as the columns are; curves have none.
        noise_is_stated: whether residuals are in units of a noise that is known.
        settings: thresholds.
        unseen: candidates that no row depends on.
    """

    grams: BlockGrams
    weights: Array
    columns: Columns
    owners: Mapping[str, Columns]
    terms: tuple[Term, ...]
    dependences: tuple[tuple[Dependence, Columns], ...]
    parameters: tuple[Parameter, ...]
    noise_is_stated: bool
    settings: SelectionSettings
    unseen: tuple[Candidate, ...] = ()

    @classmethod
    def of_selection(cls, system: LinearSystem, found: Selection) -> "LinearAccount":
        """Returns the account of what was selected by the linear account itself."""
        owners = owned_columns(found.terms)
        terms = [t for t in system.terms if not set(t.names) <= set(owners)]
        return cls._of(system, found.weights, found.columns, owners, terms)

    @classmethod
    def of_fit(cls, system: LinearSystem, fit: Fit) -> "LinearAccount":
        """Returns the account of a fit, at which a system was linearised.

        Of the residual with its effects at null, as where they are selected.
        """
        owners = {effect.name: fit.columns_of(effect) for effect in fit.effects}
        change = np.zeros(len(system.grams.bounds))
        for columns in owners.values():
            change[columns] = (fit.null - fit.linearisation.u)[columns]
        system = dataclasses.replace(system, grams=system.grams.shifted(change))
        weights = system.weights
        if weights is None:
            weights = channel_weights(system.grams, system.own, system.labels)
        return cls._of(system, weights, system.own, owners, system.terms)

    @classmethod
    def _of(
        cls,
        system: LinearSystem,
        weights: Array,
        columns: Columns,
        owners: Mapping[str, Columns],
        terms: list[Term] | tuple[Term, ...],
    ) -> "LinearAccount":
        return cls(
            system.grams,
            weights,
            columns,
            owners,
            tuple(terms),
            system.dependences,
            system.parameters,
            system.noise_is_stated,
            system.settings,
            system.unseen,
        )

    @functools.cached_property
    def equations(self) -> NormalEquations:
        """Normal equations with the model and its effects projected out."""
        return self.grams.weighted(self.weights).projected(self.columns)

    def equations_of_effects(self) -> tuple[NormalEquations, dict[str, Columns]]:
        """Returns those of the effects alone, without the model's own parameters.

        And the columns of each effect in them.
        """
        names, sizes = list(self.owners), [len(c) for c in self.owners.values()]
        empty = np.array([], dtype=np.int64)
        effects = np.concatenate([empty, *self.owners.values()])
        base = np.setdiff1d(self.columns, effects)
        whole = self.grams.weighted(self.weights).projected(base)
        ends = np.cumsum(sizes)
        columns = {
            name: np.arange(end - size, end)
            for name, size, end in zip(names, sizes, ends, strict=True)
        }
        return whole.of_columns(effects), columns

    def gains(self) -> list[Gain]:
        """Returns what each term would gain besides, the best first."""
        folds = self.grams.weighted(self.weights).folds(self.settings.folds)
        return ranked(folds.projected(self.columns), self.terms, self.settings)

    def dependence_left(self) -> list[tuple[Dependence, float, float]]:
        """Returns curves with their gain and family-wise p-value, the best first."""
        equations = self.equations
        folds = equations.folds(self.settings.folds)
        nu = equations.degrees_of_freedom
        found = []
        for curve, columns in self.dependences:
            columns = folds.feasible(columns)
            if not len(columns):
                continue
            gain = folds.held_out_gain(columns)
            x, C = equations.solution(columns), equations.covariance(columns)
            p = min(1.0, wald_p(x, C, nu) * len(self.dependences))
            found.append((curve, gain, p))
        return sorted(found, key=lambda each: -each[1])

    def field(self, column: int) -> str:
        """Returns the field that a column's parameter stands for."""
        return field_of(self.parameters[column])

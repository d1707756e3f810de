"""The linear account of a selection: what its effects and all others are worth."""

import dataclasses
import functools
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from sysid.effect_selection.forward_selection import (
    Gain,
    Selection,
    Term,
    owned_columns,
    p_values,
    ranked,
)
from sysid.effect_selection.linear_system import LinearSystem
from sysid.fitting.block_grams import Array, Columns, NormalEquations
from sysid.fitting.fit import Fit
from sysid.fitting.settings import SelectionSettings


@dataclass(frozen=True)
class LinearAccount:
    """A linear system, what of it is in the model, and what is not.

    Attributes:
        system: of the model's columns, and of all candidates'.
        weights: of the channels.
        columns: of the model, its effects included.
        owners: columns of each effect that the model has, by its name.
        terms: what it has not.
    """

    system: LinearSystem
    weights: Array
    columns: Columns
    owners: Mapping[str, Columns]
    terms: tuple[Term, ...]

    @classmethod
    def of_selection(
        cls, system: LinearSystem, found: Selection, kept: Collection[str]
    ) -> "LinearAccount":
        """Returns the account of what was selected by the linear account itself.

        Args:
            system: it was selected from.
            found: the selection.
            kept: names of its effects that the model has.
        """
        owners = owned_columns(found.terms)
        owners = {name: owners[name] for name in owners if name in kept}
        columns = np.concatenate([system.own, *owners.values()])
        terms = tuple(t for t in system.terms if not set(t.names) <= set(owners))
        return cls(system, found.weights, columns, owners, terms)

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
        return cls(system, system.first_weights, system.own, owners, system.terms)

    @property
    def settings(self) -> SelectionSettings:
        """Thresholds."""
        return self.system.settings

    @functools.cached_property
    def whole(self) -> NormalEquations:
        """Normal equations of all columns, by blocks."""
        return self.system.grams.weighted(self.weights)

    @functools.cached_property
    def equations(self) -> NormalEquations:
        """Normal equations with the model and its effects projected out."""
        return self.whole.projected(self.columns)

    @property
    def p_values(self) -> dict[str, float]:
        """P-value of each effect's coefficients, all others fitted with them."""
        folds, base = self.whole.folds(self.settings.folds), self._base
        return p_values(folds, base, self.owners)

    def equations_of_effects(self) -> tuple[NormalEquations, dict[str, Columns]]:
        """Returns those of the effects alone, without the model's own parameters.

        And the columns of each effect in them.
        """
        ends = np.cumsum([len(columns) for columns in self.owners.values()])
        effects = np.concatenate([np.array([], np.int64), *self.owners.values()])
        whole = self.whole.projected(self._base).of_columns(effects)
        columns = {
            name: np.arange(end - len(own), end)
            for (name, own), end in zip(self.owners.items(), ends, strict=True)
        }
        return whole, columns

    def gains(self) -> list[Gain]:
        """Returns what each term would gain besides, the best first."""
        folds = self.whole.folds(self.settings.folds)
        return ranked(folds.projected(self.columns), self.terms, self.settings)

    @property
    def _base(self) -> Columns:
        """Columns of the model without effects."""
        effects = np.concatenate([np.array([], np.int64), *self.owners.values()])
        return np.setdiff1d(self.columns, effects)

"""A model with effects, fitted, and what the fit says of its parameters."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.effect_selection.block_regression import BlockRegression, blocks_of
from sysid.effect_selection.candidates import Candidate
from sysid.effect_selection.evidence import FEW
from sysid.identification.linearisation import Linearisation
from sysid.models.base import LogModel
from sysid.objective import pseudo_residual
from sysid.parameters import Scaling, nominal_values

Array = NDArray[np.float64]

_AT_BOUND = 1e-6  # of a parameter's range
_Z95 = 1.959963984540054


@dataclass(frozen=True)
class Fit:
    """A model with effects, fitted.

    Attributes:
        effects: that were added.
        model: with their parameters.
        theta: (p,) values.
        here: residuals and derivatives there.
        value: of the objective.
    """

    effects: tuple[Candidate, ...]
    model: LogModel
    theta: Array
    linearisation: Linearisation
    value: float

    @property
    def loss(self) -> float:
        """Sum of the squares, less beyond where they end."""
        return float(
            np.sum(
                pseudo_residual(
                    self.linearisation.residual, self.linearisation.huber_delta
                )
                ** 2
            )
        )

    def regression(self, blocks: NDArray[np.int64] | None = None) -> BlockRegression:
        """Returns its normal equations, by blocks (rows,) of its own or of another."""
        if blocks is None:
            blocks = blocks_of(self.linearisation, self.model.measurements.episode)
        return BlockRegression.of(self.linearisation, blocks)

    @property
    def values(self) -> dict[str, float]:
        """The parameters' values, by name."""
        names = [p.name for p in self.model.parameters]
        return dict(zip(names, self.theta.tolist(), strict=True))

    def columns_of(self, effect: Candidate) -> NDArray[np.int64]:
        """Returns which of the parameters are an effect's sizes."""
        names = [f"{effect.name}.{field}" for field in effect.fields]
        own = [i for i, p in enumerate(self.model.parameters) if p.name in names]
        return np.array(own, dtype=np.int64)

    @property
    def shows(self) -> NDArray[np.bool_]:
        """Which parameters' (p,) intervals exclude their null value.

        95 %, by the sums of the gradient over blocks (a sandwich): right whatever the
        correlation within a block.
        """
        away = self.linearisation.u - self._null
        return np.asarray(np.abs(away) > _Z95 * self.regression().spread())

    def all_show(self, names: Sequence[str]) -> bool:
        """Returns whether each of some effects has a size that shows."""
        effects = [effect for effect in self.effects if effect.name in names]
        shows = self.shows
        return bool(effects) and all(shows[self.columns_of(e)].any() for e in effects)

    def physical(self, added: Sequence[Candidate]) -> list[Candidate]:
        """Returns new effects without sizes that end at a bound, unphysical or null.

        Of several that were added because they are alike, those go that do not show.
        """
        found, shows = [], self.shows
        for effect in added:
            columns = self.columns_of(effect)
            u = self.linearisation.u[columns]
            kept = (u > _AT_BOUND) & (u < 1.0 - _AT_BOUND)
            fields = [f for f, keep in zip(effect.fields, kept, strict=True) if keep]
            if fields and (len(added) <= FEW or shows[columns].any()):
                found.append(effect.only(fields))
        return found

    @property
    def worth(self) -> dict[str, float]:
        """What each effect gains, by its name; see `gains_of`."""
        gains = self.gains_of([self.columns_of(effect) for effect in self.effects])
        names = [effect.name for effect in self.effects]
        return dict(zip(names, gains, strict=True))

    def gains_of(self, groups: Sequence[NDArray[np.int64]]) -> list[float]:
        """Returns what groups of parameters (k,) gain, as shares of the loss without.

        Of blocks that are not fitted; all other parameters are fitted again.
        """
        regression, null = self.regression(), self._null
        free = np.zeros(len(null))  # at null a bound is no end
        found = []
        for columns in groups:
            own = np.isin(np.arange(len(null)), columns)
            without = regression.moved(np.where(own, null - self.linearisation.u, 0.0))
            without = dataclasses.replace(without, side=free)
            project_out = without.project_out(np.flatnonzero(~own))
            total = project_out.energy.sum()
            found.append(float((total - project_out.losses(columns).sum()) / total))
        return found

    @property
    def _null(self) -> Array:
        """Where in the unit box (p,) nothing has an effect."""
        parameters = self.model.parameters
        return Scaling(parameters).to_unit(nominal_values(parameters))

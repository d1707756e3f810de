"""A fitted model with effects, and which of its parameters are significant."""

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.confidence import Z
from sysid.effect_selection.block_regression import BlockRegression, blocks_of
from sysid.effect_selection.candidates import Candidate, is_joint_group
from sysid.effect_selection.prewhitening import Prewhitening
from sysid.effect_selection.settings import SelectionSettings
from sysid.effect_selection.significance import greater_p
from sysid.identification.linearisation import Linearisation
from sysid.models.base import LogModel
from sysid.objective import pseudo_residual
from sysid.parameters import Scaling, nominal_values

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Fit:
    """A fitted model with effects.

    Attributes:
        effects: that were added.
        model: with their parameters.
        theta: (p,) values of the parameters.
        linearisation: residuals and derivatives there.
        objective: rms residual in units of the noise, Huber's beyond `huber_delta`.
        settings: thresholds.
        noise_is_stated: whether the objective is in units of a noise that is known; of
            one that was estimated from a fit, it is about 1 whatever is missing.
    """

    effects: tuple[Candidate, ...]
    model: LogModel
    theta: Array
    linearisation: Linearisation
    objective: float
    settings: SelectionSettings
    noise_is_stated: bool = True

    @property
    def loss(self) -> float:
        """Sum of the squared residuals, Huber's beyond `huber_delta`."""
        return float(np.sum(self.bounded_residual**2))

    @property
    def worst_channel(self) -> float:
        """The objective of the channel that has the largest.

        Of a log of the twin, whose poses are exact, half of the channels are silent.
        """
        return float(np.sqrt(np.mean(self.bounded_residual**2, axis=0)).max())

    @property
    def bounded_residual(self) -> Array:
        """Residuals (rows, channels) whose squares add up to the loss."""
        linear = self.linearisation
        return pseudo_residual(linear.residual, linear.huber_delta)

    def noticeable(self, channel: int) -> float:
        """Returns the rms, in units of sigma, below which a finding is none.

        What is far below a known noise is the solver's own, whatever it looks like; and
        a model that states by how much it is off itself is off in some pattern.
        """
        if not self.noise_is_stated:
            return 0.0
        share = self.model.measurements.model_error_share[:, channel]
        own = self.settings.model_error_reach * float(np.sqrt(np.mean(share**2)))
        return max(self.settings.noticeable, own)

    def noticeable_row(self, channel: int) -> float:
        """Returns the residual, in units of sigma, below which a row is no finding."""
        if not self.noise_is_stated:
            return 0.0
        return max(self.settings.noticeable_row, self.noticeable(channel))

    @property
    def states_model_error(self) -> bool:
        """Whether it is known by how much the model itself is off."""
        return self.model.measurements.model_error is not None

    @property
    def blocks(self) -> NDArray[np.int64]:
        """Number of the block (rows,) of each row."""
        episode = self.model.measurements.episode
        return blocks_of(self.linearisation.residual, episode, self.settings)

    def regression(
        self,
        blocks: NDArray[np.int64] | None = None,
        filtered: Prewhitening | None = None,
    ) -> BlockRegression:
        """Returns its normal equations, by blocks (rows,) of its own or of another.

        Args:
            blocks: (rows,) number of each row's block.
            filtered: what residuals and derivatives are filtered by.
        """
        chosen = self.blocks if blocks is None else blocks
        linear = self.linearisation
        linear = filtered.whitened(linear) if filtered else linear
        return BlockRegression.of(linear, chosen, self.settings)

    @property
    def prewhitening(self) -> Prewhitening:
        """What whitens its residual."""
        linear, settings = self.linearisation, self.settings
        episode = self.model.measurements.episode
        return Prewhitening.of(
            linear.residual, episode, linear.huber_delta, settings, [linear.jacobian]
        )

    @property
    def values(self) -> dict[str, float]:
        """The parameters' values, by name."""
        names = [p.name for p in self.model.parameters]
        return dict(zip(names, self.theta.tolist(), strict=True))

    def columns_of(self, effect: Candidate) -> NDArray[np.int64]:
        """Returns which of the parameters are an effect's amplitudes."""
        return self._columns(effect, effect.fields)

    def _columns(self, effect: Candidate, fields: Iterable[str]) -> NDArray[np.int64]:
        names = [f"{effect.name}.{field}" for field in fields]
        own = [i for i, p in enumerate(self.model.parameters) if p.name in names]
        return np.array(own, dtype=np.int64)

    @property
    def significant(self) -> NDArray[np.bool_]:
        """Which parameters' (p,) 95 % intervals exclude their null value.

        By a sandwich estimate over blocks: right for any correlation within a block.
        """
        away = np.abs(self.linearisation.u - self.null)
        return np.asarray(away > Z * self.regression().standard_errors())

    def all_significant(self, names: Sequence[str]) -> bool:
        """Returns whether each of some effects has a significant amplitude."""
        effects = [effect for effect in self.effects if effect.name in names]
        which = self.significant
        return bool(effects) and all(which[self.columns_of(e)].any() for e in effects)

    def at_bound(self, names: Sequence[str]) -> bool:
        """Returns whether an amplitude of some effects is at a bound: unphysical.

        Or at null; see `inside`.
        """
        effects = [effect for effect in self.effects if effect.name in names]
        return not all(self.inside(self.columns_of(e)).all() for e in effects)

    def inside(self, columns: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Returns which of some parameters (k,) are not at a bound.

        A bound that is not null, and past which hardly anything would be gained, is as
        good an estimate as any: the true value may be near it.
        """
        u, null = self.linearisation.u[columns], self.null[columns]
        is_null = np.abs(u - null) <= self.settings.bound_tolerance
        is_content = np.array([not self._is_held_back(i) for i in columns], dtype=bool)
        return self._between_bounds(columns) | (is_content & ~is_null)

    def _between_bounds(self, columns: NDArray[np.int64]) -> NDArray[np.bool_]:
        margin, u = self.settings.bound_tolerance, self.linearisation.u[columns]
        return np.asarray((u > margin) & (u < 1.0 - margin))

    def is_misshapen(self, names: Sequence[str]) -> bool:
        """Returns whether some effects would explain more beyond a shape's bound.

        Dry friction whose transition is as wide as it may be, say, where what is
        missing is viscous.
        """
        effects = [effect for effect in self.effects if effect.name in names]
        shapes = [i for e in effects for i in self._columns(e, e.shape)]
        return any(self._is_held_back(i) for i in shapes)

    def _is_held_back(self, column: int) -> bool:
        """Returns whether a parameter is at a bound past which it would lower the loss
        by `min_gain`.
        """
        if self._between_bounds(np.array([column])).all():
            return False
        linear, least = self.linearisation, self.settings.min_gain * self.loss
        derivative = linear.jacobian[..., column]
        slope = float(np.sum(linear.weights * derivative * linear.residual))
        power = float(np.sum(linear.weights * derivative**2))
        outward = np.sign(2.0 * linear.u[column] - 1.0)
        return bool(outward * slope < 0.0 and slope**2 > least * power)

    def harmed_channels(self, before: "Fit") -> list[str]:
        """Returns the channels that are significantly worse than in another fit."""
        limits, blocks = self.settings, before.blocks
        count = int(blocks.max()) + 1
        gain = before.loss - self.loss
        found = []
        for number, channel in enumerate(self.model.measurements.channels):
            own = [
                _channel_losses(fit, number, blocks, count) for fit in (before, self)
            ]
            rise, rows = own[1] - own[0], len(blocks)
            large = rise.sum() > limits.max_channel_rise * max(own[0].sum(), rows)
            is_quiet = self.noise_is_stated and own[1].sum() <= rows
            if is_quiet and rise.sum() <= limits.max_rise_per_gain * gain:
                continue
            is_doubled = rise.sum() > own[0].sum()
            if not is_doubled and rise.sum() <= limits.max_undoubled_per_gain * gain:
                continue
            if large and greater_p(rise) < limits.channel_alpha:
                found.append(channel.name)
        return found

    def within_bounds(self, added: Sequence[Candidate]) -> list[Candidate]:
        """Returns new effects without amplitudes that end at a bound: unphysical.

        Of one kind of effect at several joints, those that are not significant go.
        """
        found, which = [], self.significant
        for effect in added:
            columns = self.columns_of(effect)
            kept = self.inside(columns)
            fields = [f for f, keep in zip(effect.fields, kept, strict=True) if keep]
            if fields and (not is_joint_group(added) or which[columns].any()):
                found.append(effect.only(fields))
        return found

    def significant_only(self, known: int) -> tuple[Candidate, ...]:
        """Returns its effects, those after the first few with significant amplitudes.

        Args:
            known: number of the effects that keep all amplitudes.
        """
        which, new = self.significant, []
        for effect in self.effects[known:]:
            pairs = zip(effect.fields, self.columns_of(effect), strict=True)
            if fields := [field for field, column in pairs if which[column]]:
                new.append(effect.only(fields))
        return (*self.effects[:known], *new)

    @property
    def effect_gains(self) -> dict[str, float]:
        """What each effect gains, by its name; see `gains_of`."""
        gains = self.gains_of([self.columns_of(effect) for effect in self.effects])
        names = [effect.name for effect in self.effects]
        return dict(zip(names, gains, strict=True))

    def gains_of(self, groups: Sequence[NDArray[np.int64]]) -> list[float]:
        """Returns what groups of parameters (k,) gain, as shares of the loss without.

        Of blocks that are not fitted; all other parameters are fitted again.
        """
        regression, null = self.regression(), self.null
        unbounded = np.zeros(len(null))  # seen from null, a bound is no limit
        found = []
        for columns in groups:
            own = np.isin(np.arange(len(null)), columns)
            change = np.where(own, null - self.linearisation.u, 0.0)
            without = dataclasses.replace(regression.shifted(change), side=unbounded)
            projected = without.project_out(np.flatnonzero(~own))
            total = projected.block_losses.sum()
            left = projected.held_out_losses(columns).sum()
            found.append(float((total - left) / total))
        return found

    @property
    def error_of_steps(self) -> Array:
        """By how much the estimate (p,) is off, in the unit box, for its coarse steps.

        One Gauss-Newton step towards the optimum of the same model in finer time
        steps. No bootstrap of rows sees such an error.
        """
        linear, finer = self.linearisation, self.model.refined()
        if finer is None or not len(linear.u):
            return np.zeros_like(linear.u)
        fine = self.model.measurements.weighted(finer.predictions(self.theta))
        change = (np.sqrt(linear.weights) * (fine - linear.residual)).reshape(-1)
        return np.asarray(-self._step @ change)

    @property
    def error_of_model(self) -> Array:
        """By how much the estimate (p,) may be off, in the unit box, for its model.

        Were that off in each row by `model_error_reach` standard deviations to the side
        that matters: the same in all episodes, so that no bootstrap sees it either.
        """
        if not self.states_model_error:
            return np.zeros_like(self.theta)
        share = self.model.measurements.model_error_share
        off = np.sqrt(self.linearisation.weights) * share
        reach = self.settings.model_error_reach
        return np.asarray(reach * np.abs(self._step) @ off.reshape(-1))

    @property
    def _step(self) -> Array:
        """What weighted residuals (rows channels,) move the estimate by (p, ...)."""
        linear = self.linearisation
        J = np.sqrt(linear.weights).reshape(-1, 1) * linear.flat_jacobian
        return np.asarray(np.linalg.pinv(J, rcond=self.settings.held_out_rcond))

    @property
    def null(self) -> Array:
        """The point (p,) of the unit box at which no parameter has an effect."""
        parameters = self.model.parameters
        return Scaling(parameters).to_unit(nominal_values(parameters))


def _channel_losses(
    fit: Fit, channel: int, blocks: NDArray[np.int64], count: int
) -> Array:
    """Returns what a channel adds to the loss of each block (B,)."""
    squares = fit.bounded_residual[:, channel] ** 2
    return np.asarray(np.bincount(blocks, squares, minlength=count), dtype=float)

"""What an episode shows of each possible change: amplitudes that explain its residual.

r is the residual of an episode against the reference's model, W the weights, c_k its
derivative by the amplitude of a change k. The amplitude that explains the residual
best, by itself, is

    x_k = -c_k' W r / c_k' W c_k.

A change that no effect explains shows in the logarithm of each channel's rms residual.
"""

import dataclasses
import functools
import itertools
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_disasm.effects import registered_effects
from drake_disasm.logs import Log
from sysid.effect_selection.effect_names import in_words
from sysid.fitting.block_grams import solve
from sysid.fitting.candidates import Candidate, candidates, extended
from sysid.identification.linearisation import Linearisation, linearise
from sysid.models import LogModel
from sysid.models.changed import both_ways, moved_behind
from sysid.models.effects import field_of
from sysid.monitoring.reference import Reference, candidates_of, mappings_of
from sysid.objective import Objective
from sysid.parameters import Scaling, nominal_values

Array = NDArray[np.float64]

_SHOWN = 1e-6  # of a residual of the noise's size: what a change over its range moves
_ROUNDING = 1e-9  # of an amplitude's range, and of a logarithm
_LEAST_POWER = 1e-24  # mean square residual of a channel, in units of the noise
RESIDUAL = "residual"


@dataclass(frozen=True)
class Statistic:
    """One number of an episode.

    Attributes:
        name: of the effect or channel: "TorqueOffset.joint_1", "residual of fx".
        text: with the effect's shape and amplitude: "TorqueOffset.joint_1.size".
        unit: SI; "1" for a logarithm.
        floor: standard deviation below which scatter is rounding.
        amplitudes: number of those that the effect has; 0 of a residual.
    """

    name: str
    text: str
    unit: str
    floor: float
    amplitudes: int = 0

    @property
    def is_residual(self) -> bool:
        """Whether it is the logarithm of a channel's rms residual."""
        return self.name.startswith(f"{RESIDUAL} of ")

    @property
    def in_words(self) -> str:
        """What a sentence calls it: "dry friction at elbow"."""
        if self.is_residual:
            return f"the {self.name}, which no effect explains"
        joint = self.name.partition(".")[2]
        return f"{in_words(self.name)}{f' at {joint}' if joint else ''}"

    def to_mapping(self) -> dict[str, Any]:
        """Returns it as plain data."""
        return dataclasses.asdict(self)


@dataclass(frozen=True)
class Statistics:
    """Which numbers are made of each episode.

    Attributes:
        reference: whose model it is.
        changes: effects that may act besides the reference's.
        all: changes' amplitudes, then channels' residuals.
    """

    reference: Reference
    changes: tuple[Candidate, ...]
    all: tuple[Statistic, ...]

    @classmethod
    def of(cls, reference: Reference, logs: Sequence[Log]) -> "Statistics":
        """Returns the numbers of all changes that logs of the reference may show."""
        model = reference.model(logs)
        changes = tuple(candidates(model, registered_effects()))
        return cls._of(reference, changes, _changeable(reference, model, changes))

    @classmethod
    def from_mapping(cls, reference: Reference, raw: dict[str, Any]) -> "Statistics":
        """Returns what `to_mapping` gave."""
        known = tuple(Statistic(**each) for each in raw["all"])
        return cls(reference, candidates_of(raw["changes"]), known)

    @classmethod
    def _of(
        cls, reference: Reference, changes: tuple[Candidate, ...], model: LogModel
    ) -> "Statistics":
        own, found = iter(model.parameters), []
        for candidate in changes:
            for field in candidate.fields:
                parameter = next(own)
                floor = _ROUNDING * (parameter.high - parameter.low)
                text = f"{candidate.text}.{field}"
                size = len(candidate.fields)
                each = Statistic(candidate.name, text, parameter.unit, floor, size)
                found.append(each)
        for channel in model.measurements.channels:
            name = f"{RESIDUAL} of {channel.name}"
            found.append(Statistic(name, name, "1", _ROUNDING))
        return cls(reference, changes, tuple(found))

    def to_mapping(self) -> dict[str, Any]:
        """Returns all but the reference as plain data."""
        return {
            "changes": mappings_of(self.changes),
            "all": [each.to_mapping() for each in self.all],
        }

    @functools.cached_property
    def weights(self) -> Array:
        """Weight (K,) of each: one for each effect, shared by its amplitudes."""
        names = [each.name for each in self.all]
        counts = Counter(names)
        share = np.array([1.0 / counts[name] for name in names])
        return np.asarray(share / share.sum())

    @functools.cached_property
    def groups(self) -> tuple[range, ...]:
        """Numbers of each change's amplitudes."""
        ends = np.cumsum([len(each.fields) for each in self.changes]).tolist()
        return tuple(range(a, b) for a, b in itertools.pairwise([0, *ends]))

    @functools.cached_property
    def floors(self) -> Array:
        """Standard deviations (K,) below which scatter is rounding."""
        return np.array([each.floor for each in self.all])

    def of_episode(self, log: Log) -> "EpisodeNumbers":
        """Returns the numbers of a log of one episode.

        Raises:
            DisasmError: the log is of another robot, or lacks what the model needs.
        """
        return self.linearised(log).numbers()

    def linearised(self, log: Log) -> "LinearEpisode":
        """Returns a log of one episode near the reference's values.

        Raises:
            DisasmError: the log is of another robot, or lacks what the model needs.
        """
        return self._linear_episode(self.reference.model([log]), with_own=False)

    def of_reference(self, logs: Sequence[Log]) -> "list[EpisodeNumbers]":
        """Returns the numbers of the reference's episodes.

        Of those that the model was fitted to as if it had not been: each is left out
        of the fit in turn, by one Gauss-Newton step. Of a model fitted to a single
        episode that one is left out.
        """
        parts, is_fitted = [], []
        for log in logs:
            for episode in log.episodes:
                one = dataclasses.replace(log, episodes=(episode,))
                model = self.reference.model([one])
                part = self._linear_episode(model, with_own=True)
                parts.append(_Products.of(part))
                is_fitted.append(model.measurements.names[0] in self.reference.fitted)
        pairs = zip(parts, _left_out(parts, is_fitted), strict=True)
        return [part.numbers(change) for part, change in pairs if change is not None]

    def _channel_weights(self, model: LogModel) -> Array:
        """Returns the weight (channels,) of each: what the reference left has power 1.

        One where the noise is stated.
        """
        power = np.array(self.reference.residual) ** 2
        if self.reference.noise_is_stated:
            return np.ones(len(power))
        labels = np.array(model.noise_groups)
        pooled = np.array([power[labels == label].mean() for label in labels])
        return np.asarray(1.0 / np.maximum(pooled, _LEAST_POWER))

    def _linear_episode(self, model: LogModel, with_own: bool) -> "LinearEpisode":
        """Returns a model of one episode near the reference's values.

        Args:
            model: with its effects and parameters.
            with_own: whether derivatives by these are wanted.
        """
        values = np.array([self.reference.values[p.name] for p in model.parameters])
        model = model.begun(values)
        changed = _changeable(self.reference, model, self.changes)
        linear = self._linearised(changed, nominal_values(changed.parameters))
        slope = Scaling(changed.parameters).slope(nominal_values(changed.parameters))
        own = np.zeros((*linear.residual.shape, 0))
        if with_own and len(values):
            own = self._linearised(model, values).jacobian
        weights = self._channel_weights(model)
        return LinearEpisode(own, linear, weights, slope, self.groups)

    def _linearised(self, model: LogModel, theta: Array) -> Linearisation:
        """Returns the residual of a model and its derivatives at parameters (p,)."""
        delta = self.reference.huber_delta
        objective = Objective(model, huber_delta=delta, surrogate=model.surrogate())
        return linearise(objective, objective.scaling.to_unit(theta), central=False)


@dataclass(frozen=True)
class EpisodeNumbers:
    """What an episode shows.

    Attributes:
        values: (K,) of the statistics; NaN of a change that it does not show.
        right: (k,) products of the changes' derivatives and the residual.
        grams: (q,) of each change's derivatives with each other, one after the other.
        loss: weighted square of the residual.
        rows: of the episode.
    """

    values: Array
    right: Array
    grams: Array
    loss: float
    rows: int


@dataclass(frozen=True)
class LinearEpisode:
    """An episode near the reference's values.

    Attributes:
        own: (rows, channels, p) derivatives by the model's parameters.
        linear: residual, and its derivatives by changes.
        weights: (channels,).
        slope: (K,) of each amplitude, SI, by the unit of its derivative.
        groups: numbers of each change's amplitudes.
    """

    own: Array
    linear: Linearisation
    weights: Array
    slope: Array
    groups: tuple[range, ...]

    def with_residual(self, residual: Array) -> "LinearEpisode":
        """Returns the same motion with another residual (rows, channels)."""
        linear = dataclasses.replace(self.linear, residual=residual)
        return dataclasses.replace(self, linear=linear)

    def numbers(self) -> EpisodeNumbers:
        """Returns what the episode shows."""
        nothing = np.append(np.zeros(self.own.shape[2]), 1.0)
        return _Products.of(self).numbers(nothing)


@dataclass(frozen=True)
class _Products:
    """Products of an episode's columns and residual.

    Attributes:
        left: (channels, p + 1, p + 1) of derivatives by the model's p parameters and
            of the residual, which is last, by channel.
        cross: (p + 1, K) of those and the derivatives by changes, weighted.
        power: (K,) of these by themselves.
        grams: see EpisodeNumbers.
        weights: (channels,).
        slope: (K,) of each amplitude, SI, by the unit of its derivative.
        rows: of the episode.
    """

    left: Array
    cross: Array
    power: Array
    grams: Array
    weights: Array
    slope: Array
    rows: int

    @classmethod
    def of(cls, episode: LinearEpisode) -> "_Products":
        """Returns the products of an episode."""
        linear, weights, rows = episode.linear, episode.weights, len(episode.own)
        left = np.concatenate([episode.own, linear.residual[..., None]], axis=2)
        root = np.sqrt(linear.weights)[..., None]
        left, columns = root * left, root * linear.jacobian
        whole = np.sqrt(weights)[:, None]
        flat = (whole * columns).reshape(-1, columns.shape[2])
        right = (whole * left).reshape(-1, left.shape[2])
        power = np.sum(flat**2, axis=0)
        parts = (flat[:, group.start : group.stop] for group in episode.groups)
        grams = np.concatenate([(part.T @ part).reshape(-1) for part in parts])
        by_channel = np.einsum("rci,rcj->cij", left, left, optimize=True)
        cross = right.T @ flat
        return cls(by_channel, cross, power, grams, weights, episode.slope, rows)

    def numbers(self, change: Array) -> EpisodeNumbers:
        """Returns what the episode shows.

        Args:
            change: (p + 1,) of the model's parameters, and 1 for the residual.
        """
        shows = self.power > _SHOWN**2 * self.rows
        right = change @ self.cross
        power = np.where(shows, self.power, np.inf)
        amplitudes = np.where(shows, -right / power * self.slope, np.nan)
        losses = np.einsum("i,cij,j->c", change, self.left, change) / self.rows
        values = np.concatenate([amplitudes, 0.5 * np.log(losses + _LEAST_POWER)])
        loss = float(self.weights @ losses) * self.rows
        return EpisodeNumbers(values, right, self.grams, loss, self.rows)


def _left_out(
    parts: Sequence[_Products], is_fitted: Sequence[bool]
) -> list[Array | None]:
    """Returns how the model's parameters change if each episode is not fitted.

    (p + 1,), the last is 1. None of an episode that alone was fitted.
    """
    size = parts[0].left.shape[1] - 1
    nothing = np.append(np.zeros(size), 1.0)
    if not size:
        return [nothing for _ in parts]
    fitted = [i for i, own in enumerate(is_fitted) if own]
    grams = {i: np.tensordot(parts[i].weights, parts[i].left, 1) for i in fitted}
    total = np.sum(list(grams.values()), axis=0)

    def _step(gram: Array) -> Array:
        return -solve(gram[:-1, :-1], gram[:-1, -1])

    changes: list[Array | None] = [nothing for _ in parts]
    for i in fitted:
        own = _step(total - grams[i]) - _step(total) if len(fitted) > 1 else None
        changes[i] = None if own is None else np.append(own, 1.0)
    return changes


def _changeable(
    reference: Reference, model: LogModel, changes: Sequence[Candidate]
) -> LogModel:
    """Returns the model at the reference's values, with changes' amplitudes to vary.

    A change acts besides the effects that the model has, of its own kind, too.
    """
    fixed = model.freeze({p.name: reference.values[p.name] for p in model.parameters})
    bare, _ = extended(fixed.with_effects(()), changes)
    before = fixed.effects
    amplitudes = [moved_behind(both_ways(p), len(before)) for p in bare.parameters]
    assert all(field_of(p) for p in bare.parameters)
    return fixed.with_effects([*before, *bare.effects], amplitudes)

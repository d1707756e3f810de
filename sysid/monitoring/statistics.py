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
from sysid.fitting.candidates import Candidate, candidates, extended
from sysid.identification.linearisation import Linearisation, linearise
from sysid.models import LogModel
from sysid.models.changed import both_ways, moved_behind
from sysid.models.effects import field_of
from sysid.monitoring.linear_episode import (
    LEAST_POWER,
    EpisodeNumbers,
    LinearEpisode,
    Products,
    left_out,
)
from sysid.monitoring.plain_effects import candidates_of, mappings_of
from sysid.monitoring.reference import Reference
from sysid.objective import Objective
from sysid.parameters import Scaling, nominal_values

Array = NDArray[np.float64]

_ROUNDING = 1e-9  # of an amplitude's range, and of a logarithm
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

    def of_episode(self, log: Log) -> EpisodeNumbers:
        """Returns the numbers of a log of one episode.

        Raises:
            DisasmError: the log is of another robot, or lacks what the model needs.
        """
        return self.linearised(log).numbers()

    def linearised(self, log: Log) -> LinearEpisode:
        """Returns a log of one episode near the reference's values.

        Raises:
            DisasmError: the log is of another robot, or lacks what the model needs.
        """
        return self._linear_episode(self.reference.model([log]), with_own=False)

    def of_reference(self, logs: Sequence[Log]) -> list[EpisodeNumbers]:
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
                parts.append(Products.of(part))
                is_fitted.append(model.measurements.names[0] in self.reference.fitted)
        pairs = zip(parts, left_out(parts, is_fitted), strict=True)
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
        return np.asarray(1.0 / np.maximum(pooled, LEAST_POWER))

    def _linear_episode(self, model: LogModel, with_own: bool) -> LinearEpisode:
        """Returns a model of one episode near the reference's values.

        Args:
            model: with its effects and parameters.
            with_own: whether derivatives by these are wanted.
        """
        values = np.array([self.reference.values[p.name] for p in model.parameters])
        model = model.with_begins(values)
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

"""Hides effects of a given size in a model whose parameters are known."""

import dataclasses
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import Reach, registered_effects
from sysid.fitting.candidates import Candidate, candidates, extended
from sysid.models.base import LogModel
from sysid.parameters import Parameter

Array = NDArray[np.float64]

_ROUNDS = 12  # to the size that is asked for
_CLOSE = 0.05  # of it
_FIRST = 1e-3  # of an amplitude's range
_MOST_OF_RANGE = 0.9  # an amplitude at its bound is no estimate
_MOST_FIELDS = 2
_RANK = 1e-9  # of the largest singular value


@dataclasses.dataclass(frozen=True)
class Truth:
    """What a simulated device does.

    Attributes:
        model: with the effects.
        theta: (p,) its parameters.
        noise: (channels,) standard deviation, SI.
        own: (rows * channels, k) what the model's own parameters can take up, an
            orthonormal basis, in units of the noise.
        hidden: names of the effects.
        values: of the effects' parameters, by "name.field".
    """

    model: LogModel
    theta: Array
    noise: Array
    own: Array
    hidden: tuple[str, ...] = ()
    values: dict[str, float] = dataclasses.field(default_factory=dict)

    @classmethod
    def of(cls, model: LogModel, theta: Array, noise: Array) -> Self:
        """Returns a device without effects, of an affine model."""
        steps = np.eye(len(theta))
        start = model.predictions(theta)
        columns = [
            ((model.predictions(theta + d) - start) / noise).ravel() for d in steps
        ]
        return cls(model, theta, noise, _basis(np.column_stack(columns)))

    @property
    def clean(self) -> Array:
        """What is measured without noise (rows, channels), SI."""
        return self.model.predictions(self.theta)

    def on(self, other: LogModel) -> Array:
        """Returns what is measured without noise on another motion, SI."""
        model = other.with_effects(self.model.effects, self._of_effects(other))
        return model.predictions(self.theta)

    def _of_effects(self, other: LogModel) -> Sequence[Parameter]:
        return self.model.parameters[len(other.parameters) :]

    def size(self, longer: LogModel, theta: Array) -> float:
        """Returns the rms that the model's own parameters can't take up.

        Of another model's predictions beyond this one's, in units of the noise, of
        the channel where it is largest.
        """
        change = (longer.predictions(theta) - self.clean) / self.noise
        flat = change.ravel()
        left = (flat - self.own @ (self.own.T @ flat)).reshape(change.shape)
        return float(np.sqrt(np.mean(left**2, axis=0)).max())


def hide(
    truth: Truth, kinds: Sequence[str], level: float, random: np.random.Generator
) -> Truth:
    """Returns the device with one more effect.

    Args:
        truth: the device so far.
        kinds: names of classes; the first that this motion can show at that size.
        level: see `Truth.size`.
        random: draws place, amplitudes, signs and shape.

    Raises:
        DisasmError: none of them can be shown.
    """
    for kind in kinds:
        library = [e for e in registered_effects() if e.__name__ == kind]
        places = {c.name: c for c in candidates(truth.model, library)}
        names = [name for name in places if name not in truth.hidden]
        for number in random.permutation(len(names)):
            found = _of_size(truth, places[names[number]], level, random)
            if found is not None:
                return found
    raise DisasmError(f"none of {', '.join(kinds)} shows at {level:g} times the noise")


def hide_at_all_joints(
    truth: Truth, kind: str, level: float, random: np.random.Generator
) -> Truth:
    """Returns the device with a kind of effect at each of its joints."""
    library = [e for e in registered_effects() if e.__name__ == kind]
    for candidate in {c.name: c for c in candidates(truth.model, library)}.values():
        truth = _of_size(truth, candidate, level, random) or truth
    return truth


def _of_size(
    truth: Truth, candidate: Candidate, level: float, random: np.random.Generator
) -> Truth | None:
    """Returns the device with an effect of a size; None if it can't be so large."""
    count = int(random.integers(1, min(_MOST_FIELDS, len(candidate.fields)) + 1))
    chosen = tuple(random.permutation(candidate.fields)[:count])
    longer, (new,) = extended(truth.model, [candidate], with_shapes=True)
    own = [longer.parameters[i] for i in new]
    shares = random.uniform(0.5, 1.0, len(own))
    signs = np.where(random.random(len(own)) < 0.5, -1.0, 1.0)
    signs = np.where([p.low < p.nominal for p in own], signs, 1.0)
    scale, reach = _FIRST, truth.model.reach
    for _ in range(_ROUNDS):
        values = [
            _value(p, candidate, share, sign * scale, chosen, reach)
            for p, share, sign in zip(own, shares, signs, strict=True)
        ]
        theta = np.concatenate([truth.theta, values])
        size = truth.size(longer, theta)
        if abs(size / level - 1.0) < _CLOSE:
            named = {p.name: v for p, v in zip(own, values, strict=True)}
            return dataclasses.replace(
                truth,
                model=longer,
                theta=theta,
                hidden=(*truth.hidden, candidate.name),
                values=truth.values | named,
            )
        scale *= float(np.clip(level / max(size, 1e-9), 0.1, 10.0))
    return None


def _value(
    parameter: Parameter,
    candidate: Candidate,
    share: float,
    scale: float,
    chosen: Sequence[str],
    reach: Reach,
) -> float:
    """Returns a parameter's value: an amplitude at a scale, or a shape in its grid."""
    field = parameter.name.rpartition(".")[2]
    if parameter.is_shape:
        grid = type(candidate.effect).grids(reach)[field]
        return _between(parameter, min(grid), max(grid), 2.0 * share - 1.0)
    if field not in chosen:
        return parameter.nominal
    low, high = _MOST_OF_RANGE * parameter.low, _MOST_OF_RANGE * parameter.high
    return float(np.clip(scale * share * parameter.high, low, high))


def _between(parameter: Parameter, low: float, high: float, share: float) -> float:
    """Returns a value between two, by its logarithm if both have one."""
    low, high = np.clip([low, high], parameter.low, parameter.high)
    if low <= 0.0:
        return float(low + (high - low) * share)
    return float(low * (high / low) ** share)


def _basis(columns: Array) -> Array:
    """Returns an orthonormal basis of what columns (n, k) span."""
    scale = np.linalg.norm(columns, axis=0)
    shown = columns[:, scale > 0.0] / scale[scale > 0.0]
    left, values, _ = np.linalg.svd(shown, full_matrices=False)
    return np.asarray(left[:, values > _RANK * values[0]])

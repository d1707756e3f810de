"""Does every parameter affect the predictions, and does this log determine it?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid import confidence
from sysid.identification.linearisation import (
    FIRST_STEP,
    WIDE_STEP,
    Linearisation,
    linearise,
)
from sysid.objective import Objective
from sysid.parameters import Parameter

Array = NDArray[np.float64]

#: Half width of the 95 % interval, over the parameters' range, beyond which the log
#: does not determine a combination even for a perfect model.
LOOSE = 0.5

_MEANINGLESS = 100.0  # ranges: an interval so wide is no figure
_PROBES = (0.05, 0.5, 0.95)  # of the range, where a parameter without slope is tried
_NAMED = 0.3  # least share of a parameter in a combination that is named
_WEAK = 0.02  # rms change over a step, in units of the noise, to look at a wider one
_SILENT = 1e-9  # rms change, in units of the noise, that counts as none


@dataclass(frozen=True)
class Combination:
    """A direction in the parameters' unit box.

    Attributes:
        weights: (p,) of length 1.
        interval: half width of its 95 % interval, in ranges, for a perfect model.
    """

    weights: Array
    interval: float

    @property
    def loose(self) -> bool:
        """Whether the log does not determine it."""
        return self.interval > LOOSE

    def text(self, names: Sequence[str]) -> str:
        """Returns its largest weights, signed, with the parameters' names."""
        order = np.argsort(-np.abs(self.weights))
        sign = np.sign(self.weights[order[0]])
        parts = [
            f"{sign * self.weights[i]:+.2f} {names[i]}"
            for i in order
            if abs(self.weights[i]) >= _NAMED
        ]
        return " ".join(parts)


@dataclass(frozen=True)
class Sensitivity:
    """What a log determines about parameters, by the derivatives at one point.

    Attributes:
        names: of the parameters.
        effect: (p,) rms change of the residuals over a parameter's range, in units
            of the noise, by the slope at the point.
        silent: names of those that change nothing anywhere in their range.
        combinations: orthogonal directions, the best determined first, without the
            silent parameters.
    """

    names: tuple[str, ...]
    effect: Array
    silent: tuple[str, ...]
    combinations: tuple[Combination, ...]

    @property
    def loose(self) -> tuple[Combination, ...]:
        """The combinations that the log does not determine."""
        return tuple(c for c in self.combinations if c.loose)

    @property
    def complaints(self) -> list[str]:
        """Returns a line for each parameter or combination that is not determined."""
        lines = [
            f"{name}: has no effect on this log's channels anywhere within its bounds"
            for name in self.silent
        ]
        names = self.names
        return lines + [
            f"{c.text(names)}: this log {_how_well(c.interval)}" for c in self.loose
        ]

    def to_freeze(self) -> list[str]:
        """Returns the silent ones, and one parameter of each loose combination."""
        chosen = list(self.silent)
        for combination in self.loose:
            order = np.argsort(-np.abs(combination.weights))
            free = [self.names[i] for i in order if self.names[i] not in chosen]
            chosen += free[:1]
        return chosen


def _how_well(interval: float) -> str:
    """Returns how well a combination is determined, from its interval in ranges."""
    if interval > _MEANINGLESS:
        return "does not determine the combination near its present value"
    return f"determines the combination only to +-{100 * interval:.0f} % of its range"


def sensitivity(objective: Objective, u: Array) -> Sensitivity:
    """Returns what the log says about parameters at a point (p,) of the unit box."""
    linearisation = linearise(objective, u)
    weak = linearisation.effect * 2.0 * FIRST_STEP < _WEAK
    if weak.any():
        linearisation = linearise(objective, u, np.where(weak, WIDE_STEP, FIRST_STEP))
    flat = np.flatnonzero(linearisation.effect <= _SILENT)
    names = [p.name for p in objective.model.parameters]
    silent = [names[i] for i in flat if _is_silent(objective, linearisation, int(i))]
    return of_linearisation(linearisation, objective.model.parameters, silent)


def of_linearisation(
    linearisation: Linearisation,
    parameters: Sequence[Parameter],
    silent: Sequence[str] = (),
) -> Sensitivity:
    """Returns the same from derivatives that are known already."""
    names = tuple(p.name for p in parameters)
    active = np.array([name not in silent for name in names])
    return Sensitivity(
        names, linearisation.effect, tuple(silent), _combinations(linearisation, active)
    )


def _combinations(
    linearisation: Linearisation, active: NDArray[np.bool_]
) -> tuple[Combination, ...]:
    """Returns the right singular vectors of the scaled Jacobian."""
    if not active.any():
        return ()
    _, s, Vt = np.linalg.svd(
        linearisation.flat_jacobian[:, active], full_matrices=False
    )
    combinations = []
    for size, row in zip(s, Vt, strict=True):
        weights = np.zeros(len(active))
        weights[active] = row
        combinations.append(
            Combination(weights, float(confidence.Z / max(size, 1e-300)))
        )
    return tuple(combinations)


def _is_silent(objective: Objective, linearisation: Linearisation, number: int) -> bool:
    """Returns whether a parameter without slope changes nothing elsewhere either."""
    points = np.tile(linearisation.u, (len(_PROBES), 1))
    points[:, number] = _PROBES
    found = objective.residuals(objective.scaling.from_unit(points))
    return all(np.abs(r - linearisation.residual).max() <= _SILENT for r in found)

"""What an identification found."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid.identification.agreement import Verdict
from sysid.identification.profile import Profile
from sysid.identification.sensitivity import Sensitivity
from sysid.identification.uncertainty import Uncertainty
from sysid.models.base import Channel
from sysid.optimise.trace import Trace
from sysid.parameters import Parameter

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SearchPart:
    """One part of a method's search.

    Attributes:
        name: such as "bees, global".
        rows: of the log that each evaluation simulated.
        trace: values of the objective of those rows, points in the unit box.
    """

    name: str
    rows: int
    trace: Trace


@dataclass(frozen=True)
class MethodResult:
    """Where one method ended.

    Attributes:
        name: "bees" or "nlopt".
        parts: of the search, in order.
        u: (p,) its optimum in the unit box.
        value: of the objective on all fitted rows.
    """

    name: str
    parts: tuple[SearchPart, ...]
    u: Array
    value: float


@dataclass(frozen=True)
class Comparison:
    """One set of rows, before and after the fit.

    Attributes:
        measured, before, after: (rows, channels), SI.
        episode: (rows,) number of each row's episode.
        names: of the episodes.
        value_before, value_after: of the objective.
    """

    measured: Array
    before: Array
    after: Array
    episode: NDArray[np.int64]
    names: tuple[str, ...]
    value_before: float
    value_after: float

    def rms(self, predicted: Array) -> Array:
        """Returns the rms error (channels,) of a prediction, SI."""
        return np.sqrt(np.mean((predicted - self.measured) ** 2, axis=0))

    def relative_error(self, predicted: Array) -> Array:
        """Returns the norm of the error over the norm of the channel (channels,)."""
        norm = np.linalg.norm(self.measured, axis=0)
        error = np.linalg.norm(predicted - self.measured, axis=0)
        return error / np.maximum(norm, 1e-300)

    def relative_errors(self, predicted: Array, units: list[str]) -> dict[str, float]:
        """Returns the same over all channels of each unit."""
        found = {}
        for unit in dict.fromkeys(units):
            mask = np.array([u == unit for u in units])
            norm = float(np.linalg.norm(self.measured[:, mask]))
            error = float(np.linalg.norm((predicted - self.measured)[:, mask]))
            found[unit] = error / max(norm, 1e-300)
        return found


@dataclass(frozen=True)
class Identified:
    """The whole result; all arrays of p are over `parameters`.

    Attributes:
        parameters: that were fitted.
        frozen: those that were not, by choice, and their values.
        channels: with the noise that weighted them.
        start, theta: (p,) values before and after.
        u: (p,) the result in the unit box.
        interval_gn, interval_bootstrap: (p, 2) 95 % intervals.
        spread: in the unit box.
        before, after: what the log can say, at the start and at the result.
        methods: by name.
        best: name of the one whose values are taken.
        verdict: of two methods.
        profiles: those that were asked for.
        fitted, held_out: predictions before and after; None without held-out rows.
        whiteness: (channels,) p-values of Ljung-Box on the fitted rows.
        floor: value of the objective for a perfect model.
        derived: quantities computed from theta: value, unit, 95 % interval.
        evaluations, failures: parameter sets simulated, and those that failed.
        notes: what a reader should know.
    """

    parameters: tuple[Parameter, ...]
    frozen: dict[str, float]
    channels: tuple[Channel, ...]
    start: Array
    theta: Array
    u: Array
    interval_gn: Array
    interval_bootstrap: Array
    spread: Uncertainty
    before: Sensitivity
    after: Sensitivity
    methods: dict[str, MethodResult]
    best: str
    verdict: Verdict | None
    profiles: tuple[Profile, ...]
    fitted: Comparison
    held_out: Comparison | None
    whiteness: Array
    floor: float
    derived: dict[str, tuple[float, str, tuple[float, float]]]
    evaluations: int
    failures: int
    notes: list[str] = field(default_factory=list)

"""What an identification found."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from drake_disasm.scenario import Scenario
from sysid.identification.agreement import Agreement
from sysid.identification.profile import Profile
from sysid.identification.sensitivity import Sensitivity
from sysid.identification.uncertainty import Uncertainty
from sysid.models.base import LogModel
from sysid.models.measurements import Channel
from sysid.optimise.trace import Trace
from sysid.parameters import Parameter, Scaling, by_name

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SearchStage:
    """One stage of a method's search.

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
        stages: of the search, in order.
        u: (p,) its optimum in the unit box.
        value: of the objective on all fitted rows.
    """

    name: str
    stages: tuple[SearchStage, ...]
    u: Array
    value: float


@dataclass(frozen=True)
class Comparison:
    """Measurements and predictions of some rows, before and after the fit.

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

    def relative_errors(
        self, predicted: Array, units: Sequence[str]
    ) -> dict[str, float]:
        """Returns the same over all channels of each unit."""
        found = {}
        for unit in dict.fromkeys(units):
            mask = np.array([u == unit for u in units])
            norm = float(np.linalg.norm(self.measured[:, mask]))
            error = float(np.linalg.norm((predicted - self.measured)[:, mask]))
            found[unit] = error / max(norm, 1e-300)
        return found


@dataclass(frozen=True)
class Identification:
    """What was identified, and how reliable it is.

    All arrays of p are over `parameters`; the unit box [0, 1]^p is theirs, scaled.

    Attributes:
        model: of the whole log, with what was frozen and with estimated noise.
        frozen: values of parameters that were not fitted because the log does not
            determine them, by name.
        start, theta: (p,) values before and after, SI.
        u: (p,) theta in the unit box.
        uncertainty: of the estimate, in the unit box.
        sensitivity_before, sensitivity_after: what the log determines, by the
            derivatives at the start and at the result.
        methods: where each method ended, by name.
        best_method: name of the one whose values are taken.
        agreement: of the two methods; None where one ran.
        profiles: profile likelihoods that were asked for.
        fitted, held_out: measured and predicted rows; None if none were held out.
        whiteness: (channels,) p-values of Ljung-Box on the fitted rows.
        noise_floor: value of the objective for a perfect model.
        derived: quantities computed from theta: value, unit, 95 % interval.
        evaluations, failures: parameter sets simulated, and those that failed.
        notes: warnings for the reader.
    """

    model: LogModel
    frozen: dict[str, float]
    start: Array
    theta: Array
    u: Array
    uncertainty: Uncertainty
    sensitivity_before: Sensitivity
    sensitivity_after: Sensitivity
    methods: dict[str, MethodResult]
    best_method: str
    agreement: Agreement | None
    profiles: tuple[Profile, ...]
    fitted: Comparison
    held_out: Comparison | None
    whiteness: Array
    noise_floor: float
    derived: dict[str, tuple[float, str, tuple[float, float]]]
    evaluations: int
    failures: int
    notes: list[str] = field(default_factory=list)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters that were fitted."""
        return self.model.parameters

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels, with the noise that weighted them."""
        return self.model.measurements.channels

    @property
    def values(self) -> dict[str, float]:
        """The identified values by the parameters' names, SI."""
        return dict(by_name(self.parameters, self.theta))

    @property
    def scenario(self) -> Scenario | None:
        """The identified scenario; None if the model has none."""
        return self.model.scenario_at(self.theta)

    @property
    def interval_gauss_newton(self) -> Array:
        """95 % intervals (p, 2), SI, that assume white residuals."""
        return self._interval(self.uncertainty.gauss_newton)

    @property
    def interval_bootstrap(self) -> Array:
        """95 % intervals (p, 2), SI, right for residuals that are correlated."""
        return self._interval(self.uncertainty.bootstrap)

    def _interval(self, relative: Array) -> Array:
        """Returns intervals (p, 2) about u, in the unit box, as ones of parameters."""
        ends = np.clip(self.u[:, None] + relative, 0.0, 1.0)
        scaling = Scaling(self.parameters)
        return np.column_stack([scaling.from_unit(side) for side in ends.T])

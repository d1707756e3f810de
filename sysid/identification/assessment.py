"""From the optima that searches found to a result: how good it is, and how certain."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from drake_disasm.common.progress import Progress, ProgressUpdate
from sysid import confidence
from sysid.identification.agreement import Agreement, compare_methods
from sysid.identification.linearisation import (
    Linearisation,
    fitting_steps,
    linearise,
)
from sysid.identification.profile import Profile, profile
from sysid.identification.result import Comparison, Identification, MethodResult
from sysid.identification.sensitivity import Sensitivity, of_linearisation
from sysid.identification.uncertainty import uncertainty
from sysid.identification.whiteness import ljung_box
from sysid.models.base import LogModel
from sysid.objective import Objective, pseudo_residual
from sysid.parameters import nominal_values
from sysid.workers import Workers

Array = NDArray[np.float64]

_AT_BOUND = 1e-3  # of the range: an optimum this near a bound is on it
_PROFILE_REACH = 3.0  # standard deviations to each side


class Assessment:
    """What can be said of the optima that the methods found on all fitted rows."""

    def __init__(
        self,
        full: Objective,
        held_out: Objective | None,
        methods: Mapping[str, MethodResult],
    ) -> None:
        """Linearises at the better optimum.

        Args:
            full: the objective on all fitted rows.
            held_out: on the rows that were not fitted.
            methods: where each method ended, by name.
        """
        self._full, self._held_out = full, held_out
        self._methods = dict(methods)
        self._best = min(methods.values(), key=lambda result: result.value)
        linearisation = _linearised(full, self._best.u)
        self._u = linearisation.u
        episode = full.model.measurements.episode
        self._uncertainty = uncertainty(linearisation, episode)
        self._sensitivity = of_linearisation(linearisation, full.model.parameters)

    def result(
        self,
        model: LogModel,
        frozen: Mapping[str, float],
        before: Sensitivity,
        profiles: Sequence[Profile],
        counts: tuple[int, int],
        notes: Sequence[str],
    ) -> Identification:
        """Returns the result of the identification.

        Args:
            model: of the whole log.
            frozen: values that were not fitted, by name.
            before: sensitivity at the start.
            profiles: that were asked for.
            counts: parameter sets evaluated, and those that failed.
            notes: warnings that are not about the optima.
        """
        full, u, held_out = self._full, self._u, self._held_out
        warnings = self._notes(frozen)
        start = nominal_values(full.model.parameters)
        theta = full.scaling.from_unit(u)
        fitted = _comparison(full, start, theta)
        residual = (fitted.after - fitted.measured) / full.model.measurements.sigma
        return Identification(
            model=model,
            frozen=dict(frozen),
            start=start,
            theta=theta,
            u=u,
            uncertainty=self._uncertainty,
            sensitivity_before=before,
            sensitivity_after=self._sensitivity,
            methods=self._methods,
            best_method=self._best.name,
            agreement=self._agreement(),
            profiles=tuple(profiles),
            fitted=fitted,
            held_out=_comparison(held_out, start, theta) if held_out else None,
            whiteness=np.array([ljung_box(column) for column in residual.T]),
            noise_floor=noise_floor(full.huber_delta),
            derived=self._derived(),
            evaluations=counts[0],
            failures=counts[1],
            notes=[*warnings, *notes],
        )

    def profile(self, name: str, workers: Workers, progress: Progress) -> Profile:
        """Returns the profile likelihood of a parameter about the optimum."""
        names = [p.name for p in self._full.model.parameters]
        i = names.index(name)
        deviation = np.sqrt(self._uncertainty.bootstrap_covariance[i, i])
        reach = _PROFILE_REACH * float(deviation)

        def report(done: int, total: int) -> None:
            """Passes on how many points are done."""
            progress(ProgressUpdate(f"profile of {name}", done, total))

        return profile(self._full, workers, self._u, name, reach, callback=report)

    def _notes(self, frozen: Mapping[str, float]) -> list[str]:
        """Returns what a reader should be warned of."""
        notes = [f"{name} was frozen at {value:g}" for name, value in frozen.items()]
        parameters = self._full.model.parameters
        for parameter, place in zip(parameters, self._u, strict=True):
            if min(place, 1.0 - place) < _AT_BOUND:
                notes.append(
                    f"{parameter.name} ended on a bound: widen it, or the model lacks "
                    "something that this parameter stands in for"
                )
        notes += [f"at the result: {line}" for line in self._sensitivity.complaints]
        if self._held_out is None:
            notes.append(
                "no episode was held out: whether the fit generalises is unknown; "
                "record several episodes"
            )
        for reason in dict.fromkeys(text for _, text in self._full.failures):
            notes.append(f"a simulation failed: {reason}")
        return notes

    def _agreement(self) -> Agreement | None:
        if len(self._methods) != 2:
            return None
        first, second = self._methods.values()
        return compare_methods(
            (first.name, second.name),
            (first.u, second.u),
            (first.value, second.value),
            self._full.model.measurements.values.size,
            self._uncertainty,
            self._sensitivity.names,
        )

    def _derived(self) -> dict[str, tuple[float, str, tuple[float, float]]]:
        """Returns what the model derives from theta, with bootstrap intervals."""
        model, scaling = self._full.model, self._full.scaling
        described = model.describe(scaling.from_unit(self._u))
        if not described:
            return {}
        points = np.clip(self._u + self._uncertainty.draws, 0.0, 1.0)
        drawn = [model.describe(draw) for draw in scaling.from_unit(points)]
        found = {}
        for name, (value, unit) in described.items():
            values = [d[name][0] for d in drawn if name in d]
            low, high = np.quantile(values, confidence.QUANTILES)
            found[name] = (value, unit, (float(low), float(high)))
        return found


def noise_floor(huber_delta: float) -> float:
    """Returns the objective of a perfect model with Gaussian noise."""
    z = np.linspace(-12.0, 12.0, 20001)
    density = norm.pdf(z)
    square = np.trapezoid(pseudo_residual(z, huber_delta) ** 2 * density, z)
    return math.sqrt(square)


def _linearised(objective: Objective, u: Array) -> Linearisation:
    """Returns the linearisation with fitting steps, which a first one gives."""
    return linearise(objective, u, fitting_steps(linearise(objective, u)))


def _comparison(objective: Objective, start: Array, theta: Array) -> Comparison:
    measured = objective.model.measurements
    residuals = objective.residuals(np.array([start, theta]))
    return Comparison(
        measured.values,
        objective.predicted(residuals[0]),
        objective.predicted(residuals[1]),
        measured.episode,
        measured.names,
        objective.value(residuals[0]),
        objective.value(residuals[1]),
    )

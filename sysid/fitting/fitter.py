"""Fits a model with chosen effects."""

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sysid.fitting.candidates import Candidate, extended
from sysid.fitting.fit import Fit
from sysid.fitting.fit_cache import cached_array, cached_fit
from sysid.fitting.settings import SelectionSettings
from sysid.identification.gauss_newton import gauss_newton
from sysid.identification.linearisation import Linearisation, extend
from sysid.identification.noise import with_estimated_noise
from sysid.models.base import LogModel
from sysid.objective import Objective
from sysid.parameters import Scaling, by_name
from sysid.workers import Workers

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Fitter:
    """Fits a model with chosen effects to its log.

    Attributes:
        base: the model, with the parameters that it has anyway.
        workers: to evaluate with.
        huber_delta: residual, in standard deviations, beyond which the loss is linear.
        settings: how far a fit goes.
        folder: where fits are kept, for a search that is stopped; None keeps none.
        noise_is_stated: whether the channels' noise is known, else estimated.
        deadline: by `time.monotonic` [s], after which a fit goes no further.
        exact: whether derivatives are the model's own, else those of its surrogate.
    """

    base: LogModel
    workers: Workers
    huber_delta: float
    settings: SelectionSettings
    folder: Path | None = None
    noise_is_stated: bool = True
    exact: bool = False
    deadline: float = math.inf

    @classmethod
    def of(
        cls,
        model: LogModel,
        workers: Workers,
        huber_delta: float,
        settings: SelectionSettings,
        folder: Path | None = None,
    ) -> Self:
        """Returns what fits a model, with its noise estimated where none is stated."""
        base = with_estimated_noise(model, workers, huber_delta)
        is_stated = not np.isnan(model.measurements.noise).any()
        return cls(base, workers, huber_delta, settings, folder, is_stated)

    @property
    def affordable(self) -> "Fitter":
        """The same of so many rows that hundreds of evaluations are affordable.

        Itself where the log has no more than that.
        """
        rows = self.base.measurements.rows
        every = round(rows / self.settings.search_rows)
        thinned = self.base.thin(every) if every >= 2 else self.base
        return self if thinned.measurements.rows == rows else self.with_base(thinned)

    def objective(self, model: LogModel) -> Objective:
        """Returns what is minimised, of a model that extends the base."""
        surrogate = None if self.exact else model.surrogate()
        return Objective(model, self.workers, self.huber_delta, surrogate)

    def fit(
        self,
        effects: tuple[Candidate, ...],
        start: Fit | None = None,
        derivatives: Mapping[str, Array] | None = None,
        values: Mapping[str, float] | None = None,
    ) -> Fit:
        """Returns the model with effects, fitted.

        Its steps begin where its parameters say, fitted so again and again; or, if that
        fits better, where they say without what the model knows of the grip.

        Args:
            effects: of the model.
            start: where to begin; parameters that it does not have begin at null.
            derivatives: (rows, channels) by parameters that the start does not have, by
                name, if all of its parameters are kept; those of shape parameters are
                zero at null.
            values: where else to begin, by name.
        """
        model, _ = extended(self.base, effects, with_shapes=True)
        begin = (start.values if start else {}) | dict(values or {})
        theta = np.array([begin.get(p.name, p.nominal) for p in model.parameters])
        model = model.with_begins(theta)
        known = None
        if start and derivatives is not None:
            u = Scaling(model.parameters).to_unit(theta)
            known = _extended_linearisation(start, model, u, derivatives)
        found = self._fit_of(effects, model, theta, known)
        if found.model.with_begins(found.theta) is found.model:
            return found
        theta = self._settled(effects, theta)
        varied = self._fit_of(effects, model.with_begins(None), theta, is_minimum=True)
        settled = self._at(varied, model.with_begins(theta))
        least = (1.0 - self.settings.fit_min_progress) * settled.objective
        return varied if varied.objective < least else settled

    def _at(self, fit: Fit, model: LogModel) -> Fit:
        """Returns a fit with another model's residuals, and the derivatives it has."""
        objective = self.objective(model)
        [residual] = objective.residuals(fit.theta)
        return dataclasses.replace(
            fit,
            model=model,
            linearisation=fit.linearisation.with_residual(residual),
            objective=objective.value(residual),
        )

    def _settled(self, effects: tuple[Candidate, ...], theta: Array) -> Array:
        """Returns parameters (p,) that fit where the model begins with them.

        Effects on the sensor tell where steps begin, which tells the effects. Shapes
        come last: what a wrong begin leaves may look like any of them. A few rows tell
        it where an evaluation takes seconds.

        Args:
            effects: of the model.
            theta: (p,) where to begin.
        """
        base, few = self.base, self.settings.prescreen_rows
        if base.costly:
            base = base.thin(max(1, round(base.measurements.rows / few)))
        model, _ = extended(base, effects, with_shapes=True)
        values = dict(by_name(model.parameters, theta))
        shapes = {p.name: values[p.name] for p in model.parameters if p.is_shape}
        if shapes:
            held = model.freeze(shapes)
            start = np.array([values[p.name] for p in held.parameters])
            values |= by_name(held.parameters, self._settled_of(effects, held, start))
        start = np.array([values[p.name] for p in model.parameters])
        return self._settled_of(effects, model, start)

    def _settled_of(
        self, effects: tuple[Candidate, ...], model: LogModel, theta: Array
    ) -> Array:
        """Returns what `_settled` does of a model's parameters (p,).

        Each fit takes for known where the model begins with the last; the way there is
        halved if it does not fit better from where it begins itself.
        """
        value = self._value_with_begins(model, theta)
        for _ in range(self.settings.fits_begun_again):
            found = self._fit_of(effects, model.with_begins(theta), theta).theta
            for tried in (found, 0.5 * (theta + found)):
                reached = self._value_with_begins(model, tried)
                if reached < value:
                    break
            else:
                return theta
            gain, theta, value = 1.0 - reached / value, tried, reached
            if gain < self.settings.fit_min_progress:
                break
        return theta

    def _value_with_begins(self, model: LogModel, theta: Array) -> float:
        """Returns the objective at parameters (p,) of a model that begins with them."""
        return float(self.objective(model.with_begins(theta))(theta[None])[0])

    def _fit_of(
        self,
        effects: tuple[Candidate, ...],
        model: LogModel,
        theta: Array,
        known: Linearisation | None = None,
        is_minimum: bool = False,
    ) -> Fit:
        """Returns a model's fit from parameters (p,) on, which may be its minimum."""
        objective = self.objective(model)
        u = objective.scaling.to_unit(theta)
        found = self._minimised(objective, u, known, is_minimum)
        return Fit(
            effects,
            model,
            objective.scaling.from_unit(found.u),
            found,
            objective.value(found.residual),
            self.settings,
            self.noise_is_stated,
        )

    def extended(
        self, known: Linearisation, objective: Objective, u: Array, deadline: float
    ) -> Linearisation:
        """Returns a linearisation with more parameters, as many as there is time for.

        Of a model that takes long the derivatives are cached, as fits are.

        Args:
            known: with the first parameters.
            objective: of all.
            u: (p,) the point, in the unit box.
            deadline: by `time.monotonic` [s], see `extend`.
        """
        model, folder = objective.model, self.folder
        if folder is None or not model.costly:
            return extend(known, objective, u, deadline=deadline)

        def kept(thetas: Array, find: Callable[[], list[Array]]) -> list[Array]:
            """Returns residuals at points, which a run that was stopped may have."""
            on = (model, self.exact, thetas)
            return list(cached_array(folder, on, lambda: np.stack(find())))

        return extend(known, objective, u, deadline=deadline, kept=kept)

    def with_exact_derivatives(self) -> "Fitter":
        """Returns a fitter that uses the model's own derivatives."""
        return dataclasses.replace(self, exact=True)

    def with_base(self, base: LogModel) -> "Fitter":
        """Returns a fitter of another model."""
        return dataclasses.replace(self, base=base)

    def _minimised(
        self,
        objective: Objective,
        u: Array,
        known: Linearisation | None,
        is_minimum: bool,
    ) -> Linearisation:
        """Returns the linearisation at the minimum that is downhill from u (p,)."""
        model, limits = objective.model, self.settings
        iterations, progress = limits.fit_iterations, limits.fit_min_progress
        if model.costly:
            iterations = limits.costly_fit_iterations
            progress = limits.costly_fit_min_progress
        if is_minimum:
            iterations = 0
        return cached_fit(
            None if model.affine else self.folder,
            (model, self.huber_delta, self.exact, u, known, iterations, progress),
            lambda: gauss_newton(
                objective,
                u,
                iterations,
                start=known,
                central=False,
                min_gain=progress,
                deadline=self.deadline,
            ),
            self.deadline,
        )


def _extended_linearisation(
    start: Fit, model: LogModel, u: Array, derivatives: Mapping[str, Array]
) -> Linearisation:
    """Returns a fit's linearisation with derivatives by a model's new parameters."""
    known = start.linearisation
    names = [p.name for p in model.parameters[len(start.theta) :]]
    zero = np.zeros_like(known.residual)
    new = [derivatives.get(name, zero) for name in names]
    jacobian = np.concatenate([known.jacobian, np.stack(new, axis=-1)], axis=-1)
    return dataclasses.replace(known, u=u, jacobian=jacobian)

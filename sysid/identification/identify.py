"""From a model of a log to its identified parameters, and how sure they are."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from sysid.identification.agreement import Verdict, verdict
from sysid.identification.journal import Journal
from sysid.identification.linearisation import (
    Linearisation,
    fitting_steps,
    linearise,
)
from sysid.identification.noise import with_estimated_noise
from sysid.identification.profile import Profile, profile
from sysid.identification.result import Comparison, Identified, MethodResult
from sysid.identification.search import METHODS, Effort, News, Search
from sysid.identification.sensitivity import (
    Sensitivity,
    of_linearisation,
    sensitivity,
)
from sysid.identification.uncertainty import uncertainty
from sysid.identification.whiteness import ljung_box
from sysid.models.base import LogModel
from sysid.objective import Objective, pseudo_residual
from sysid.parameters import nominal_values
from sysid.workers import Workers

Array = NDArray[np.float64]

_THIN_ROWS = (64, 220)  # that a global search and a first descent simulate
_EDGE = 1e-3  # of the range: an optimum this near a bound is on it
_PROFILE_REACH = 3.0  # standard deviations


@dataclass(frozen=True)
class Settings:
    """What a user may choose.

    Attributes:
        methods: "bees", "nlopt", or both.
        effort: how hard they try.
        huber: where squares end, in units of the noise.
        unidentifiable: "stop" or "freeze" what the log can't tell.
        profiles: parameters whose profile likelihood is wanted.
    """

    methods: tuple[str, ...] = METHODS
    effort: Effort = field(default_factory=Effort)
    huber_delta: float = 3.0
    unidentifiable: str = "stop"
    profiles: tuple[str, ...] = ()


def identify(
    model: LogModel,
    train: Sequence[int],
    test: Sequence[int],
    settings: Settings,
    workers: Workers,
    journal: Journal,
    news: News,
) -> Identified:
    """Fits a model to some episodes of its log, and judges it on the others.

    Args:
        model: of the whole log.
        train, test: numbers of its episodes; `test` may be empty.
        settings: what the user chose.
        workers: to evaluate with.
        journal: keeps what was evaluated.
        news: called while it works.

    Raises:
        DisasmError: fewer rows than parameters, or something that the log can't
            tell, unless it is to be frozen.
    """
    model = with_estimated_noise(model, workers, settings.huber_delta)
    fitted = model.of_episodes(train)
    _refuse_small_logs(fitted)
    _refuse_unknown_profiles(fitted, settings.profiles)
    news("sensitivities", 0, 0, np.nan)
    whole = Objective(fitted, workers, settings.huber_delta)
    first = sensitivity(whole, whole.start)
    frozen = _frozen(first, fitted, settings)
    model, fitted = model.freeze(frozen), fitted.freeze(frozen)
    ladder = [Objective(m, workers, settings.huber_delta) for m in thinned(fitted)]
    full = ladder[-1]
    methods = {
        name: Search(name, ladder, settings.effort, journal, news).run()
        for name in settings.methods
    }
    held_out = (
        Objective(model.of_episodes(test), workers, settings.huber_delta)
        if test
        else None
    )
    news("uncertainty", 0, 0, np.nan)
    judged = _Judgement(full, held_out, methods, settings)
    return Identified(
        frozen=dict(frozen),
        before=first,
        profiles=judged.profiles(workers, news),
        evaluations=sum(objective.evaluations for objective in ladder),
        failures=sum(len(objective.failures) for objective in ladder),
        notes=judged.notes(frozen) + list(dict.fromkeys(workers.notes)),
        **judged.findings(),
    )


def thinned(model: LogModel) -> list[LogModel]:
    """Returns a model of few rows, spread evenly, of more, and of all.

    The last alone if there are few rows, or evaluating them costs nothing.
    """
    steps = [model.measurements.rows // rows for rows in _THIN_ROWS]
    if model.affine:
        return [model]
    return [model.thin(every) for every in steps if every >= 2] + [model]


def noise_floor(huber_delta: float) -> float:
    """Returns the objective of a perfect model: rms of tempered Gaussian noise."""
    z = np.linspace(-12.0, 12.0, 20001)
    density = norm.pdf(z)
    return float(
        np.sqrt(np.trapezoid(pseudo_residual(z, huber_delta) ** 2 * density, z))
    )


def _refuse_small_logs(model: LogModel) -> None:
    measured, size = model.measurements, len(model.parameters)
    # Readings at rest say six things each; a transition mostly repeats the one before.
    known = measured.values.size if model.affine else measured.rows
    if known < size:
        what = "numbers" if model.affine else "transitions"
        raise DisasmError(
            f"the log has {known} {what} to fit and there are {size} parameters; "
            "record more, or name fewer --parameters"
        )


def _refuse_unknown_profiles(model: LogModel, names: Sequence[str]) -> None:
    known = [p.name for p in model.parameters]
    for name in names:
        if name not in known:
            raise DisasmError(
                f"--profile {name}: is not fitted; {closest(name, known)}"
            )


def _frozen(
    first: Sensitivity, model: LogModel, settings: Settings
) -> Mapping[str, float]:
    """Returns what is not fitted, at its nominal value.

    Raises:
        DisasmError: the log can't tell something, and the user wants to know.
    """
    if not first.complaints:
        return {}
    if settings.unidentifiable == "stop":
        raise DisasmError(
            "; ".join(first.complaints)
            + "; leave such a parameter out, record motions that show it, or freeze it "
            "by --unidentifiable freeze"
        )
    names = first.to_freeze()
    frozen = {p.name: p.nominal for p in model.parameters if p.name in names}
    if len(frozen) == len(model.parameters):
        raise DisasmError(f"nothing is left to fit: {'; '.join(first.complaints)}")
    return frozen


class _Judgement:
    """What is to be said of the optima that the methods found."""

    def __init__(
        self,
        full: Objective,
        held_out: Objective | None,
        methods: Mapping[str, MethodResult],
        settings: Settings,
    ) -> None:
        self._full, self._held_out = full, held_out
        self._methods, self._settings = dict(methods), settings
        self._best = min(methods.values(), key=lambda result: result.value)
        linearisation = _linearised(full, self._best.u)
        self._u = linearisation.u
        self._spread = uncertainty(linearisation, full.model.measurements.episode)
        self._after = of_linearisation(linearisation, full.model.parameters)

    def findings(self) -> dict[str, Any]:
        """Returns the fields of `Identified` that judge the result."""
        full, model, u = self._full, self._full.model, self._u
        start, theta = nominal_values(model.parameters), full.scaling.from_unit(u)
        fitted = _comparison(full, start, theta)
        residual = (fitted.after - fitted.measured) / model.measurements.noise
        return {
            "parameters": model.parameters,
            "channels": model.measurements.channels,
            "start": start,
            "theta": theta,
            "u": u,
            "interval_gn": self._interval(self._spread.gauss_newton),
            "interval_bootstrap": self._interval(self._spread.bootstrap),
            "spread": self._spread,
            "after": self._after,
            "methods": self._methods,
            "best": self._best.name,
            "verdict": self._verdict(),
            "fitted": fitted,
            "held_out": (
                _comparison(self._held_out, start, theta) if self._held_out else None
            ),
            "whiteness": np.array([ljung_box(column) for column in residual.T]),
            "floor": noise_floor(self._settings.huber_delta),
            "derived": self._derived(),
        }

    def profiles(self, workers: Workers, news: News) -> tuple[Profile, ...]:
        """Returns the profile likelihoods that were asked for."""
        names = [p.name for p in self._full.model.parameters]
        found = []
        for name in self._settings.profiles:
            if name in names:
                news(f"profile of {name}", 0, 0, np.nan)
                i = names.index(name)
                deviation = np.sqrt(self._spread.bootstrap_covariance[i, i])
                reach = _PROFILE_REACH * float(deviation)
                found.append(profile(self._full, workers, self._u, name, reach))
        return tuple(found)

    def notes(self, frozen: Mapping[str, float]) -> list[str]:
        """Returns what a reader should be warned of."""
        notes = [f"{name} was frozen at {value:g}" for name, value in frozen.items()]
        parameters = self._full.model.parameters
        for parameter, place in zip(parameters, self._u, strict=True):
            if min(place, 1.0 - place) < _EDGE:
                notes.append(
                    f"{parameter.name} ended on a bound: widen it, or the model lacks "
                    "something that this parameter stands in for"
                )
        notes += [f"at the result: {line}" for line in self._after.complaints]
        if self._held_out is None:
            notes.append(
                "no episode was held out: nothing tells whether the fit carries over; "
                "record several episodes"
            )
        for reason in dict.fromkeys(text for _, text in self._full.failures):
            notes.append(f"a simulation failed: {reason}")
        return notes

    def _interval(self, relative: Array) -> Array:
        """Returns intervals (p, 2) about the optimum as intervals of parameters."""
        ends = np.clip(self._u[:, None] + relative, 0.0, 1.0)
        sides = [self._full.scaling.from_unit(side) for side in ends.T]
        return np.column_stack(sides)

    def _verdict(self) -> Verdict | None:
        if len(self._methods) != 2:
            return None
        first, second = self._methods.values()
        return verdict(
            (first.name, second.name),
            (first.u, second.u),
            (first.value, second.value),
            self._full.model.measurements.values.size,
            self._spread,
            self._after.names,
        )

    def _derived(self) -> dict[str, tuple[float, str, tuple[float, float]]]:
        """Returns what people ask for beside theta, with bootstrap intervals."""
        model, scaling = self._full.model, self._full.scaling
        described = model.describe(scaling.from_unit(self._u))
        if not described:
            return {}
        draws = scaling.from_unit(np.clip(self._u + self._spread.draws, 0.0, 1.0))
        drawn = [model.describe(draw) for draw in draws]
        found = {}
        for name, (value, unit) in described.items():
            spread = [d[name][0] for d in drawn if name in d]
            low, high = np.quantile(spread, [0.025, 0.975])
            found[name] = (value, unit, (float(low), float(high)))
        return found


def _linearised(objective: Objective, u: Array) -> Linearisation:
    """Returns the linearisation with steps that fit, after one that tells them."""
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

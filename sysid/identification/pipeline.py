"""From a model of a log to its identified parameters, and how sure they are."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from drake_disasm.errors import DisasmError
from drake_disasm.quantity import closest
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
from sysid.identification.uncertainty import Uncertainty, uncertainty
from sysid.identification.whiteness import ljung_box
from sysid.models.base import LogModel
from sysid.objective import Objective, tempered
from sysid.parameters import Scaling, nominal_values
from sysid.workers import Workers

Array = NDArray[np.float64]

_THIN_ROWS = 64  # that a global search simulates
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
    huber: float = 3.0
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
    model = with_estimated_noise(model, workers, settings.huber)
    fitted = model.of_episodes(train)
    _refuse_small_logs(fitted)
    _refuse_unknown_profiles(fitted, settings.profiles)
    first = _sensitivity(fitted, settings, workers, news)
    frozen = _frozen(first, fitted, settings)
    model, fitted = model.freeze(frozen), fitted.freeze(frozen)
    full = Objective(fitted, workers, settings.huber)
    thin = Objective(thinned(fitted), workers, settings.huber)
    methods = {
        name: Search(name, full, thin, settings.effort, journal, news).run()
        for name in settings.methods
    }
    return _concluded(
        model, train, test, settings, workers, news, full, thin, methods, first, frozen
    )


def thinned(model: LogModel) -> LogModel:
    """Returns a model of about _THIN_ROWS rows, spread evenly; all, if it is cheap."""
    every = model.measurements.rows // _THIN_ROWS
    return model if model.affine or every < 2 else model.thin(every)


def noise_floor(huber: float) -> float:
    """Returns the objective of a perfect model: rms of tempered Gaussian noise."""
    z = np.linspace(-12.0, 12.0, 20001)
    density = norm.pdf(z)
    return float(np.sqrt(np.trapezoid(tempered(z, huber) ** 2 * density, z)))


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


def _sensitivity(
    model: LogModel, settings: Settings, workers: Workers, news: News
) -> Sensitivity:
    news("sensitivities", 0, 0, np.nan)
    objective = Objective(model, workers, settings.huber)
    start = objective.scaling.to_unit(nominal_values(model.parameters))
    return sensitivity(objective, start)


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


def _concluded(
    model: LogModel,
    train: Sequence[int],
    test: Sequence[int],
    settings: Settings,
    workers: Workers,
    news: News,
    full: Objective,
    thin: Objective,
    methods: dict[str, MethodResult],
    first: Sensitivity,
    frozen: Mapping[str, float],
) -> Identified:
    """Judges what the methods found."""
    news("uncertainty", 0, 0, np.nan)
    best = min(methods.values(), key=lambda result: result.value)
    here = _linearised(full, best.u)
    spread = uncertainty(here, full.model.measurements.episode)
    after = of_linearisation(here, full.model.parameters)
    scaling, theta = full.scaling, full.scaling.from_unit(here.u)
    start = nominal_values(full.model.parameters)
    fitted = _comparison(full, start, theta)
    held = _held_out(model, test, settings, workers, start, theta)
    residual = (fitted.after - fitted.measured) / full.model.measurements.noise
    profiles = _profiles(full, workers, here.u, spread, settings, news)
    return Identified(
        parameters=full.model.parameters,
        frozen=dict(frozen),
        channels=full.model.measurements.channels,
        start=start,
        theta=theta,
        u=here.u,
        interval_gn=_to_parameters(scaling, here.u, spread.gauss_newton),
        interval_bootstrap=_to_parameters(scaling, here.u, spread.bootstrap),
        spread=spread,
        before=first,
        after=after,
        methods=methods,
        best=best.name,
        verdict=_verdict(methods, full, spread, after),
        profiles=profiles,
        fitted=fitted,
        held_out=held,
        whiteness=np.array([ljung_box(column) for column in residual.T]),
        floor=noise_floor(settings.huber),
        derived=_derived(full.model, scaling, here.u, spread),
        evaluations=full.evaluations + thin.evaluations,
        failures=len(full.failures) + len(thin.failures),
        notes=_notes(full, here.u, after, test, workers, frozen),
    )


def _linearised(objective: Objective, u: Array) -> Linearisation:
    """Returns the linearisation with steps that fit, after one that tells them."""
    return linearise(objective, u, fitting_steps(linearise(objective, u)))


def _comparison(objective: Objective, start: Array, theta: Array) -> Comparison:
    measured = objective.model.measurements
    residuals = objective.residuals(np.array([start, theta]))
    before, after = (measured.values + r * measured.noise for r in residuals)
    return Comparison(
        measured.values,
        before,
        after,
        measured.episode,
        measured.names,
        objective.value(residuals[0]),
        objective.value(residuals[1]),
    )


def _held_out(
    model: LogModel,
    test: Sequence[int],
    settings: Settings,
    workers: Workers,
    start: Array,
    theta: Array,
) -> Comparison | None:
    if not test:
        return None
    objective = Objective(model.of_episodes(test), workers, settings.huber)
    return _comparison(objective, start, theta)


def _profiles(
    full: Objective,
    workers: Workers,
    u: Array,
    spread: Uncertainty,
    settings: Settings,
    news: News,
) -> tuple[Profile, ...]:
    names = [p.name for p in full.model.parameters]
    found = []
    for name in settings.profiles:
        if name in names:
            news(f"profile of {name}", 0, 0, np.nan)
            i = names.index(name)
            reach = _PROFILE_REACH * float(np.sqrt(spread.bootstrap_covariance[i, i]))
            found.append(profile(full, workers, u, name, reach))
    return tuple(found)


def _to_parameters(scaling: Scaling, u: Array, intervals: Array) -> Array:
    """Returns intervals (p, 2) about u as intervals of the parameters."""
    ends = np.clip(u[:, None] + intervals, 0.0, 1.0)
    return np.column_stack(
        [scaling.from_unit(ends[:, 0]), scaling.from_unit(ends[:, 1])]
    )


def _verdict(
    methods: Mapping[str, MethodResult],
    full: Objective,
    spread: Uncertainty,
    after: Sensitivity,
) -> Verdict | None:
    if len(methods) != 2:
        return None
    first, second = methods.values()
    return verdict(
        (first.name, second.name),
        (first.u, second.u),
        (first.value, second.value),
        full.model.measurements.values.size,
        spread,
        after,
    )


def _derived(
    model: LogModel, scaling: Scaling, u: Array, spread: Uncertainty
) -> dict[str, tuple[float, str, tuple[float, float]]]:
    """Returns what people ask for beside theta, with bootstrap intervals."""
    theta = scaling.from_unit(u)
    draws = scaling.from_unit(np.clip(u + spread.draws, 0.0, 1.0))
    found: dict[str, Any] = {}
    described = [model.describe(draw) for draw in draws]
    for name, (value, unit) in model.describe(theta).items():
        spread_of_it = [d[name][0] for d in described if name in d]
        low, high = np.quantile(spread_of_it, [0.025, 0.975])
        found[name] = (value, unit, (float(low), float(high)))
    return found


def _notes(
    full: Objective,
    u: Array,
    after: Sensitivity,
    test: Sequence[int],
    workers: Workers,
    frozen: Mapping[str, float],
) -> list[str]:
    notes = [f"{name} was frozen at {value:g}" for name, value in frozen.items()]
    for parameter, place in zip(full.model.parameters, u, strict=True):
        if min(place, 1.0 - place) < _EDGE:
            notes.append(
                f"{parameter.name} ended on a bound: widen it, or the model lacks "
                "something that this parameter stands in for"
            )
    notes += [f"at the result: {line}" for line in after.complaints]
    if not test:
        notes.append(
            "no episode was held out: nothing tells whether the fit carries "
            "over; record several episodes"
        )
    for reason in dict.fromkeys(text for _, text in full.failures):
        notes.append(f"a simulation failed: {reason}")
    return notes + list(dict.fromkeys(workers.notes))

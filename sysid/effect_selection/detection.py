"""What a log could have shown: the smallest effects that would have been found."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm
from scipy.stats import t as t_distribution

from sysid.effect_selection.experiments import revealing_kind
from sysid.effect_selection.forward_selection import Term
from sysid.effect_selection.linear_account import LinearAccount
from sysid.fitting.block_grams import Array
from sysid.fitting.candidates import Candidate
from sysid.fitting.fit import Fit
from sysid.models.effects import field_of
from sysid.parameters import Scaling, nominal_values

_Key = tuple[str, str, str]  # effect, field and shape


@dataclass(frozen=True)
class DetectionLimit:
    """The smallest amplitude that would have been found with 80 % probability.

    Attributes:
        effect: its name.
        field: of its amplitude; the others are null.
        amplitude: SI, by the linear account or a fit; None if none within its bounds
            would have been found.
        unit: of the amplitude.
        share: of the way to its farther bound; above 1 if it is beyond.
        shape: values of the effect's shape parameters, as text.
    """

    effect: str
    field: str
    amplitude: float | None
    unit: str
    share: float
    shape: str = ""


def detection_limits(
    account: LinearAccount, doubted: Sequence[Fit] = ()
) -> list[DetectionLimit]:
    """Returns the limit of each amplitude of each effect, shape by shape.

    An effect is found if it takes away `min_gain` of the loss, if its coefficient is
    significant beside the model's own, and if the model's own error can't be all of it.
    And no limit is below what a fit had and was not found.

    Args:
        account: of the model.
        doubted: such fits, with an effect that the model has not.
    """
    errors = account.whole.folds(account.settings.folds).errors_beside(account.columns)
    shown = [
        limit
        for term in account.terms
        if len(term.candidates) == 1
        for limit in _limits(account, term, errors)
    ]
    sizes = dict(size for fit in doubted for size in _sizes(fit))
    shown = [_at_least(each, sizes.get(_key(each), 0.0)) for each in shown]
    return shown + [
        DetectionLimit(each.name, each.fields[0], None, "1", np.inf)
        for each in account.system.unseen
    ]


def undetectable(limits: Sequence[DetectionLimit]) -> dict[str, str]:
    """Returns the kinds of effects that a log could not have shown, and what would."""
    kinds = dict.fromkeys(x.effect.partition(".")[0] for x in limits)
    hidden = [kind for kind in kinds if not is_detectable(limits, kind)]
    return {kind: revealing_kind(kind) for kind in hidden}


def is_detectable(limits: Sequence[DetectionLimit], kind: str) -> bool:
    """Returns whether a kind of effect would have been found in most of its shapes.

    A patch that shows at one place only is not detectable wherever it may be.
    """
    of_kind = [x for x in limits if x.effect.partition(".")[0] == kind]
    shapes: dict[tuple[str, str], bool] = {}
    for limit in of_kind:
        key = (limit.effect, limit.shape)
        shapes[key] = shapes.get(key, False) or limit.amplitude is not None
    return 2 * sum(shapes.values()) > len(shapes)


def _limits(account: LinearAccount, term: Term, errors: Array) -> list[DetectionLimit]:
    """Returns the limit of each amplitude of a term with one effect.

    Args:
        account: of the model.
        term: that it has not.
        errors: standard error of each column of the account.
    """
    (candidate,) = term.candidates
    equations = account.equations
    parameters = [account.system.parameters[column] for column in term.columns]
    scaling, nominal = Scaling(tuple(parameters)), nominal_values(tuple(parameters))
    at, slope = scaling.to_unit(nominal), scaling.slope(nominal)
    shape = _shape_text(candidate)
    found = []
    for i, column in enumerate(term.columns):
        if not equations.is_new(np.array([column]))[0]:
            continue  # the model's own parameters, or its effects, can do the same
        least = _least(account, column, float(errors[column]))
        share = float(least / max(at[i], 1.0 - at[i]))
        amplitude = float(least * slope[i]) if share <= 1.0 else None
        field = field_of(account.system.parameters[column])
        unit = parameters[i].unit
        found.append(
            DetectionLimit(candidate.name, field, amplitude, unit, share, shape)
        )
    return found


def _least(account: LinearAccount, column: int, error: float) -> float:
    """Returns the least coefficient of a column, in the unit box, that is found."""
    equations, settings = account.equations, account.settings
    power, loss = float(equations.total[column, column]), float(equations.losses.sum())
    if power <= 0.0:
        return math.inf
    above = float(norm.ppf(settings.detection_power))
    t_value = float(t_distribution.isf(0.5 * settings.alpha, settings.folds - 1))
    of_use = math.sqrt(settings.min_gain / (1.0 - settings.min_gain) * loss / power)
    least = max((above + t_value) * error, of_use + above * error)
    names = {name for term in account.system.terms for name in term.names}
    alpha = settings.alpha / len(names)
    return max(least, account.system.least_beyond_noise(column, alpha, above))


def _key(limit: DetectionLimit) -> _Key:
    return limit.effect, limit.field, limit.shape


def _sizes(fit: Fit) -> list[tuple[_Key, float]]:
    """Returns the size of each amplitude of a fit's last effect."""
    candidate = fit.effects[-1]
    shape = _shape_text(candidate)
    return [
        ((candidate.name, field, shape), abs(fit.values[f"{candidate.name}.{field}"]))
        for field in candidate.fields
    ]


def _at_least(limit: DetectionLimit, size: float) -> DetectionLimit:
    """Returns a limit that is not below a size."""
    if limit.amplitude is None or size <= limit.amplitude:
        return limit
    share = limit.share * size / limit.amplitude
    amplitude = size if share <= 1.0 else None
    return replace(limit, amplitude=amplitude, share=share)


def _shape_text(candidate: Candidate) -> str:
    return ", ".join(f"{name}={value:g}" for name, value in candidate.shape.items())

"""What a log could have shown: the smallest effects that would have been found."""

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import chi2, ncx2, norm

from sysid.effect_selection.block_regression import Columns
from sysid.effect_selection.settings import SelectionSettings
from sysid.effect_selection.significance import highest_by_chance, squared_length
from sysid.effect_selection.survey import LinearSurvey
from sysid.parameters import Scaling, nominal_values

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DetectionLimit:
    """The smallest amplitude that would have been found with 80 % probability.

    Attributes:
        effect: its name.
        field: of its amplitude; the others are null.
        amplitude: SI, by the linear account; None if none within its bounds would
            have been found.
        unit: of the amplitude.
        share: of the way to its farther bound; above 1 if it is beyond.
        shape: values of the effect's shape parameters, as text: other shapes would have
            to be larger.
    """

    effect: str
    field: str
    amplitude: float | None
    unit: str
    share: float
    shape: str = ""


def detection_limits(survey: LinearSurvey) -> list[DetectionLimit]:
    """Returns the limit of each effect's amplitudes, in its best shape.

    An effect is found if the total of its scores, which is about noncentral chi-squared
    with as many degrees of freedom as it has amplitudes, is beyond what is the highest
    of all candidates by chance, and if it gains enough to be of use.
    """
    settings, regression = survey.whitened.settings, survey.whitened
    groups = {text: g for text, g in survey.groups.items() if len(g)}
    if not groups:
        return []
    # Whichever side of null noise has pushed them to: there they are all without score.
    free = regression.either_way()
    scores = [free.scores(group) for group in groups.values()]
    highest = highest_by_chance(scores, settings)
    critical = float(np.quantile(highest, 1.0 - settings.alpha))
    best: dict[tuple[str, str], DetectionLimit] = {}
    for text, group in groups.items():
        for limit in _limits(survey, text, group, critical):
            known = best.get((limit.effect, limit.field))
            if known is None or limit.share < known.share:
                best[limit.effect, limit.field] = limit
    return list(best.values())


def _limits(
    survey: LinearSurvey, text: str, group: Columns, critical: float
) -> list[DetectionLimit]:
    """Returns the limit of each amplitude of an effect, by its text: `name[shape]`."""
    effect, _, shape = text.removesuffix("]").partition("[")
    scaling, nominal = Scaling(survey.parameters), nominal_values(survey.parameters)
    at, slope = scaling.to_unit(nominal)[group], scaling.slope(nominal)[group]
    found = _in_unit_box(survey, group, critical)
    shares = found / np.maximum(at, 1.0 - at)
    return [
        DetectionLimit(
            effect,
            survey.fields[column],
            float(amplitude) if share <= 1.0 else None,
            survey.parameters[column].unit,
            float(share),
            shape,
        )
        for column, amplitude, share in zip(group, found * slope, shares, strict=True)
    ]


def _in_unit_box(survey: LinearSurvey, group: Columns, critical: float) -> Array:
    """Returns what of parameters' ranges (k,) is found; infinite if none is."""
    raw, settings = survey.regression, survey.settings
    with np.errstate(divide="ignore"):
        power = np.sum(raw.A[:, group] ** 2, axis=0)
        of_use = np.sqrt(settings.min_gain * raw.block_losses.sum() / power)
    return np.maximum(_certain(survey, group, critical), of_use / raw.scale[group])


def _certain(survey: LinearSurvey, group: Columns, critical: float) -> Array:
    """Returns what of parameters' ranges (k,) is more than chance; see Evidence."""
    if survey.model_error_share is not None:
        return _beyond_noise(survey, group)
    by_blocks = _by_blocks(survey, group, critical)
    if not survey.noise_decides:
        return by_blocks
    return np.minimum(by_blocks, _beyond_noise(survey, group))


def _by_blocks(survey: LinearSurvey, group: Columns, critical: float) -> Array:
    """Returns what of parameters' ranges (k,) the blocks' signs tell from chance."""
    whitened, settings = survey.whitened, survey.settings
    if whitened.least_p(group) >= settings.alpha:
        return np.full(len(group), np.inf)
    length = _needed(critical, len(group), settings)
    with np.errstate(divide="ignore"):
        return np.asarray(length / whitened.sensitivity(group) / whitened.scale[group])


def _beyond_noise(survey: LinearSurvey, group: Columns) -> Array:
    """Returns what of parameters' ranges (k,) exceeds noise and error as stated."""
    settings, linear = survey.settings, survey.linearisation
    J = np.sqrt(linear.weights)[..., None] * linear.jacobian[..., group]
    size = np.sqrt(np.einsum("nck,nck->k", J, J))
    alpha = settings.alpha / len(survey.groups)
    needed = np.sqrt(chi2.isf(alpha, len(group))) + norm.ppf(settings.detection_power)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = 0.0
        if survey.model_error_share is not None:
            of_error = np.einsum("nck,nc->k", np.abs(J), survey.model_error_share)
            off = settings.model_error_reach * of_error / size
        return np.where(size > 0.0, (needed + off) / size, np.inf)


@functools.lru_cache(maxsize=256)
def _needed(critical: float, m: int, settings: SelectionSettings) -> float:
    """Returns how long an effect has to make a total of m scores to be found.

    By chance the squared length has the share 1 / `noise_safety`^2 of m.
    """
    scale = settings.noise_safety**2
    limit = scale * squared_length(critical, m)

    def _missed(length: float) -> float:
        found = ncx2.sf(limit, m, scale * length**2)
        return float(found) - settings.detection_power

    return float(brentq(_missed, 1e-3, 1e3))

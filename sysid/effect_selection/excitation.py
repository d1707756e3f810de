"""What a motion can show at all: parameters and effects, before any is looked for."""

import dataclasses
from typing import Any

import numpy as np

from drake_disasm.effects import registered_effects
from sysid.effect_selection.data_sufficiency import refuse_few_rows
from sysid.effect_selection.detection import (
    DetectionLimit,
    detection_limits,
    undetectable,
)
from sysid.effect_selection.linear_account import LinearAccount
from sysid.effect_selection.linear_system import linear_system
from sysid.fitting.candidates import candidates
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import DEFAULT_SETTINGS, SelectionSettings
from sysid.models.base import LogModel
from sysid.parameters import Scaling
from sysid.workers import Workers


@dataclasses.dataclass(frozen=True)
class ParameterExcitation:
    """How well the data determine one of a model's own parameters.

    Attributes:
        name, unit: of it.
        value: fitted, without any effect.
        spread: half its 95 % interval, by the jackknife.
    """

    name: str
    unit: str
    value: float
    spread: float

    @property
    def is_determined(self) -> bool:
        """Whether its sign is: its interval does not hold zero."""
        return abs(self.value) > self.spread


@dataclasses.dataclass(frozen=True)
class Excitation:
    """What data can show.

    Attributes:
        parameters: of the model itself.
        limits: the least amplitude of each effect that would have been found.
    """

    parameters: tuple[ParameterExcitation, ...]
    limits: tuple[DetectionLimit, ...]

    @property
    def hidden(self) -> dict[str, str]:
        """Kinds of effects that would not have been found however large.

        By the kind's name, with the recording that shows it.
        """
        return undetectable(self.limits)

    def to_mapping(self) -> dict[str, Any]:
        """Returns it as plain data."""
        return {
            "parameters": [dataclasses.asdict(p) for p in self.parameters],
            "would_have_been_found": [dataclasses.asdict(x) for x in self.limits],
            "would_not_have_been_found": self.hidden,
        }


def excitation_of(
    model: LogModel,
    workers: Workers | None = None,
    settings: SelectionSettings = DEFAULT_SETTINGS,
) -> Excitation:
    """Returns what a model's log can show.

    Costs a fit without effects, and one evaluation for each amplitude.

    Args:
        model: of the whole log.
        workers: evaluate; this process if left out.
        settings: thresholds of the effect selection.

    Raises:
        DisasmError: there are fewer rows than the model's own parameters need.
    """
    delta = model.default_huber_delta
    fitter = Fitter.of(model, workers or Workers(), delta, settings)
    if not model.affine:
        fitter = fitter.affordable
    refuse_few_rows(fitter.base)
    fit = fitter.fit(())
    library = candidates(fitter.base, registered_effects())
    account = LinearAccount.of_fit(linear_system(fitter, fit, library), fit)
    limits = detection_limits(account)
    return Excitation(_parameters(fit), tuple(limits))


def _parameters(fit: Fit) -> tuple[ParameterExcitation, ...]:
    parameters = fit.model.parameters
    if not parameters:
        return ()
    scaling = Scaling(parameters)
    u = scaling.to_unit(fit.theta)
    half = fit.half_intervals
    ends = scaling.from_unit(np.clip(np.stack([u - half, u + half]), 0.0, 1.0))
    spreads = 0.5 * np.ptp(ends, axis=0)
    return tuple(
        ParameterExcitation(p.name, p.unit, float(value), float(spread))
        for p, value, spread in zip(parameters, fit.theta, spreads, strict=True)
    )

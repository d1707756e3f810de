"""Leaves out of a fit what it can do without: effects' amplitudes that gain nothing."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.effect_selection.candidates import Candidate
from sysid.effect_selection.fit import Fit
from sysid.effect_selection.fitter import Fitter
from sysid.effect_selection.measured_evidence import amplitude_p


def at_own_minimum(fitter: Fitter, fit: Fit) -> Fit:
    """Returns the fit at the model's own minimum, with as few amplitudes as will do.

    A surrogate's derivatives stop short of it: effects that are not there would explain
    what they leave.
    """
    far = fit.objective > fitter.settings.noise_level
    if fitter.base.costly and not fitter.exact and far:
        fitter = fitter.with_exact_derivatives()
        fit = fitter.fit(fit.effects, fit)
    return simplified(fitter, fit)


def simplified(fitter: Fitter, fit: Fit) -> Fit:
    """Returns the fit without amplitudes that gain next to nothing, or noise explains.

    Even if they are significant: they have taken up what the model does a little
    differently from the device.
    """
    fit = without_noise(fitter, fit)
    simple = _only(fitter, fit, [_of_use(fit, effect) for effect in fit.effects])
    return simple if simple.loss <= (1.0 + fit.settings.min_gain) * fit.loss else fit


def without_noise(fitter: Fitter, fit: Fit) -> Fit:
    """Returns the fit without amplitudes that stated noise or error can explain."""
    if not fit.noise_is_stated:
        return fit
    return _only(fitter, fit, [_beyond_noise(fit, e) for e in fit.effects])


def _only(fitter: Fitter, fit: Fit, effects: Sequence[Candidate]) -> Fit:
    """Returns the fit with effects that have fewer amplitudes."""
    return fit if tuple(effects) == fit.effects else fitter.fit(tuple(effects), fit)


def _of_use(fit: Fit, effect: Candidate) -> Candidate:
    """Returns an effect with its best amplitude and others that gain enough."""
    gains = _gains(fit, effect)
    return _with(effect, gains >= min(fit.settings.min_amplitude_gain, max(gains)))


def _beyond_noise(fit: Fit, effect: Candidate) -> Candidate:
    """Returns an effect with its best amplitude and others that noise can't explain."""
    p = np.array([amplitude_p(fit, int(c)) for c in fit.columns_of(effect)])
    gains = _gains(fit, effect)
    return _with(effect, (p < fit.settings.alpha) | (gains == max(gains)))


def _gains(fit: Fit, effect: Candidate) -> NDArray[np.float64]:
    """Returns what each amplitude of an effect gains (k,)."""
    return np.array(fit.gains_of([np.array([c]) for c in fit.columns_of(effect)]))


def _with(effect: Candidate, kept: NDArray[np.bool_]) -> Candidate:
    """Returns an effect with some of its amplitudes (k,)."""
    pairs = zip(effect.fields, kept, strict=True)
    return effect.only([field for field, keep in pairs if keep])


def with_significant_only(fitter: Fitter, fit: Fit, known: int) -> Fit:
    """Returns the fit whose effects after the known ones are all significant.

    Or as few amplitudes as will do, where that costs more: the derivative of one that
    makes contact hides what the others are worth.
    """
    effects = fit.significant_only(known)
    if len(effects) == known or effects == fit.effects:
        return fit
    found = fitter.fit(effects, fit)
    most = (1.0 + fit.settings.min_gain) * fit.loss
    return found if found.loss <= most else _few_enough(fitter, fit, known, most)


def _few_enough(fitter: Fitter, fit: Fit, known: int, most: float) -> Fit:
    """Returns the fit without amplitudes that it can do without, tried one by one.

    Args:
        fitter: of all rows.
        fit: with all of them.
        known: number of the effects that keep all amplitudes.
        most: loss that is as good.
    """
    names = [(effect.name, f) for effect in fit.effects[known:] for f in effect.fields]
    for name, field in names:
        effects = [_without(e, field) if e.name == name else e for e in fit.effects]
        if any(not effect.fields for effect in effects):
            continue
        found = fitter.fit(tuple(effects), fit)
        if found.loss <= most:
            fit = found
    return fit


def _without(effect: Candidate, field: str) -> Candidate:
    """Returns an effect without an amplitude."""
    return effect.only([each for each in effect.fields if each != field])

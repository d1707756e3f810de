"""What a log could not have shown: hypotheses about it, where nothing is named."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from drake_disasm.effects import Effect
from drake_disasm.scenario import Scenario
from sysid.diagnosis.growing_log import GrowingLog
from sysid.diagnosis.rivals import NOTHING, TwinRival, fitter_of
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.effect_selection.detection import DetectionLimit
from sysid.effect_selection.effect_names import effect_class
from sysid.effect_selection.exceeds_noise import exceeds_noise_p
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter
from sysid.workers import Workers

_OF_BOUND = 0.5  # of an amplitude that no size within its bounds would have shown
_TIMES = 2.0  # the size that would have been found
_MOST = 9  # hypotheses at a time
_DOUBTED = 3  # of them of what the log hints at


def unseen_rivals(
    closed: ClosedLoop,
    log: GrowingLog,
    workers: Workers,
    folder: Path | None,
) -> tuple[TwinRival, ...]:
    """Returns the verdict, and what its log does not speak against, each as a rival.

    An effect is one of a size that matters, in the field in which more of the log would
    show it soonest, unless the log speaks against that by more than noise and the
    model's own error. Where something is named, that is all that was asked; where the
    log shows something that no effect of the library explains, nothing is.

    Args:
        closed: the verdict.
        log: so far.
        workers: fit.
        folder: of a cache of fits.
    """
    scenario = closed.scenario
    if scenario is None or closed.verdict.ending == "unexplained":
        return ()
    named = closed.verdict.confirmed
    if named:
        return (TwinRival(" and ".join(named), 1.0, 0.0, scenario),)
    fitter = fitter_of(closed, log.model(scenario), workers, folder)
    base = fitter.fit(())
    found = [TwinRival(NOTHING, 1.0, base.loss, scenario)]
    for name, scenarios in _hypotheses(closed, scenario).items():
        rival = _likeliest(name, scenarios, log, fitter, base)
        if rival is not None:
            found.append(rival)
        if len(found) > _MOST:
            break
    return tuple(dataclasses.replace(each, weight=1.0 / len(found)) for each in found)


def _hypotheses(closed: ClosedLoop, scenario: Scenario) -> dict[str, list[Scenario]]:
    """Returns effects that the log may have hidden, by name, each in some sizes.

    First what it hints at, as it was fitted: noise or the model's own error could be
    all of that.
    """
    doubted = sorted(closed.search.doubted, key=lambda fit: fit.loss)[:_DOUBTED]
    found = {}
    for fit in doubted:
        fitted = fit.model.scenario_at(fit.theta)
        if fitted is not None:
            found[fit.effects[-1].name] = [fitted]
    for kind, limit in _unseen(closed.verdict.limits):
        of_size = [_with(scenario, effect) for effect in _of_size(kind, limit)]
        found.setdefault(limit.effect, of_size)
    return found


def _with(scenario: Scenario, effect: Effect) -> Scenario:
    return dataclasses.replace(scenario, effects=[*scenario.effects, effect])


def _likeliest(
    name: str,
    scenarios: Sequence[Scenario],
    log: GrowingLog,
    fitter: Fitter,
    base: Fit,
) -> TwinRival | None:
    """Returns the hypothesis of one of some scenarios; None if the log refutes all.

    Args:
        name: of the hypothesis.
        scenarios: with an effect each.
        log: that may speak against them.
        fitter: of the log.
        base: fit without an effect.
    """
    found = []
    for scenario in scenarios:
        fit = fitter.with_base(log.model(scenario)).fit(())
        if exceeds_noise_p(fit, base, 1) >= fitter.settings.alpha:
            found.append(TwinRival(name, 1.0, fit.loss, scenario))
    return min(found, key=lambda rival: rival.loss, default=None)


def _unseen(
    limits: Sequence[DetectionLimit],
) -> list[tuple[type[Effect], DetectionLimit]]:
    """Returns effects that a log would not show at half of a field's bound.

    Each in the field, and the shape, in which it would soonest; and the soonest first.
    """
    found: dict[str, tuple[type[Effect], DetectionLimit]] = {}
    for limit in sorted(limits, key=lambda each: each.share):
        made = effect_class(limit.effect)
        if made is None or limit.share < _OF_BOUND or limit.effect in found:
            continue
        if limit.field in {field.name for field in dataclasses.fields(made)}:
            found[limit.effect] = made, limit
    return list(found.values())


def _of_size(kind: type[Effect], limit: DetectionLimit) -> list[Effect]:
    """Returns an effect that a log could not have shown, of a size that matters.

    In the field and shape of its limit: half of its bound, or twice of what would have
    been found; of both signs, if it may have either.
    """
    field = next(f for f in dataclasses.fields(kind) if f.name == limit.field)
    size = _OF_BOUND * field.metadata["high"]
    if limit.amplitude is not None:
        size = min(_TIMES * abs(limit.amplitude), size)
    signs = (1.0, -1.0) if field.metadata["low"] < 0.0 else (1.0,)
    pairs = (part.split("=") for part in limit.shape.split(", ") if part)
    shape = {name: float(value) for name, value in pairs}
    return [kind(**{limit.field: sign * size}, **shape) for sign in signs]

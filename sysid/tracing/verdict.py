"""What is to be said: nothing, an effect, or that no effect explains it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.identification.uncertainty import uncertainty
from sysid.objective import Objective
from sysid.tracing.held_out import HeldOut, improvement
from sysid.tracing.selection import Fit, Round, Survey, Tracer

Array = NDArray[np.float64]

#: Share of what can be explained that effects must explain to be believed.
_BELIEVED = 0.75


@dataclass(frozen=True)
class Value:
    """A parameter of an effect that was found.

    Attributes:
        name: with the effect's.
        value, unit: SI.
        interval: 95 %, by a block bootstrap.
        null: at which the effect would vanish; None for a shape.
    """

    name: str
    value: float
    unit: str
    interval: tuple[float, float]
    null: float | None

    @property
    def matters(self) -> bool:
        """Whether the interval excludes the null value."""
        if self.null is None:
            return True
        return not self.interval[0] <= self.null <= self.interval[1]

    @property
    def text(self) -> str:
        """Value and interval in words."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        low, high = self.interval
        return f"{self.name} = {self.value:.4g}{unit} ({low:.4g} to {high:.4g})"


@dataclass(frozen=True)
class Verdict:
    """What the log says of the model.

    Attributes:
        ending: "none", "explained" or "unexplained".
        names: of the effects that are missing, the most important first.
        ties: for each, effects that explain as much.
        values: of their parameters.
        dependence: the strongest that is left, in words; empty if none is.
        explained: share of what could be explained that the effects do.
        text: three lines.
    """

    ending: str
    names: tuple[str, ...]
    ties: tuple[tuple[str, ...], ...]
    values: tuple[Value, ...]
    dependence: str
    explained: float
    text: str


def verdict(
    tracer: Tracer, first: Fit, last: Fit, end: Survey, errors: HeldOut
) -> Verdict:
    """Returns the verdict of a search.

    Args:
        tracer: that searched.
        first, last: the fits without and with the effects.
        end: the survey at which it ended.
        errors: on rows that were not fitted.
    """
    left = [d for d in end.dependences if d.accepted]
    gained = max(first.loss - last.loss, 0.0)
    missing = left[0].gain * last.loss if left else 0.0
    explained = gained / (gained + missing) if gained + missing > 0.0 else 1.0
    rounds = [r for r in tracer.rounds if _is_kept(r, last)]
    names = tuple(c.name for c in last.effects)
    values = values_of(tracer, last)
    if not names and not left:
        ending = "none"
    elif names and explained >= _BELIEVED:
        ending = "explained"
    else:
        ending = "unexplained"
    ties = tuple(_tied(r) for r in rounds)
    dependence = left[0].name if left else ""
    lines = [
        _missing_line(ending, names, ties, dependence),
        _value_line(values),
        f"error on held-out data: {improvement(errors)}",
    ]
    return Verdict(ending, names, ties, values, dependence, explained, "\n".join(lines))


def values_of(tracer: Tracer, fit: Fit) -> tuple[Value, ...]:
    """Returns the effects' parameters with their intervals."""
    count = len(tracer.base.parameters)
    spread = uncertainty(fit.here, fit.model.measurements.episode)
    scaling = Objective(fit.model, tracer.workers, tracer.huber).scaling
    ends = np.clip(fit.here.u[:, None] + spread.bootstrap, 0.0, 1.0)
    low, high = (scaling.from_unit(side) for side in ends.T)
    return tuple(
        Value(
            p.name,
            float(fit.theta[i]),
            p.unit,
            (float(low[i]), float(high[i])),
            None if p.is_shape else 0.0,
        )
        for i, p in enumerate(fit.model.parameters)
        if i >= count
    )


def _is_kept(found: Round, last: Fit) -> bool:
    assert isinstance(found.chosen.what, tuple)
    names = [c.name for c in last.effects]
    return any(c.name in names for c in found.chosen.what)


def _tied(found: Round) -> tuple[str, ...]:
    """Returns the other effects that explain as much, each once."""
    own = (
        {c.name for c in found.chosen.what}
        if isinstance(found.chosen.what, tuple)
        else set()
    )
    names = [
        " and ".join(c.name for c in tie.what)
        for tie in found.ties
        if isinstance(tie.what, tuple)
    ]
    return tuple(name for name in dict.fromkeys(names) if name not in own)


def _missing_line(
    ending: str, names: tuple[str, ...], ties: tuple[tuple[str, ...], ...], left: str
) -> str:
    if ending == "none":
        return "missing: none; the residual shows nothing beyond chance"
    effects = ", then ".join(
        name + (f" (or {' or '.join(tie)}: these data can't tell)" if tie else "")
        for name, tie in zip(names, ties, strict=False)
    )
    if ending == "unexplained":
        near = f"; the nearest is {effects}" if effects else ""
        return f"missing: unexplained, no effect in the library does it: {left}{near}"
    more = f"; what is left: {left}" if left else ""
    return f"missing: {effects}{more}"


def _value_line(values: tuple[Value, ...]) -> str:
    shown = [value.text for value in values if value.matters]
    return "parameters: " + ("; ".join(shown) if shown else "none")

"""What is to be said: nothing, an effect, or that no effect explains it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_disasm.effects import Imprecision
from sysid.effect_selection.command_scatter import BEYOND_NOISE, Scatter
from sysid.effect_selection.contradictions import (
    Contradiction,
    contradictions,
    in_words,
)
from sysid.effect_selection.evidence import FEW, Evidence
from sysid.effect_selection.experiments import separating
from sysid.effect_selection.fit import Fit
from sysid.effect_selection.held_out import HeldOut, improvement
from sysid.effect_selection.search import Round, Survey, Tracer
from sysid.identification.uncertainty import uncertainty
from sysid.objective import Objective

Array = NDArray[np.float64]

#: Share of what can be explained that effects must explain to be believed.
_BELIEVED = 0.75
_SCATTERS = Imprecision.__name__
_SHOWN = 3  # of anything, in three lines


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
class Tie:
    """Something that explains as much as an effect that was found.

    Attributes:
        name: of the other effect, or effects.
        experiment: that would tell the two apart.
    """

    name: str
    experiment: str


@dataclass(frozen=True)
class Verdict:
    """What the log says of the model.

    Attributes:
        ending: "none", "explained" or "unexplained".
        names: of the effects that are missing, the most important first.
        worth: for each, the share by which the loss would rise without it, of that.
        ties: for each, effects that explain as much, each with the experiment that
            would separate the two.
        values: of their parameters.
        dependence: the strongest that is left, in words; empty if none is.
        explained: share of what could be explained that the effects do.
        contradictions: episodes that no common effect explains.
        text: three lines.
    """

    ending: str
    names: tuple[str, ...]
    worth: tuple[float, ...]
    ties: tuple[tuple[Tie, ...], ...]
    values: tuple[Value, ...]
    dependence: str
    explained: float
    contradictions: tuple[Contradiction, ...]
    text: str


def verdict(
    tracer: Tracer,
    first: Fit,
    last: Fit,
    end: Survey,
    errors: HeldOut,
    loose: Scatter | None = None,
) -> Verdict:
    """Returns the verdict of a search.

    Args:
        tracer: that searched.
        first, last: the fits without and with the effects.
        end: the survey at which it ended.
        errors: on rows that were not fitted.
        loose: how the arm scatters about its commands, if it does.
    """
    left = [d for d in end.dependences if d.accepted]
    dependence = left[0].name if left else ""
    explained = _explained(first, last, left[0].gain if left else 0.0)
    worth = last.worth
    values = values_of(tracer, last)
    if loose:
        worth[_SCATTERS] = loose.gain
        values = (*values, *_scatter_values(loose))
    names = tuple(sorted(worth, key=lambda name: -worth[name]))
    ties = tuple(_tied(name, tracer.rounds) for name in names)
    assert end.bench is not None
    against = contradictions(last, end.bench, len(tracer.base.parameters))
    beyond = _beyond_noise(last, loose)
    other = in_words(against) or beyond
    believed = bool(names) and explained >= _BELIEVED and not beyond
    ending = _ending(bool(names or dependence or other), believed)
    lines = [
        _missing(ending, names, ties, dependence, other),
        _value_line(names, values),
        f"error on held-out data: {improvement(errors)}",
    ]
    return Verdict(
        ending,
        names,
        tuple(worth[name] for name in names),
        ties,
        values,
        dependence,
        explained,
        against,
        "\n".join(lines),
    )


def _scatter_values(loose: Scatter) -> tuple[Value, ...]:
    """Returns how an arm scatters, axis by axis."""
    return tuple(
        Value(f"{_SCATTERS}.{axis}", float(std), "m", (float(low), float(high)), 0.0)
        for axis, std, (low, high) in zip("xyz", loose.std, loose.interval, strict=True)
    )


def _beyond_noise(last: Fit, loose: Scatter | None) -> str:
    """Returns that a residual is too large, in words; empty if it is not.

    Only where channels state their noise: estimated from a fit it says nothing.
    """
    value = loose.value if loose else last.value
    if last.model.affine or value <= BEYOND_NOISE:
        return ""
    return f"the residual is {value:.2g} times the noise"


def _explained(first: Fit, last: Fit, left: float) -> float:
    """Returns the share that effects explain of what could be.

    Args:
        first, last: the fits without and with them.
        left: share of the last's loss that a dependence would take away.
    """
    gained = max(first.loss - last.loss, 0.0)
    missing = left * last.loss
    return gained / (gained + missing) if gained + missing > 0.0 else 1.0


def _ending(is_something: bool, is_believed: bool) -> str:
    if not is_something:
        return "none"
    return "explained" if is_believed else "unexplained"


def values_of(tracer: Tracer, fit: Fit) -> tuple[Value, ...]:
    """Returns the effects' parameters with their intervals."""
    count = len(tracer.base.parameters)
    spread = uncertainty(fit.linearisation, fit.model.measurements.episode)
    scaling = Objective(fit.model, tracer.workers, tracer.huber_delta).scaling
    ends = np.clip(fit.linearisation.u[:, None] + spread.bootstrap, 0.0, 1.0)
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


def _tied(name: str, rounds: Sequence[Round]) -> tuple[Tie, ...]:
    """Returns what explained as much when an effect was added, each once."""
    joint = name.partition(".")[2]
    for found in rounds:
        if name in found.chosen.effects:
            others = [_other(tie, joint) for tie in found.ties]
            return tuple(
                Tie(other, separating(name, other))
                for other in dict.fromkeys(others)
                if name not in other.split(" and ")
            )
    return ()


def _other(tie: Evidence, joint: str) -> str:
    """Returns what a tie names: at a joint, where it acts alike at several."""
    linearisation = [
        name for name in tie.effects if joint and name.endswith(f".{joint}")
    ]
    return " and ".join(
        linearisation if len(tie.effects) > FEW and linearisation else tie.effects
    )


def _missing(
    ending: str,
    names: tuple[str, ...],
    ties: tuple[tuple[Tie, ...], ...],
    dependence: str,
    against: str,
) -> str:
    left = "; ".join(part for part in (dependence, against) if part)
    if ending == "none":
        return "missing: none; the residual shows nothing beyond chance"
    effects = ", then ".join(
        name + (f" (or {_alternatives(name, tie)})" if tie else "")
        for name, tie in zip(names, ties, strict=True)
    )
    tests = list(dict.fromkeys(tie.experiment for each in ties for tie in each))
    if tests:
        effects += f"; these data can't tell, this would: {' / '.join(tests[:_SHOWN])}"
    if ending == "unexplained":
        near = f"; the nearest is {effects}" if effects else ""
        return f"missing: unexplained, no effect in the library does it: {left}{near}"
    more = f"; what is left: {left}" if left else ""
    return f"missing: {effects}{more}"


def _alternatives(name: str, ties: tuple[Tie, ...]) -> str:
    """Returns the other effects of a tie, without the joint if it is the same."""
    joint = name.partition(".")[2]
    names = [tie.name.removesuffix(f".{joint}") for tie in ties]
    return _or_else(names)


def _or_else(words: Sequence[str]) -> str:
    """Returns some alternatives, and how many more there are."""
    more = [f"{len(words) - _SHOWN} more"] if len(words) > _SHOWN else []
    return " or ".join([*words[:_SHOWN], *more])


def _value_line(names: Sequence[str], values: tuple[Value, ...]) -> str:
    """Returns the parameters in the order of their effects."""
    own = [v for name in names for v in values if v.name.startswith(f"{name}.")]
    brief = len(names) > _SHOWN  # then shapes are in the report only
    shown = [v.text for v in own if v.matters and not (brief and v.null is None)]
    return "parameters: " + ("; ".join(shown) if shown else "none")

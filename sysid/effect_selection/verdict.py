"""Judges what a search found: nothing missing, effects, or something unexplained."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from drake_disasm.effects import Imprecision
from sysid.effect_selection.contradictions import Contradiction, contradictions
from sysid.effect_selection.detection import (
    DetectionLimit,
    detection_limits,
    undetectable,
)
from sysid.effect_selection.effect_names import effect_class
from sysid.effect_selection.experiments import separating
from sysid.effect_selection.replication import Standing
from sysid.effect_selection.search import SearchResult
from sysid.effect_selection.strokes import joints_of_one_stroke
from sysid.fitting.fit import Fit
from sysid.models.base import LogModel
from sysid.models.bookkeeping import Bookkeeping
from sysid.parameters import Scaling
from sysid.residuals.channel_checks import ChannelFinding, channel_findings
from sysid.residuals.command_scatter import CommandScatter
from sysid.residuals.held_out import HeldOut
from sysid.residuals.predictable_residual import (
    PredictableResidual,
    predictable_residual,
)
from sysid.residuals.residual_model import ResidualModel
from sysid.residuals.whiteness import correlated_channels

_SCATTER = Imprecision.__name__

#: Nothing is missing; confirmed effects explain the residual; they do but for something
#: that is left; no effect is confirmed, and the residual is not noise; the log could
#: not have shown most effects.
Ending = Literal["none", "explained", "partly", "unexplained", "too short"]


@dataclass(frozen=True)
class ParameterValue:
    """A parameter of an effect.

    Attributes:
        name: with the effect's.
        value, unit: SI.
        interval: 95 %.
        null: at which the effect vanishes; None for a shape parameter.
        is_at_bound: whether the fit ended at a bound: the value is none of its own.
    """

    name: str
    value: float
    unit: str
    interval: tuple[float, float]
    null: float | None
    is_at_bound: bool = False

    @property
    def excludes_null(self) -> bool:
        """Whether the interval excludes the null value."""
        if self.null is None:
            return True
        return not self.interval[0] <= self.null <= self.interval[1]


@dataclass(frozen=True)
class Tie:
    """Something that explains as much as an effect that was selected.

    Attributes:
        name: of the other effect, or effects.
        experiment: what to record to separate the two.
    """

    name: str
    experiment: str


@dataclass(frozen=True)
class Written:
    """How a log seems to have been written, in place of what it says.

    Attributes:
        name: short: `GravityDirection`, `TorqueSign.joint_3`.
        what: a clause.
        remedy: what to do with the log, or with the map of import-log.
    """

    name: str
    what: str
    remedy: str


@dataclass(frozen=True)
class Verdict:
    """What a log shows of its model.

    Attributes:
        ending: see Ending.
        standings: of the effects that lower the held-out error: confirmed ones first,
            then those that are ambiguous, then those that are suggested.
        ties: for each, effects that are ambiguous with it.
        values: of their parameters.
        contradictions: episodes that no common effect explains.
        excess: objective that is left, in units of the noise, if it is more than noise;
            else 0.
        correlated: channels whose residual is no white noise.
        relative_error: of held-out rows, with the effects, as a share of the readings;
            NaN if that means nothing.
        findings: what is left in single channels.
        limits: how large effects that are not named would have to be to be found.
        predictable_residual: what a flexible learner explains of what effects leave.
        residual_model: learned in their place; not physical. None if it gains little.
        single_strokes: joints of ambiguous effects that make a single stroke.
        misfits: rows that contradict the kind of log, in words.
        written: how the log seems to have been written, in place of what it says; all
            else is of the log put right.
        invalid: why the model does not hold for the log, in words; empty if it does.
        is_provisional: whether the time was over before the search was.
        is_of_changes: whether effects are what changed since other logs.
    """

    ending: Ending
    standings: tuple[Standing, ...]
    ties: tuple[tuple[Tie, ...], ...]
    values: tuple[ParameterValue, ...]
    contradictions: tuple[Contradiction, ...] = ()
    excess: float = 0.0
    correlated: tuple[str, ...] = ()
    relative_error: float = float("nan")
    findings: tuple[ChannelFinding, ...] = ()
    limits: tuple[DetectionLimit, ...] = field(default=(), repr=False)
    predictable_residual: tuple[PredictableResidual, ...] = ()
    residual_model: ResidualModel | None = None
    single_strokes: tuple[str, ...] = ()
    misfits: tuple[str, ...] = ()
    written: tuple[Written, ...] = ()
    invalid: str = ""
    is_provisional: bool = False
    is_of_changes: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Of all effects that were selected, as in `standings`."""
        return tuple(each.name for each in self.standings)

    @property
    def gains(self) -> tuple[float, ...]:
        """Share of the held-out loss without each that it takes away."""
        return tuple(each.gain for each in self.standings)

    @property
    def confirmed(self) -> tuple[str, ...]:
        """Effects that parts of the log confirm which had no say in choosing them."""
        return self._of_status("confirmed")

    @property
    def ambiguous(self) -> tuple[str, ...]:
        """Effects each of which is one of a set; see `ties`."""
        return self._of_status("ambiguous")

    @property
    def suggested(self) -> tuple[str, ...]:
        """Effects that lower the error, and are not confirmed."""
        return self._of_status("suggested")

    @property
    def has_remainder(self) -> bool:
        """Whether effects leave more than single rows."""
        return bool(
            self.contradictions
            or self.excess
            or any(not each.is_of_rows for each in self.findings)
            or self.predictable_residual
            or self.misfits
            or self.invalid
        )

    @property
    def undetectable(self) -> dict[str, str]:
        """Kinds of effects that the log could not have shown, and what would."""
        return undetectable(self.limits)

    def _of_status(self, status: str) -> tuple[str, ...]:
        return tuple(each.name for each in self.standings if each.status == status)


def judge(
    found: SearchResult,
    errors: HeldOut,
    scatter: CommandScatter | None = None,
    misfits: Sequence[str] = (),
    written: Sequence[Bookkeeping[LogModel]] = (),
) -> Verdict:
    """Returns the verdict on a search.

    Args:
        found: by it.
        errors: on rows that were not fitted.
        scatter: how the arm scatters about its commands, if it does.
        misfits: rows that contradict the kind of log, in words.
        written: how the log seems to have been written, in place of what it says.
    """
    last = found.last
    white = scatter.left_of(last) if scatter else last
    left = predictable_residual(white) if found.is_complete else []
    placed = _ordered(found.standings) + _of_scatter(scatter)
    names = last.model.measurements.names
    verdict = Verdict(
        "none",
        placed,
        tuple(_ties(each, last.model.setting) for each in placed),
        parameter_values(last, len(found.first.theta)) + _scatter_values(scatter),
        contradictions(found.account, names, last.is_at_noise),
        _excess(last, scatter),
        correlated_channels(white),
        errors.relative(errors.after) if errors.has_meaningful_share else float("nan"),
        tuple(channel_findings(white)),
        tuple(detection_limits(found.account, found.doubted)),
        tuple(left),
        misfits=tuple(misfits),
        written=tuple(Written(w.name, w.what, w.remedy) for w in written),
        invalid=found.invalid,
        is_provisional=not found.is_complete,
        is_of_changes=last.model.is_of_changes,
    )
    ending, strokes = _ending(verdict, last), _single_strokes(verdict, last)
    return dataclasses.replace(verdict, ending=ending, single_strokes=strokes)


def _ordered(placed: Sequence[Standing]) -> tuple[Standing, ...]:
    """Returns standings, confirmed ones first."""
    order = ("confirmed", "ambiguous", "suggested")
    return tuple(
        sorted(placed, key=lambda each: (order.index(each.status), -each.gain))
    )


def _ending(found: Verdict, last: Fit) -> Ending:
    limits = last.settings
    is_large = found.relative_error > limits.max_relative_error
    left = bool(found.has_remainder or found.findings or found.suggested or is_large)
    if found.confirmed or found.ambiguous:
        return "partly" if left else "explained"
    if left:
        return "unexplained"
    if found.correlated and not last.noise_is_stated:
        return "unexplained"
    kinds = {x.effect.partition(".")[0] for x in found.limits}
    kinds = {kind for kind in kinds if not _is_elsewhere(kind, last.model)}
    shown = len(kinds - set(found.undetectable))
    return "none" if shown >= limits.min_detectable * len(kinds) else "too short"


def _is_elsewhere(kind: str, model: LogModel) -> bool:
    """Returns whether a kind of effect is for another kind of log to show."""
    known = effect_class(kind)
    return known is not None and issubclass(known, model.shown_elsewhere)


def _single_strokes(found: Verdict, last: Fit) -> tuple[str, ...]:
    """Returns the joints of ambiguous effects that make a single stroke."""
    pairs = zip(found.names, found.ties, strict=True)
    tied = {name.partition(".")[2] for name, ties in pairs if ties}
    return joints_of_one_stroke(last.model, tied)


def _of_scatter(scatter: CommandScatter | None) -> tuple[Standing, ...]:
    """Returns how an arm scatters as an effect: a test of its own confirms it."""
    if scatter is None:
        return ()
    return (Standing(_SCATTER, "confirmed", scatter.gain, 0, 0),)


def _scatter_values(scatter: CommandScatter | None) -> tuple[ParameterValue, ...]:
    """Returns how an arm scatters, axis by axis."""
    if scatter is None:
        return ()
    rows = zip("xyz", scatter.std.tolist(), scatter.interval.tolist(), strict=True)
    return tuple(
        ParameterValue(f"{_SCATTER}.{axis}", std, "m", (low, high), 0.0)
        for axis, std, (low, high) in rows
    )


def _excess(last: Fit, scatter: CommandScatter | None) -> float:
    """Returns the objective, if it is more than noise; else 0.

    Only where the noise is known: one estimated from a fit is always matched.
    """
    objective = scatter.objective if scatter else last.objective
    limit = last.settings.max_objective_at_noise
    is_more = last.noise_is_stated and objective > limit
    return objective if is_more else 0.0


def parameter_values(fit: Fit, own: int) -> tuple[ParameterValue, ...]:
    """Returns the effects' parameters with their intervals.

    As wide as the covariance of correlated residuals says, and as much wider as the
    model is known to be off. Without shape parameters on which no row of the log
    depends: they are as assumed.

    Args:
        fit: with the effects.
        own: number of the parameters that the model has anyway, the first ones.
    """
    if len(fit.theta) == own:
        return ()
    scaling, half = Scaling(fit.model.parameters), fit.half_intervals
    u, half = fit.linearisation.u, half + fit.error_of_model
    low, high = (scaling.from_unit(np.clip(end, 0, 1)) for end in (u - half, u + half))
    shows = fit.linearisation.effect > 0.0
    return tuple(
        ParameterValue(
            p.name,
            float(fit.theta[i]),
            p.unit,
            (float(low[i]), float(high[i])),
            None if p.is_shape else 0.0,
            bool(fit.is_at_bound[i] and fit.theta[i] != p.nominal),
        )
        for i, p in enumerate(fit.model.parameters)
        if i >= own and (shows[i] or not p.is_shape)
    )


def _ties(standing: Standing, setting: str) -> tuple[Tie, ...]:
    """Returns what is ambiguous with an effect, each once."""
    others = dict.fromkeys(" and ".join(rival) for rival in standing.rivals)
    name = standing.name
    return tuple(Tie(other, separating(name, other, setting)) for other in others)

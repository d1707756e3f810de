"""Judges what a search found: no effect missing, effects, or unexplained."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from drake_disasm.effects import Imprecision
from sysid.effect_selection.candidates import is_joint_group
from sysid.effect_selection.channel_checks import ChannelFinding, channel_findings
from sysid.effect_selection.command_scatter import CommandScatter
from sysid.effect_selection.contradictions import Contradiction
from sysid.effect_selection.detection import DetectionLimit
from sysid.effect_selection.evidence import Evidence
from sysid.effect_selection.experiments import separating
from sysid.effect_selection.fit import Fit
from sysid.effect_selection.left_over import LeftOver
from sysid.effect_selection.residual_curves import Dependence
from sysid.effect_selection.residual_model import ResidualModel
from sysid.effect_selection.search import SelectionRound
from sysid.effect_selection.strokes import joints_of_one_stroke
from sysid.effect_selection.survey import Survey
from sysid.identification.uncertainty import uncertainty
from sysid.parameters import Scaling

_SCATTER = Imprecision.__name__

#: Nothing is missing; effects explain the residual; they do but for something that
#: is left in a channel; no library effect explains it.
Ending = Literal["none", "explained", "partly", "unexplained"]


@dataclass(frozen=True)
class ParameterValue:
    """A parameter of an effect that was found.

    Attributes:
        name: with the effect's.
        value, unit: SI.
        interval: 95 %, by a block bootstrap.
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
    """Something that explains as much as an effect that was found.

    Attributes:
        name: of the other effect, or effects.
        experiment: what to record to separate the two.
    """

    name: str
    experiment: str


@dataclass(frozen=True)
class Undecided:
    """A kind of effect that gains much in nearly all blocks, of which there are few.

    Attributes:
        kind: name of its class.
        gain: share of what is left that it takes away, of blocks that were not fitted.
    """

    kind: str
    gain: float


@dataclass(frozen=True)
class Verdict:
    """What a log shows of its model.

    Attributes:
        ending: "none", "explained", "partly" (explained) or "unexplained".
        names: of the effects that are missing, the most important first; of an
            unexplained residual, the nearest.
        gains: for each, the share of the loss without it that it takes away.
        ties: for each, effects that explain as much.
        values: of their parameters.
        dependence: the strongest that is left, in words; empty if none is.
        explained: share of what could be explained that the effects explain.
        contradictions: episodes that no common effect explains.
        excess: objective that is left, in units of the noise, if it is more than noise;
            else 0.
        findings: what is left in single channels.
        limits: how large effects that are not named would have to be to be found.
        left_over: what a flexible learner explains of what the effects leave.
        residual_model: learned in their place; not physical. None if it gains little.
        single_strokes: joints of effects with ties that make a single stroke.
        undecided: more effects that may be there; the log is too short to tell.
        is_provisional: whether the time was over before the search was: effects that
            would explain more may not have been tried.
    """

    ending: Ending
    names: tuple[str, ...]
    gains: tuple[float, ...]
    ties: tuple[tuple[Tie, ...], ...]
    values: tuple[ParameterValue, ...]
    dependence: str
    explained: float
    contradictions: tuple[Contradiction, ...]
    excess: float
    findings: tuple[ChannelFinding, ...] = ()
    limits: tuple[DetectionLimit, ...] = ()
    left_over: tuple[LeftOver, ...] = ()
    residual_model: ResidualModel | None = None
    single_strokes: tuple[str, ...] = ()
    undecided: tuple[Undecided, ...] = ()
    is_provisional: bool = False


def judge(
    first: Fit,
    last: Fit,
    end: Survey,
    rounds: Sequence[SelectionRound],
    against: tuple[Contradiction, ...] = (),
    scatter: CommandScatter | None = None,
    limits: Sequence[DetectionLimit] = (),
    left_over: Sequence[LeftOver] = (),
    residual_model: ResidualModel | None = None,
) -> Verdict:
    """Returns the verdict of a search.

    Args:
        first, last: the fits without and with the effects.
        end: the survey at which it ended.
        rounds: how the effects were chosen.
        against: episodes that contradict each other.
        scatter: how the arm scatters about its commands, if it does.
        limits: of detection, at the last fit.
        left_over: what a flexible learner finds in what the last fit leaves.
        residual_model: of it, if it lowers the held-out error.
    """
    left = [d for d in end.dependences if d.accepted and _is_noticeable(d, last)]
    gains = last.effect_gains | ({_SCATTER: scatter.gain} if scatter else {})
    names = tuple(sorted(gains, key=lambda name: -gains[name]))
    found = Verdict(
        "none",
        names,
        tuple(gains[name] for name in names),
        tuple(_ties(name, rounds, last.model.has_commands) for name in names),
        parameter_values(last, len(first.theta)) + _scatter_values(scatter),
        left[0].name if left else "",
        _explained(first, last, left[0].gain if left else 0.0),
        against,
        _excess(last, scatter),
        tuple(channel_findings(scatter.left_of(last) if scatter else last)),
        tuple(limit for limit in limits if limit.effect not in names),
        tuple(left_over),
        residual_model,
        undecided=_undecided(end, last),
    )
    ending, strokes = _ending(found, last), _single_strokes(found, last)
    return dataclasses.replace(found, ending=ending, single_strokes=strokes)


def _single_strokes(found: Verdict, last: Fit) -> tuple[str, ...]:
    """Returns the joints of effects with ties that make a single stroke."""
    pairs = zip(found.names, found.ties, strict=True)
    tied = {name.partition(".")[2] for name, ties in pairs if ties}
    return joints_of_one_stroke(last.model, tied, last.settings)


def _undecided(end: Survey, last: Fit) -> tuple[Undecided, ...]:
    """Returns what may be missing besides, were there more blocks to say so.

    Where effects are found the model surely lacked something, and signed ranks of few
    blocks can't tell what else: a verdict must not say that nothing is left.
    """
    if not last.effects or last.noise_is_stated:
        return ()
    limits, kinds = last.settings, dict[str, float]()
    for e in end.effects:
        if e.gain >= limits.min_undecided and e.block_share >= limits.min_block_share:
            kinds.setdefault(e.candidates[0].name.partition(".")[0], e.gain)
    return tuple(Undecided(kind, gain) for kind, gain in kinds.items())


def _is_noticeable(dependence: Evidence, last: Fit) -> bool:
    """Returns whether a dependence takes more out than is `Fit.noticeable`."""
    measured, curve = last.model.measurements, dependence.explanation
    if not isinstance(curve, Dependence):
        return True
    channel = [each.name for each in measured.channels].index(curve.channel)
    return dependence.gain * last.loss >= last.noticeable(channel) ** 2 * measured.rows


def _ending(found: Verdict, last: Fit) -> Ending:
    enough = found.explained >= last.settings.min_explained_share
    of_channels = found.dependence or found.findings or found.left_over
    left = bool(of_channels or found.contradictions or found.undecided)
    if found.names and enough and not found.excess:
        return "partly" if left else "explained"
    return "unexplained" if left or found.names or found.excess else "none"


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


def _explained(first: Fit, last: Fit, left: float) -> float:
    """Returns the share that effects explain of what could be explained.

    Args:
        first, last: the fits without and with them.
        left: share of the last's loss that a dependence would take away.
    """
    gained = max(first.loss - last.loss, 0.0)
    missing = left * last.loss
    return gained / (gained + missing) if gained + missing > 0.0 else 1.0


def parameter_values(fit: Fit, own: int) -> tuple[ParameterValue, ...]:
    """Returns the effects' parameters with their intervals.

    An interval is that of a bootstrap, and as much wider as the model's time steps, and
    the model itself, are known to be off. Without shape parameters on which no row of
    the log depends: they are as assumed.

    Args:
        fit: with the effects.
        own: number of the parameters that the model has anyway, the first ones.
    """
    spread = uncertainty(fit.linearisation, fit.model.measurements.episode)
    scaling = Scaling(fit.model.parameters)
    off, around = fit.error_of_steps[:, None], fit.error_of_model[:, None]
    ends = spread.bootstrap + np.hstack(
        [np.minimum(off, 0.0) - around, np.maximum(off, 0.0) + around]
    )
    ends = np.clip(fit.linearisation.u[:, None] + ends, 0.0, 1.0)
    low, high = (scaling.from_unit(side) for side in ends.T)
    inside = fit.inside(np.arange(len(fit.theta)))
    shows = fit.linearisation.effect > 0.0
    return tuple(
        ParameterValue(
            p.name,
            float(fit.theta[i]),
            p.unit,
            (float(low[i]), float(high[i])),
            None if p.is_shape else 0.0,
            bool(not inside[i] and fit.theta[i] != p.nominal),
        )
        for i, p in enumerate(fit.model.parameters)
        if i >= own and (shows[i] or not p.is_shape)
    )


def _ties(
    name: str, rounds: Sequence[SelectionRound], at_task: bool
) -> tuple[Tie, ...]:
    """Returns what explained as much when an effect was added, each once."""
    joint = name.partition(".")[2]
    for found in rounds:
        if name in found.chosen.effects:
            others = [_other(tie, joint) for tie in found.ties]
            return tuple(
                Tie(other, separating(name, other, at_task))
                for other in dict.fromkeys(others)
                if name not in other.split(" and ")
            )
    return ()


def _other(tie: Evidence, joint: str) -> str:
    """Returns the effects of a tie; of one at all joints, that of the same joint."""
    same = [name for name in tie.effects if joint and name.endswith(f".{joint}")]
    is_group = is_joint_group(tie.candidates)
    return " and ".join(same if is_group and same else tie.effects)

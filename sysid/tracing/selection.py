"""Adds one effect at a time, as long as data that were not fitted get better by it."""

import dataclasses
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid.identification.gauss_newton import gauss_newton
from sysid.identification.linearisation import Linearisation, linearise
from sysid.models.base import ScenarioModel
from sysid.objective import Objective
from sysid.parameters import nominal_values
from sysid.tracing.candidates import Candidate, extended
from sysid.tracing.empirical import Dependence, curves
from sysid.tracing.study import Study, blocks_of, family_p
from sysid.workers import Workers

Array = NDArray[np.float64]

ALPHA = 0.05  # family-wise, in each round
LEAST_GAIN = 0.01  # of the loss
_LEAST_SHARE = 0.8  # of the blocks
_LEAST_FIELD = 0.005  # of the loss, that a size must be worth
_ITERATIONS = 8
_TIE = 0.05  # of the gain, by which a rival may be worse
_PAIRS_OF = 8


@dataclass(frozen=True)
class Evidence:
    """What speaks for something that explains a residual.

    Attributes:
        what: the effects, or the dependence.
        gain: share of the loss of blocks that were not fitted, that it takes away.
        p: family-wise, that it explains nothing.
        share: of the blocks that get better.
        cost: number of its parameters.
    """

    what: tuple[Candidate, ...] | Dependence
    gain: float
    p: float
    share: float
    cost: int

    @property
    def accepted(self) -> bool:
        """Whether it is more than chance."""
        significant = self.p < ALPHA and self.gain >= LEAST_GAIN
        return significant and self.share >= _LEAST_SHARE

    @property
    def name(self) -> str:
        """What it is, in words."""
        if isinstance(self.what, Dependence):
            return self.what.text
        return " and ".join(candidate.text for candidate in self.what)


@dataclass(frozen=True)
class Fit:
    """A model with effects, fitted.

    Attributes:
        effects: that were added.
        model: with their parameters.
        theta: (p,) values.
        here: residuals and derivatives there.
        value: of the objective.
    """

    effects: tuple[Candidate, ...]
    model: ScenarioModel
    theta: Array
    here: Linearisation
    value: float

    @property
    def loss(self) -> float:
        """Sum of the weighted squares."""
        return float(np.sum(self.here.weights * self.here.residual**2))


@dataclass(frozen=True)
class Survey:
    """What speaks for each candidate, and for each dependence, beside a fit.

    Attributes:
        effects, dependences: the best first.
        blocks: how many there were.
    """

    effects: list[Evidence]
    dependences: list[Evidence]
    blocks: int


@dataclass(frozen=True)
class Round:
    """One effect, or pair, that was added.

    Attributes:
        chosen: what was added.
        ties: others that explain as much.
        survey: from which it was chosen.
        value: of the objective, after.
    """

    chosen: Evidence
    ties: tuple[Evidence, ...]
    survey: Survey
    value: float


@dataclass
class Tracer:
    """Searches for what a model lacks.

    Attributes:
        base: the model, with the parameters that it has anyway.
        library: candidates.
        workers: to evaluate with.
        huber: where squares end, in units of the noise.
        tell: called with a line after each step.
    """

    base: ScenarioModel
    library: Sequence[Candidate]
    workers: Workers
    huber: float
    tell: Callable[[str], None]
    rounds: list[Round] = field(default_factory=list)

    def forward(self, fit: Fit, survey: Survey) -> tuple[Fit, Survey]:
        """Returns the fit with all effects that pass, and the survey that ended it.

        Args:
            fit: without effects.
            survey: beside it.
        """
        while True:
            accepted = [e for e in survey.effects if e.accepted]
            accepted = accepted or self._pairs(fit, survey)
            if not accepted:
                return fit, survey
            best = _simplest(accepted)
            assert isinstance(best.what, tuple)
            added = self._pruned(fit, best.what)
            fit = self.fit((*fit.effects, *added), fit.theta)
            ties = tuple(e for e in accepted if e is not best and _rivals(e, best))
            self.rounds.append(Round(best, ties, survey, fit.value))
            self.tell(f"{best.name}: objective {fit.value:.4g}")
            survey = self.survey(fit)

    def backward(self, fit: Fit) -> Fit:
        """Returns the fit without effects that later ones have made needless."""
        for candidate in fit.effects[:-1]:
            if candidate in fit.effects and not self._is_needed(fit, candidate):
                rest = tuple(c for c in fit.effects if c is not candidate)
                start = fit.theta[: len(self.base.parameters)]
                fit = self.fit(rest, start)
                self.tell(f"without {candidate.text}: objective {fit.value:.4g}")
        return fit

    def _is_needed(self, fit: Fit, candidate: Candidate) -> bool:
        """Returns whether blocks that are not fitted get worse without an effect."""
        names = [p.name for p in fit.model.parameters]
        fields = [f"{candidate.name}.{field}" for field in candidate.fields]
        own = np.array([name in fields for name in names])
        columns = np.flatnonzero(own)
        scaling = Objective(fit.model, self.workers, self.huber).scaling
        null = np.where(own, nominal_values(fit.model.parameters), fit.theta)
        change = scaling.to_unit(null) - fit.here.u
        without = dataclasses.replace(
            fit.here, residual=fit.here.residual + fit.here.jacobian @ change
        )
        blocks = blocks_of(fit.here, fit.model.measurements.episode)
        empty = np.zeros((*fit.here.residual.shape, 0))
        study = Study.of(without, empty, blocks).beside(np.flatnonzero(~own))
        return _evidence(study, [((candidate,), columns)])[0].gain >= LEAST_GAIN

    def fit(self, effects: tuple[Candidate, ...], start: Array) -> Fit:
        """Returns a model with effects, fitted from a start (k,) and from null."""
        model, _ = extended(self.base, effects, with_shapes=True)
        rest = nominal_values(model.parameters)[len(start) :]
        objective = Objective(model, self.workers, self.huber)
        u = objective.scaling.to_unit(np.concatenate([start, rest]))
        here = gauss_newton(objective, u, _ITERATIONS)
        theta = objective.scaling.from_unit(here.u)
        return Fit(effects, model, theta, here, objective.value(here.residual))

    def survey(self, fit: Fit) -> Survey:
        """Returns what speaks for each candidate that the fit does not have."""
        names = {candidate.name for candidate in fit.effects}
        rest = [c for c in self.library if c.name not in names]
        study, groups, dependences = self._study(fit, rest)
        effects = [((c,), group) for c, group in zip(rest, groups, strict=True)]
        return Survey(
            _evidence(study, [(what, g) for what, g in effects if len(g)]),
            _evidence(study, dependences),
            len(study.count),
        )

    def _pairs(self, fit: Fit, survey: Survey) -> list[Evidence]:
        """Returns pairs that pass: some effects show only together."""
        promising: dict[str, Candidate] = {}
        for evidence in survey.effects:
            assert isinstance(evidence.what, tuple)
            promising.setdefault(evidence.what[0].name, evidence.what[0])
        best = list(promising.values())[:_PAIRS_OF]
        if len(best) < 2:
            return []
        study, groups, _ = self._study(fit, best)
        pairs = [
            ((best[i], best[j]), np.concatenate([groups[i], groups[j]]))
            for i, j in itertools.combinations(range(len(best)), 2)
        ]
        return [e for e in _evidence(study, pairs) if e.accepted]

    def _pruned(self, fit: Fit, added: Sequence[Candidate]) -> list[Candidate]:
        """Returns effects with only those sizes free that blocks get better by."""
        study, groups, _ = self._study(fit, added)
        kept = [int(column) for group in groups for column in group]
        while len(kept) > 1:
            losses = {
                c: study.losses(np.array([k for k in kept if k != c])).sum()
                for c in kept
            }
            now = study.losses(np.array(kept)).sum()
            least = min(losses, key=lambda c: losses[c])
            if losses[least] > (1.0 + _LEAST_FIELD) * now:
                break
            kept.remove(least)
        found = []
        for candidate, group in zip(added, groups, strict=True):
            own = zip(candidate.fields, group, strict=True)
            fields = [field for field, column in own if int(column) in kept]
            if fields:
                found.append(candidate.only(fields))
        return found

    def _study(
        self, fit: Fit, library: Sequence[Candidate]
    ) -> tuple[Study, list[NDArray[np.int64]], list]:
        """Returns the study of candidates and curves beside a fit, and the columns."""
        model, groups = extended(fit.model, library)
        count = len(fit.theta)
        rest = nominal_values(model.parameters)[count:]
        objective = Objective(model, self.workers, self.huber)
        u = objective.scaling.to_unit(np.concatenate([fit.theta, rest]))
        here = linearise(objective, u)
        extra, dependences = curves(model)
        blocks = blocks_of(here, model.measurements.episode)
        study = Study.of(here, extra, blocks).beside(np.arange(count))
        begin = len(model.parameters)
        return (
            study,
            [np.array(group, dtype=np.int64) for group in groups],
            [(d, begin + np.array(d.columns, dtype=np.int64)) for d in dependences],
        )


def _evidence(study: Study, columns: Sequence[tuple]) -> list[Evidence]:
    """Returns the evidence for groups of columns, the highest gain first."""
    if not columns:
        return []
    gains = np.array([study.energy - study.losses(group) for _, group in columns]).T
    p, total = family_p(gains), study.energy.sum()
    found = [
        Evidence(
            what,
            float(gains[:, i].sum() / total),
            float(p[i]),
            float(np.mean(gains[:, i] > 0.0)),
            len(group) + _shape_count(what),
        )
        for i, (what, group) in enumerate(columns)
    ]
    return sorted(found, key=lambda evidence: -evidence.gain)


def _shape_count(what: tuple[Candidate, ...] | Dependence) -> int:
    return 0 if isinstance(what, Dependence) else sum(len(c.shape) for c in what)


def _rivals(evidence: Evidence, best: Evidence) -> bool:
    """Returns whether something else explains nearly as much."""
    return evidence.gain >= (1.0 - _TIE) * best.gain and evidence.name != best.name


def _simplest(accepted: Sequence[Evidence]) -> Evidence:
    """Returns the one with the fewest parameters among the best."""
    best = accepted[0]
    return min(
        (e for e in accepted if _rivals(e, best) or e is best),
        key=lambda e: (e.cost, -e.gain),
    )

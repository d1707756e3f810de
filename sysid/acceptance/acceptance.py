"""The rule: which policies the corrected twin accepts.

A policy is accepted if it does the task at the verdict's values and in each of N draws
over the verdict's 95 % intervals, within the limits of force and torque: exceeding one
ends an episode. N successes of N say that at least 0.05^(1/N) of all draws succeed,
with 95 % confidence (Clopper and Pearson, 1934, one-sided): 90 % for the 29 of `DRAWS`.
"""

import dataclasses
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest, mannwhitneyu

from drake_disasm.common.progress import Progress, ignore_progress
from drake_disasm.policies import resolve_policy
from sysid.acceptance.corrected_twin import CorrectedTwin
from sysid.acceptance.trials import Trial, TrialJob, run_trials, try_twin

#: The fewest whose success in all shows 90 % at 95 % confidence: 0.9^29 < 0.05.
DRAWS = 29
_LEVEL = 0.05  # of tests, as of the intervals
_SEPARATING = 2  # failures: with one no test reaches that level


@dataclass(frozen=True)
class Separation:
    """A parameter of the verdict by which failing draws differ from others.

    Attributes:
        parameter: its name.
        auc: probability that it is larger in a draw that fails than in one that does
            not.
        p: of the Mann-Whitney test, times the number of parameters.
    """

    parameter: str
    auc: float
    p: float

    @property
    def text(self) -> str:
        """In words."""
        side = "high" if self.auc > 0.5 else "low"
        return f"where {self.parameter} is {side} (AUC {self.auc:.2f}, p {self.p:.2g})"


@dataclass(frozen=True)
class Acceptance:
    """What the twins say of a policy.

    Attributes:
        policy: its name.
        values: the trial at the verdict's values.
        draws: trials over its intervals.
        nominal: the trial without the verdict's effects.
    """

    policy: str
    values: Trial
    draws: tuple[Trial, ...]
    nominal: Trial

    @property
    def is_accepted(self) -> bool:
        """Whether it may go to the robot, as far as the model is right."""
        return self.values.succeeded and self.successes == len(self.draws)

    @property
    def successes(self) -> int:
        """Number of draws in which it does the task."""
        return sum(trial.succeeded for trial in self.draws)

    @property
    def success_low(self) -> float:
        """One-sided 95 % bound of its share of successes over all draws."""
        test = binomtest(self.successes, len(self.draws), alternative="greater")
        return float(test.proportion_ci(0.95).low)

    @property
    def trials(self) -> tuple[Trial, ...]:
        """On the corrected twin: at the values, then the draws."""
        return (self.values, *self.draws)

    @property
    def failures(self) -> dict[str, int]:
        """How many draws ended in which way, other than success."""
        failed = (t.outcome.label for t in self.draws if not t.succeeded)
        return dict(Counter(failed).most_common())

    @property
    def separation(self) -> Separation | None:
        """The parameter that separates failing draws best, if one does."""
        failed = np.array([not trial.succeeded for trial in self.draws])
        if not _SEPARATING <= failed.sum() < len(failed):
            return None
        names, tests = list(self.draws[0].drawn), list[Separation]()
        for name in names:
            drawn = np.array([trial.drawn[name] for trial in self.draws])
            U, p = mannwhitneyu(drawn[failed], drawn[~failed])
            auc = float(U) / (failed.sum() * (~failed).sum())
            tests.append(Separation(name, float(auc), min(1.0, float(p) * len(names))))
        best = min(tests, key=lambda test: test.p, default=None)
        return best if best and best.p < _LEVEL else None

    @property
    def reason(self) -> str:
        """Why it is refused, in words; empty if it is not."""
        said = []
        if not self.values.succeeded:
            said.append(f"{self.values.outcome.label} at the verdict's values")
        for ending, count in self.failures.items():
            said.append(f"{ending} in {count} of {len(self.draws)} draws")
        text = ", ".join(said)
        return f"{text}, {self.separation.text}" if self.separation else text

    def to_mapping(self) -> dict[str, Any]:
        """Returns it as plain data."""
        trials = [trial.to_mapping() for trial in self.draws]
        separation = self.separation
        return {
            "policy": self.policy,
            "accepted": self.is_accepted,
            "reason": self.reason,
            "successes": self.successes,
            "of": len(self.draws),
            "success_low_95": self.success_low,
            "failures": self.failures,
            "separation": dataclasses.asdict(separation) if separation else None,
            "values": self.values.to_mapping(),
            "nominal": self.nominal.to_mapping(),
            "draws": trials,
        }


def accept(
    policies: Sequence[str],
    twin: CorrectedTwin,
    draws: int = DRAWS,
    seed: int = 0,
    workers: int = 1,
    folder: Path | None = None,
    progress: Progress = ignore_progress,
) -> list[Acceptance]:
    """Returns what the twins say of policies, the best first.

    Accepted ones come first, then those with more successes, then gentler ones.

    Args:
        policies: names, as of `resolve_policy`.
        twin: with the effects of a verdict.
        draws: over the verdict's intervals, at least one.
        seed: of the first draw; the same seed gives the same result.
        workers: processes.
        folder: keeps episodes: the same call, stopped and made again, goes on.
        progress: counts episodes; may raise to stop.

    Raises:
        DisasmError: there is no such policy, or it does not fit the twin.
    """
    names = list(dict.fromkeys(policies))
    values, drawn, nominal = twin.at_values, twin.over_intervals, twin.nominal
    jobs = []
    for name in names:
        resolve_policy(name, values)  # whatever is wrong is said before anything runs
    try_twin(values)
    for name in names:
        jobs += [TrialJob(name, "draw", drawn, seed + i) for i in range(draws)]
        jobs += [TrialJob(name, "values", values, seed)]
        jobs += [TrialJob(name, "nominal", nominal, seed)]
    found: dict[tuple[str, str], dict[int, Trial]] = {}
    for job, trial in run_trials(jobs, workers, folder, progress):
        found.setdefault((job.policy, job.twin), {})[job.seed] = trial
    judged = [
        Acceptance(
            name,
            found[name, "values"][seed],
            tuple(found[name, "draw"][seed + i] for i in range(draws)),
            found[name, "nominal"][seed],
        )
        for name in names
    ]
    return sorted(judged, key=_rank)


def _rank(judged: Acceptance) -> tuple[bool, int, float]:
    peaks = [trial.peak_force for trial in judged.trials]
    return not judged.is_accepted, -judged.successes, float(np.mean(peaks))

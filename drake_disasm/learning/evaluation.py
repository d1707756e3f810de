"""Deterministic validation of a policy (thesis 3.3.3.2)."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from drake_disasm.effects import Effect
from drake_disasm.learning.statistics import wilson_interval
from drake_disasm.mdp import Outcome
from drake_disasm.policies import LearnedPolicy
from drake_disasm.scenario import Scenario
from drake_disasm.task.episode import EpisodeSummary, run_episode
from drake_disasm.task.simulation import TaskSimulation


@dataclasses.dataclass(frozen=True)
class Evaluation:
    """Figures of a policy over episodes.

    Attributes:
        episodes: run.
        successes: of them.
        success_low, success_high: Wilson's 95 % interval of the rate.
        truly_out: episodes after which the bolt was truly out (simulation only).
        performance: mean episodic reward (thesis: P).
        instability: standard deviation of the episodic reward (table 3.3).
        mean_force, mean_torque: mean over the episodes of each one's mean [N, N m].
        peak_force, peak_torque: the largest of all [N, N m].
        mean_peak_force: mean over the episodes of each one's peak [N].
        steps: mean length.
    """

    episodes: int
    successes: int
    success_low: float
    success_high: float
    truly_out: int
    performance: float
    instability: float
    mean_force: float
    mean_torque: float
    peak_force: float
    peak_torque: float
    mean_peak_force: float
    steps: float


def evaluate(
    simulation: TaskSimulation,
    seeds: Sequence[int],
    effects: Sequence[Effect] | None = None,
    progress: Progress = ignore_progress,
) -> list[EpisodeSummary]:
    """Runs episodes of a simulation that has a policy.

    Args:
        simulation: its diagram holds the policy.
        seeds: one per episode; the same seeds give the same episodes.
        effects: instead of the scenario's.
        progress: called after each episode.
    """
    summaries = []
    for seed in seeds:
        summaries.append(run_episode(simulation, seed, effects=effects, is_judged=True))
        progress(ProgressUpdate("evaluating", len(summaries), len(seeds)))
    return summaries


def validate_policy(
    policy: LearnedPolicy,
    scenarios: Sequence[Scenario],
    station: str,
    seeds: Sequence[int],
    progress: Progress = ignore_progress,
) -> Evaluation:
    """Evaluates a policy in diagrams of its own, so that no training is affected.

    Args:
        policy: fits all scenarios.
        scenarios: of the tasks; each runs all episodes.
        station: "twin" or "cell".
        seeds: one per episode.
        progress: called after each episode.
    """
    summaries = list[EpisodeSummary]()
    total = len(scenarios) * len(seeds)
    for scenario in scenarios:
        simulation = TaskSimulation(scenario, station, policy.acting_on(scenario))
        for seed in seeds:
            summaries.append(run_episode(simulation, seed, is_judged=True))
            progress(ProgressUpdate("evaluating", len(summaries), total))
    return summed_up(summaries)


def summed_up(summaries: Sequence[EpisodeSummary]) -> Evaluation:
    """Returns the figures of one or more episodes."""
    rewards = np.array([s.reward for s in summaries])
    successes = sum(s.outcome is Outcome.SUCCESS for s in summaries)
    low, high = wilson_interval(successes, len(summaries))
    return Evaluation(
        episodes=len(summaries),
        successes=successes,
        success_low=low,
        success_high=high,
        truly_out=sum(s.bolt_is_out for s in summaries),
        performance=float(rewards.mean()),
        instability=float(rewards.std()),
        mean_force=float(np.mean([s.mean_force for s in summaries])),
        mean_torque=float(np.mean([s.mean_torque for s in summaries])),
        peak_force=max(s.max_force for s in summaries),
        peak_torque=max(s.max_torque for s in summaries),
        mean_peak_force=float(np.mean([s.max_force for s in summaries])),
        steps=float(np.mean([s.steps for s in summaries])),
    )

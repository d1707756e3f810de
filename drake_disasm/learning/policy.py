"""From a trained agent to a policy that runs without torch."""

import dataclasses
from typing import Any

from drake_disasm.learning.training import TrainingSpec, task_view
from drake_disasm.mdp import ACTION_NAMES, STATE_NAMES
from drake_disasm.policies import (
    LearnedPolicy,
    Network,
    PolicyDescription,
    scenario_hash,
)


def trained_policy(
    network: Network, spec: TrainingSpec, provenance: dict[str, Any]
) -> LearnedPolicy:
    """Returns the greedy policy of a training.

    Args:
        network: of its agent, at any episode.
        spec: of the training.
        provenance: command, date, seed, versions, commit.
    """
    tasks = [scenario.task for scenario in spec.scenarios]
    return LearnedPolicy(
        network=_greedy(network),
        view=task_view(spec.scenario, spec.config),
        description=PolicyDescription(
            agent=spec.config.algorithm,
            preset=provenance.get("preset", ""),
            hyperparameters=dataclasses.asdict(spec.config),
            scenario_hash=scenario_hash(spec.scenario),
            station=spec.station,
            state_names=STATE_NAMES,
            action_names=ACTION_NAMES,
            observation_variant=spec.scenario.observation.variant,
            period=tasks[0].period,
            max_translation=min(task.max_translation for task in tasks),
            max_rotation=min(task.max_rotation for task in tasks),
            way=spec.scenario.part.way,
            provenance=provenance,
            evaluation={},
        ),
    )


def _greedy(network: Network) -> Network:
    """Returns the network without SAC's log sigmas, which a greedy policy ignores."""
    count = len(ACTION_NAMES)
    weights, biases = network.weights, network.biases
    return Network(
        (*weights[:-1], weights[-1][:count]), (*biases[:-1], biases[-1][:count])
    )

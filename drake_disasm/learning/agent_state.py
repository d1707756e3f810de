"""The state of an agent, as plain data."""

from typing import Any, NamedTuple

import torch
from torch import Tensor
from torch.utils._pytree import tree_map

from drake_disasm.learning.adam import Moments, no_moments
from drake_disasm.learning.hyperparameters import Hyperparameters
from drake_disasm.learning.networks import Critics, Layers, make_layers


class AgentState(NamedTuple):
    """Everything that an update reads and writes.

    Attributes:
        actor: network from states to actions; SAC's gives mean and log sigma.
        critics: networks from states and actions to values.
        target_actor, target_critics: their slow copies; SAC has no target actor.
        log_entropy: () logarithm of SAC's entropy coefficient.
        actor_moments, critic_moments, entropy_moments: Adam's moments.
    """

    actor: Layers
    critics: Critics
    target_actor: Layers
    target_critics: Critics
    log_entropy: Tensor
    actor_moments: Moments
    critic_moments: Moments
    entropy_moments: Moments


def make_state(
    config: Hyperparameters, seed: int, states: int, actions: int
) -> AgentState:
    """Returns a fresh agent for so many states and actions; equal seeds, equal bits.

    No two of its tensors are one, as in any later state: torch would compile the first
    update for itself, and where another agent has more networks it fails to say why
    (its issue 176211).
    """
    generator = torch.Generator().manual_seed(seed)
    soft = config.algorithm == "sac"
    outputs = 2 * actions if soft else actions
    actor = make_layers([states, *config.hidden, outputs], generator)
    if config.base:
        actor = _quiet(actor, actions, config.log_sigma if soft else 0.0)
    sizes = [states + actions, *config.hidden, 1]
    critics = tuple(
        make_layers(sizes, generator, config.layer_norm) for _ in range(config.critics)
    )
    log_entropy = torch.tensor(config.entropy).log()
    state = AgentState(
        actor,
        critics,
        () if soft else actor,
        critics,
        log_entropy,
        no_moments(actor),
        no_moments(critics),
        no_moments(log_entropy),
    )
    copied: AgentState = tree_map(torch.clone, state)
    return copied


def _quiet(actor: Layers, actions: int, log_sigma: float) -> Layers:
    """Returns the actor with a last layer so small that its output is nearly zero.

    Args:
        actor: as drawn.
        actions: how many it chooses.
        log_sigma: initial value of SAC's log sigmas.
    """
    last = {name: 0.01 * value for name, value in actor[-1].items()}
    last["bias"][actions:] += log_sigma
    return (*actor[:-1], last)


def mixed(new: Any, old: Any, tau: float) -> Any:
    """Returns tau new + (1 - tau) old, the soft update of targets."""
    return tree_map(lambda a, b: tau * a + (1.0 - tau) * b, new, old)

"""One gradient update of each algorithm, as a function from state to state.

DDPG (Lillicrap et al., 2016) is TD3 (Fujimoto et al., 2018) with one critic, no
delay and no noise on the target's action; SAC is Haarnoja et al. (2018). What is
drawn at random comes in as an argument, so the functions are pure and torch compiles
each as one graph.
"""

import math

import torch
from torch import Tensor
from torch.func import grad, grad_and_value

from drake_disasm.learning.adam import descend
from drake_disasm.learning.agent_state import AgentState, mixed
from drake_disasm.learning.hyperparameters import Hyperparameters
from drake_disasm.learning.networks import (
    Critics,
    Layers,
    evaluate,
    least_q,
    q_value,
)
from drake_disasm.learning.replay import Batch, split

#: Bounds of SAC's log sigma.
LOG_SIGMA = (-20.0, 2.0)
# Named, since torch.compile can't read a subscript in an inner function's signature.
_LossAndDensity = tuple[Tensor, Tensor]
_LOG_ROOT_2PI = 0.5 * math.log(2.0 * math.pi)


def update_deterministic(
    state: AgentState,
    rows: Tensor,
    noise: Tensor,
    config: Hyperparameters,
    with_actor: bool,
) -> tuple[AgentState, Tensor]:
    """Returns the state after one update of DDPG or TD3, and the critics' loss ().

    Args:
        state: before.
        rows: (n, 2 s + a + 3) transitions.
        noise: (n, a) standard normal, for the target's action.
        config: rates, discount and the like.
        with_actor: whether actor and targets are updated, too (every `policy_delay`).
    """
    batch = split(rows, state.actor[0]["weight"].shape[1])
    limit = config.target_noise_limit
    action = torch.tanh(evaluate(state.target_actor, batch.next_observation))
    shake = (config.target_noise * noise).clamp(-limit, limit)
    action = (action + shake).clamp(-1.0, 1.0)
    value = least_q(state.target_critics, batch.next_observation, action)
    state, loss = _fit_critics(state, batch, value, config, 1.0)
    if not with_actor:
        return state, loss

    def actor_loss(actor: Layers) -> Tensor:
        """Returns minus the value of the actor's actions."""
        chosen = torch.tanh(evaluate(actor, batch.observation))
        value = q_value(state.critics[0], batch.observation, chosen)
        return -(batch.weight * value).sum()

    state = _move_actor(state, grad(actor_loss)(state.actor), config)
    return _move_targets(state, config), loss


def update_soft(
    state: AgentState,
    rows: Tensor,
    noise: Tensor,
    config: Hyperparameters,
    with_actor: bool,
) -> tuple[AgentState, Tensor]:
    """Returns the state after one update of SAC, and the critics' loss ().

    Args:
        state, rows, config: as in `update_deterministic`.
        noise: (n, 2 a) standard normal: for the actions at the states, then for
            those at the next states.
        with_actor: whether actor and entropy coefficient are updated, too.
    """
    batch = split(rows, state.actor[0]["weight"].shape[1])
    now, then = noise.chunk(2, dim=1)
    entropy = state.log_entropy.exp()
    action, log_density = sample_action(state.actor, batch.next_observation, then)
    value = least_q(state.target_critics, batch.next_observation, action)
    state, loss = _fit_critics(state, batch, value - entropy * log_density, config, 0.5)
    if with_actor:

        def actor_loss(actor: Layers) -> _LossAndDensity:
            """Returns minus value and entropy of the actions; mean log density."""
            chosen, density = sample_action(actor, batch.observation, now)
            q = least_q(state.critics, batch.observation, chosen)
            loss = entropy * density - q
            return (batch.weight * loss).sum(), (batch.weight * density).sum()

        gradient, (_, density) = grad_and_value(actor_loss, has_aux=True)(state.actor)
        if config.adapt_entropy:
            surplus = batch.action.shape[1] - density
            state = _move_entropy(state, surplus, config)
        state = _move_actor(state, gradient, config)
    targets = mixed(state.critics, state.target_critics, config.tau)
    return state._replace(target_critics=targets), loss


def sample_action(
    actor: Layers, observation: Tensor, noise: Tensor
) -> tuple[Tensor, Tensor]:
    """Returns SAC's actions (n, a) and the logarithm of their density (n,).

    Args:
        actor: gives mean and log sigma, (n, 2 a).
        observation: (n, s) scaled.
        noise: (n, a) standard normal.
    """
    mean, log_sigma = evaluate(actor, observation).chunk(2, dim=1)
    log_sigma = log_sigma.clamp(*LOG_SIGMA)
    action = torch.tanh(mean + log_sigma.exp() * noise)
    gaussian = -0.5 * noise.square() - log_sigma - _LOG_ROOT_2PI
    squash = torch.log(1.0 - action.square() + 1e-6)
    return action, (gaussian - squash).sum(dim=1)


def _fit_critics(
    state: AgentState,
    batch: Batch,
    next_value: Tensor,
    config: Hyperparameters,
    factor: float,
) -> tuple[AgentState, Tensor]:
    """Moves the critics towards y = r + gamma (1 - terminated) next_value.

    `factor` is what their mean squared error is multiplied by.
    """
    y = batch.reward + config.gamma * (1.0 - batch.terminated) * next_value

    def loss(critics: Critics) -> Tensor:
        """Returns their mean squared error."""
        errors = [q_value(c, batch.observation, batch.action) - y for c in critics]
        squares = torch.stack(errors).square()
        return factor * (batch.weight * squares).sum()

    gradient, value = grad_and_value(loss)(state.critics)
    critics, moments = descend(
        state.critics,
        gradient,
        state.critic_moments,
        config.critic_rate,
        config.adam_epsilon,
    )
    return state._replace(critics=critics, critic_moments=moments), value


def _move_actor(
    state: AgentState, gradient: Layers, config: Hyperparameters
) -> AgentState:
    actor, moments = descend(
        state.actor,
        gradient,
        state.actor_moments,
        config.actor_rate,
        config.adam_epsilon,
    )
    return state._replace(actor=actor, actor_moments=moments)


def _move_entropy(
    state: AgentState, surplus: Tensor, config: Hyperparameters
) -> AgentState:
    """Adapts the entropy coefficient until the mean log density has no surplus ()."""
    log_entropy, moments = descend(
        state.log_entropy,
        surplus.detach(),
        state.entropy_moments,
        config.actor_rate,
        config.adam_epsilon,
    )
    return state._replace(log_entropy=log_entropy, entropy_moments=moments)


def _move_targets(state: AgentState, config: Hyperparameters) -> AgentState:
    return state._replace(
        target_actor=mixed(state.actor, state.target_actor, config.tau),
        target_critics=mixed(state.critics, state.target_critics, config.tau),
    )

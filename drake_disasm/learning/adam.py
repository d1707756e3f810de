"""Adam as a function (Kingma & Ba, 2015), in the form of torch.optim."""

from typing import Any, NamedTuple

import torch
from torch import Tensor
from torch.utils._pytree import tree_map

_BETA1, _BETA2 = 0.9, 0.999


class Moments(NamedTuple):
    """Adam's moments.

    Attributes:
        steps: () taken.
        bias: (2,) that the running means will have at the next step: 1 - beta1^t and
            the root of 1 - beta2^t. Stored, since compiled code would compute both
            powers again in every iteration of the step's loop.
        first, second: running means of the gradient and its square, shaped as the
            parameters.
    """

    steps: Tensor
    bias: Tensor
    first: Any
    second: Any


def no_moments(parameters: Any) -> Moments:
    """Returns the moments before the first step."""
    zeros = tree_map(torch.zeros_like, parameters)
    steps = torch.zeros((), dtype=torch.float64)
    return Moments(steps, _bias(steps + 1.0), zeros, zeros)


def descend(
    parameters: Any, gradient: Any, moments: Moments, rate: float, epsilon: float
) -> tuple[Any, Moments]:
    """Returns the parameters after one step down the gradient, and the new moments."""
    first = tree_map(
        lambda m, g: _BETA1 * m + (1.0 - _BETA1) * g, moments.first, gradient
    )
    second = tree_map(
        lambda v, g: _BETA2 * v + (1.0 - _BETA2) * g * g, moments.second, gradient
    )
    step, root = rate / moments.bias[0], moments.bias[1]
    moved = tree_map(
        lambda p, m, v: p - step * m / (v.sqrt() / root + epsilon),
        parameters,
        first,
        second,
    )
    steps = moments.steps + 1.0
    return moved, Moments(steps, _bias(steps + 1.0), first, second)


def _bias(steps: Tensor) -> Tensor:
    # In double precision: 1 - 0.999 has lost digits in single.
    return torch.stack([1.0 - _BETA1**steps, (1.0 - _BETA2**steps).sqrt()]).float()

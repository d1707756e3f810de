"""Adam as a function (Kingma & Ba, 2015), in the form that torch.optim has."""

from typing import Any, NamedTuple

import torch
from torch import Tensor
from torch.utils._pytree import tree_map

_BETA1, _BETA2 = 0.9, 0.999


class Moments(NamedTuple):
    """Adam's memory.

    Attributes:
        steps: () taken.
        first, second: running means of the gradient and its square, shaped as the
            parameters.
    """

    steps: Tensor
    first: Any
    second: Any


def no_moments(parameters: Any) -> Moments:
    """Returns the memory before the first step."""
    zeros = tree_map(torch.zeros_like, parameters)
    return Moments(torch.zeros((), dtype=torch.float64), zeros, zeros)


def descend(
    parameters: Any, gradient: Any, moments: Moments, rate: float, epsilon: float
) -> tuple[Any, Moments]:
    """Returns the parameters after one step down the gradient, and the new memory."""
    steps = moments.steps + 1.0
    first = tree_map(
        lambda m, g: _BETA1 * m + (1.0 - _BETA1) * g, moments.first, gradient
    )
    second = tree_map(
        lambda v, g: _BETA2 * v + (1.0 - _BETA2) * g * g, moments.second, gradient
    )
    # Both corrections in double precision: 1 - 0.999 has lost digits in single.
    step = (rate / (1.0 - _BETA1**steps)).float()
    root = (1.0 - _BETA2**steps).sqrt().float()
    moved = tree_map(
        lambda p, m, v: p - step * m / (v.sqrt() / root + epsilon),
        parameters,
        first,
        second,
    )
    return moved, Moments(steps, first, second)

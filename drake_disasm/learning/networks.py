"""Networks as plain data: parameters in tuples, and functions of them.

Nothing here has state, so that a whole update is one function from parameters to
parameters, which torch compiles as one graph.
"""

import itertools
import math
from collections.abc import Sequence

import torch
from torch import Tensor
from torch.nn import functional

#: One linear layer: `weight` (out, in) and `bias` (out,); with `scale` and `shift`
#: (out,), LayerNorm comes between it and its ReLU.
Layer = dict[str, Tensor]

#: Parameters of a multilayer perceptron.
Layers = tuple[Layer, ...]

#: Parameters of several critics.
Critics = tuple[Layers, ...]


def make_layers(
    sizes: Sequence[int], generator: torch.Generator, layer_norm: bool = False
) -> Layers:
    """Returns newly drawn parameters, distributed as torch.nn.Linear's.

    Args:
        sizes: of input, hidden layers and output.
        generator: source of the numbers.
        layer_norm: whether hidden layers are normalised.
    """
    layers: list[Layer] = []
    pairs = list(itertools.pairwise(sizes))
    for fan_in, fan_out in pairs:
        layer = {"weight": torch.empty(fan_out, fan_in), "bias": torch.empty(fan_out)}
        for values in layer.values():
            bound = 1.0 / math.sqrt(fan_in)
            values.uniform_(-bound, bound, generator=generator)
        if layer_norm and len(layers) < len(pairs) - 1:
            layer |= {"scale": torch.ones(fan_out), "shift": torch.zeros(fan_out)}
        layers.append(layer)
    return tuple(layers)


def evaluate(layers: Layers, x: Tensor) -> Tensor:
    """Returns the linear output (n, out) for inputs (n, in)."""
    for layer in layers[:-1]:
        x = functional.linear(x, layer["weight"], layer["bias"])
        if "scale" in layer:
            x = functional.layer_norm(x, x.shape[-1:], layer["scale"], layer["shift"])
        x = torch.relu(x)
    return functional.linear(x, layers[-1]["weight"], layers[-1]["bias"])


def q_value(critic: Layers, observation: Tensor, action: Tensor) -> Tensor:
    """Returns Q (n,) of states (n, 12) and normalised actions (n, 6)."""
    return evaluate(critic, torch.cat([observation, action], dim=1)).squeeze(1)


def least_q(critics: Sequence[Layers], observation: Tensor, action: Tensor) -> Tensor:
    """Returns the minimum of the critics' values (n,)."""
    values = [q_value(critic, observation, action) for critic in critics]
    return torch.stack(values).amin(dim=0)

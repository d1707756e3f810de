"""Random numbers of a training: one stream for each purpose in each episode."""

import enum
from typing import Any

import numpy as np
import torch
from torch import Tensor


class Purpose(enum.IntEnum):
    """What random numbers are used for."""

    PARAMETERS = 0
    EPISODE = 1
    EXPLORATION = 2
    UPDATES = 3
    VALIDATION = 4


class TensorRandom:
    """What learning needs of `np.random.Generator`, as tensors on a device."""

    def __init__(self, seed: int, device: str) -> None:
        self._options: dict[str, Any] = {
            "generator": torch.Generator(device).manual_seed(seed),
            "device": device,
        }

    def standard_normal(
        self, shape: int | tuple[int, ...], dtype: object = None
    ) -> Tensor:
        """Returns float32 of any `dtype`."""
        return torch.randn(shape, **self._options)

    def integers(self, high: int, size: int) -> Tensor:
        """Returns numbers (size,) from 0 to high - 1."""
        return torch.randint(high, (size,), **self._options)


Random = np.random.Generator | TensorRandom


def seed_for(seed: int, purpose: Purpose, number: int = 0) -> int:
    """Returns the seed of one purpose in one episode of a training."""
    sequence = np.random.SeedSequence([seed, int(purpose), number])
    return int(sequence.generate_state(1)[0])

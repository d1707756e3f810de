"""Trained policies with random weights."""

from collections.abc import Callable

import numpy as np
import pytest

from drake_disasm.policies import (
    LearnedPolicy,
    Network,
    PolicyDescription,
    Straight,
    TaskView,
)


def random_network(*widths: int, seed: int = 0) -> Network:
    """Returns a network whose layers have these widths, input first."""
    generator = np.random.default_rng(seed)
    sizes = list(zip(widths[1:], widths, strict=False))
    return Network(
        tuple(generator.normal(0.0, 0.2, size).astype(np.float32) for size in sizes),
        tuple(generator.normal(0.0, 0.2, size[0]).astype(np.float32) for size in sizes),
    )


@pytest.fixture
def make_network() -> Callable[..., Network]:
    return random_network


@pytest.fixture
def policy() -> LearnedPolicy:
    return LearnedPolicy(
        random_network(12, 7, 5, 6),
        TaskView(
            np.repeat([0.01, 0.035, 5.0, 1.0], 3),
            np.repeat([3e-4, 1.7e-3], 3),
            Straight(speed=0.0007),
        ),
        PolicyDescription(
            agent="td3",
            preset="best",
            hyperparameters={"hidden": [7, 5], "batch": 64},
            scenario_hash="0" * 64,
            station="twin",
            provenance={"seed": 3, "command": "python tools/train.py"},
            evaluation={"performance": 12.5},
        ),
    )

"""Our Bees Algorithm and the published package, on standard functions."""

import numpy as np
import pytest
from bees_comparison import ours, theirs


@pytest.mark.parametrize("name", ["rosenbrock", "ackley", "rastrigin"])
def test_is_as_good_as_the_published_package(name):
    mine, published = (
        np.median(np.log10([best(name, seed) + 1e-12 for seed in range(6)]))
        for best in (ours, theirs)
    )
    assert mine < published + 1.0

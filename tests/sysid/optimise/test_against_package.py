"""Our Bees Algorithm beside the published package, on five standard functions."""

import bees_algorithm
import numpy as np
import pytest

from sysid.optimise import BeesAlgorithm, BeesSettings, Box
from sysid.optimise.bees import Stop
from tests.sysid.optimise.functions import STANDARD

EVALUATIONS = 3000
SETTINGS = BeesSettings(
    10, 5, 10, 1, 15, stagnation_limit=10, shrink=0.8, neighbourhood=1.0
)


def ours(name: str, seed: int) -> float:
    """Returns the best value that our search finds."""
    function, half, size = STANDARD[name]
    box = Box.of([-half] * size, [half] * size)
    bees = BeesAlgorithm(box, SETTINGS, seed)
    return bees.run(function, stop=Stop(evaluations=EVALUATIONS)).best_value


def theirs(name: str, seed: int) -> float:
    """Returns the best value that the package finds with the same colony."""
    function, half, size = STANDARD[name]
    parameters = bees_algorithm.BeesParameters(
        n_scouts=SETTINGS.scouts,
        n_sites=SETTINGS.sites,
        n_elite_sites=SETTINGS.elite_sites,
        n_foragers_site=SETTINGS.recruits,
        n_foragers_elite=SETTINGS.elite_recruits,
        stagnation_limit=SETTINGS.stagnation_limit,
        shrink_factor=1.0 - SETTINGS.shrink,
    )
    cycles = (EVALUATIONS - SETTINGS.initial) // SETTINGS.per_cycle
    search = bees_algorithm.BeesAlgorithm(
        function,
        ([-half] * size, [half] * size),
        parameters,
        direction="minimize",
        vectorized=True,
        seed=seed,
    )
    return search.optimize(max_iterations=cycles).score


@pytest.mark.parametrize("name", STANDARD)
def test_is_as_good_as_the_published_package(name):
    """Medians of the logarithm over ten seeds: no worse by more than a decade."""
    seeds = range(10)
    mine = np.median(np.log10([ours(name, s) + 1e-12 for s in seeds]))
    published = np.median(np.log10([theirs(name, s) + 1e-12 for s in seeds]))
    assert mine < published + 1.0

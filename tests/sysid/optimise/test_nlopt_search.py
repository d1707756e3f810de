import cma
import numpy as np
import pytest
from bees_comparison import rosenbrock, sphere

from sysid.optimise import BeesAlgorithm, Box, nlopt_search
from sysid.optimise.bees import Stop

BOX = Box.of([-2.0] * 3, [3.0] * 3)


def test_three_opinions_on_rosenbrock():
    bees = BeesAlgorithm(BOX, seed=1).run(rosenbrock, stop=Stop(evaluations=1500))
    crs = nlopt_search(rosenbrock, BOX, "GN_CRS2_LM", 1500, seed=1)
    for trace in (bees, crs):
        nlopt_search(rosenbrock, BOX, "LN_SBPLX", 4000, trace.best, trace=trace)
    options = {"bounds": [-2, 3], "seed": 1, "verbose": -9, "maxfevals": 3000}
    third, _ = cma.fmin2(lambda x: rosenbrock(x[None])[0], np.zeros(3), 1.0, options)
    for found in (bees.best, crs.best, third):
        np.testing.assert_allclose(found, 1.0, atol=0.02)


def test_spends_its_budget_and_is_the_same_with_the_same_seed():
    first, second, other = (
        nlopt_search(sphere, BOX, "GN_CRS2_LM", 100, seed=seed) for seed in (5, 5, 6)
    )
    assert first.values == second.values != other.values
    assert first.evaluations == 100 and first.stopped == "budget"


def test_never_leaves_the_bounds_by_a_rounding_error():
    box = Box.of([0.1, -0.3], [0.7, 0.1])
    trace = nlopt_search(lambda x: -x.sum(axis=1), box, "LN_SBPLX", 300)
    points = np.array(trace.points)
    assert (points >= box.low).all() and (points <= box.high).all()
    np.testing.assert_allclose(trace.best, box.high, atol=1e-6)


def test_what_goes_wrong_in_the_function_comes_out():
    calls = []

    def function(x):
        calls.append(1)
        if len(calls) == 20:
            raise KeyboardInterrupt
        return sphere(x)

    with pytest.raises(KeyboardInterrupt):
        nlopt_search(function, BOX, "GN_CRS2_LM", 100)
    assert len(calls) == 20


def test_round_off_keeps_the_best_so_far():
    """SBPLX on steps gives up by itself; what it found is there."""
    trace = nlopt_search(lambda x: np.floor(sphere(x) * 4), BOX, "LN_SBPLX", 2000)
    assert trace.best_value == 0.0
    assert trace.stopped in ("converged", "budget") or "NLopt" in trace.stopped

"""How many simulations a fit takes, where each costs seconds."""

import numpy as np

from sysid.identification.gauss_newton import gauss_newton
from sysid.objective import Objective
from sysid.workers import Workers
from tests.sysid.toys import Decay


def test_at_a_minimum_one_step_is_tried_and_no_damped_ones():
    model = Decay()
    objective = Objective(model, Workers())
    found = gauss_newton(objective, objective.start, 20, central=False, min_gain=1e-9)
    before = objective.evaluations
    again = gauss_newton(objective, found.u, start=found, central=False)
    assert objective.evaluations == before + 1
    assert np.array_equal(again.u, found.u)


def test_far_from_it_a_fit_still_arrives():
    model = Decay()
    objective = Objective(model, Workers())
    u = np.array([0.9, 0.02, 0.9])
    found = gauss_newton(objective, u, 30, central=False)
    assert objective.value(found.residual) < 1.1

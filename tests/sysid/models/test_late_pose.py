"""Where an arm is whose pose comes late, and what will be measured of it."""

import numpy as np
import pytest

from drake_disasm.effects import PoseDelay, reported_poses
from sysid.models.late_pose import LatePoses, on_time

_PERIOD, _STEPS = 0.1, 12


def _paths():
    """Where the arm goes by its model, and truly: elsewhere by what the model lacks."""
    random = np.random.default_rng(0)
    path = np.cumsum(random.normal(size=(_STEPS + 1, 6)), axis=0)
    path[0] = 0.0
    return path, path + 0.01 * np.cumsum(random.normal(size=path.shape), axis=0)


@pytest.mark.parametrize("delay", [0.004, 0.2])
def test_what_is_measured_later_tells_where_it_was(delay):
    path, true = _paths()
    weights = PoseDelay(delay).weights(_PERIOD)
    measured = reported_poses(true, weights)
    found = on_time(measured, path, weights)
    inner = slice(1, -len(weights) + 1)
    left, there = (found - true)[inner], (path - true)[inner]
    assert np.abs(left).max() < 0.02 * np.abs(there).max()


@pytest.mark.parametrize("delay", [0.13, 0.3])
def test_a_true_prediction_gives_what_is_measured(delay):
    path, true = _paths()
    weights = PoseDelay(delay).weights(_PERIOD)
    measured, rows = reported_poses(true, weights), np.arange(_STEPS)
    late = LatePoses.of([path], weights)
    found = late.at_ends(rows, measured[:-1], true[:-1], true[1:])
    np.testing.assert_allclose(found, measured[1:], atol=1e-12)


def test_steps_that_are_not_predicted_go_by_the_model_and_not_across_episodes():
    path, true = _paths()
    weights = np.array([0.0, 1.0])
    late = LatePoses.of([path, 2.0 * path], weights)
    before, rows = np.zeros((3, 6)), np.array([4, 5, _STEPS])
    found = late.at_ends(rows, before, true[[4, 5, 0]], true[[5, 6, 1]])
    moved = [path[4] - path[3], true[5] - true[4], np.zeros(6)]
    np.testing.assert_allclose(found, moved, atol=1e-12)

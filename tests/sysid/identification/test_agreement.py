"""Do two searches agree: cases with a known answer."""

import numpy as np
import pytest

from sysid.identification.agreement import compare_methods
from sysid.identification.uncertainty import Uncertainty

SPREAD = Uncertainty(
    1e-4 * np.eye(2),
    1e-4 * np.eye(2),
    1e-2 * np.random.default_rng(0).normal(size=(2000, 2)),
    1,
)


def judge(points, values):
    return compare_methods(("bees", "nlopt"), points, values, 1000, SPREAD, ("a", "b"))


def test_agreement():
    found = judge((np.array([0.5, 0.5]), np.array([0.501, 0.499])), (1.0, 1.0005))
    assert found.agree and "agree" in found.text
    assert found.distance < 1 and found.objective_gap < 1


def test_one_that_is_stuck_is_named():
    found = judge((np.array([0.5, 0.5]), np.array([0.9, 0.1])), (1.0, 1.4))
    assert not found.agree
    assert found.text.startswith("nlopt is stuck") and "Take bees's" in found.text


def test_same_value_elsewhere_is_not_identifiable():
    found = judge((np.array([0.5, 0.5]), np.array([0.7, 0.495])), (1.0, 1.0))
    assert not found.agree and found.objective_gap < 1 < found.distance
    assert "less precisely" in found.text and "a by 20)" in found.text


def test_the_edge_is_that_of_the_likelihood_region():
    """n (f1^2 - f2^2) / f2^2 = 5.99 for two parameters at 95 %."""
    at_edge = np.sqrt(1.0 + 5.991 / 1000)
    same = np.array([0.5, 0.5])
    assert judge((same, same), (1.0, at_edge)).objective_gap == pytest.approx(
        1, abs=0.1
    )

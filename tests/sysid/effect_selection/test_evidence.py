"""Which of several effects that explain about as much is named."""

from types import SimpleNamespace

import numpy as np
import pytest

from drake_disasm.effects import (
    JointAsymmetricFriction,
    JointCoulombFriction,
    JointCoupling,
    JointLoadFriction,
    JointViscousFriction,
)
from sysid.effect_selection.block_regression import BlockRegression
from sysid.effect_selection.candidates import Candidate
from sysid.effect_selection.evidence import Evidence, most_parsimonious
from sysid.effect_selection.search import trials
from sysid.effect_selection.settings import DEFAULT_SETTINGS, SelectionSettings
from sysid.effect_selection.trial_comparison import ties_by_fit

_SCATTER = np.random.default_rng(0).normal(size=40)


def _evidence(kind, gain, count):
    """Returns evidence that the blocks can't distinguish from others like it."""
    gains = gain * (1.0 + np.roll(_SCATTER, int(1000 * gain)))
    candidate = Candidate.of(kind(joint="j1"))
    return Evidence((candidate,), gain, 0.01, 1.0, count, gains, DEFAULT_SETTINGS)


def test_of_a_tie_the_first_of_the_library_with_the_fewest_amplitudes_is_named():
    load = _evidence(JointLoadFriction, 0.80, 2)
    asymmetric = _evidence(JointAsymmetricFriction, 0.79, 3)
    dry = _evidence(JointCoulombFriction, 0.74, 2)
    assert dry.ties_with(load)
    found = trials([load, asymmetric, dry], 3)
    assert [e.effects[0].partition(".")[0] for e in found] == [
        "JointCoulombFriction",
        "JointLoadFriction",
        "JointAsymmetricFriction",
    ]


def test_what_explains_clearly_more_is_named():
    load, dry = (
        _evidence(JointLoadFriction, 0.80, 2),
        _evidence(JointCoulombFriction, 0.60, 2),
    )
    assert most_parsimonious([load, dry]) is load
    # The blocks distinguish them, though they gain nearly as much in all.
    load, dry = (
        Evidence(e.explanation, g, 0.01, 1.0, 2, np.full(40, g), DEFAULT_SETTINGS)
        for e, g in ((load, 0.80), (dry, 0.74))
    )
    assert most_parsimonious([load, dry]) is load


def test_the_rarer_effect_is_no_simpler_than_one_of_all_joints():
    coupling = _evidence(JointCoupling, 0.74, 4)
    each = _evidence(JointViscousFriction, 0.80, 7)
    assert coupling.ties_with(each)
    assert most_parsimonious([each, coupling]) is each


def test_the_best_shape_of_an_effect_is_taken():
    low, high = (_evidence(JointCoulombFriction, gain, 2) for gain in (0.79, 0.80))
    assert most_parsimonious([high, low]) is high


def test_columns_that_act_in_few_blocks_have_a_least_p_value():
    """Spread evenly over n blocks no flips give less than 2^(1 - n)."""
    rows, size = 80, 4
    A = np.zeros((rows, 2))
    A[:, 0], A[: 3 * size, 1] = 1.0, 1.0
    regression = BlockRegression(
        A, np.ones(rows), np.arange(0, rows, size), np.ones(2), np.zeros(2), 1, np.inf,
        SelectionSettings(), np.ones(rows),
    )  # fmt: skip
    assert regression.least_p(np.array([0])) == pytest.approx(2.0**-19)
    assert regression.least_p(np.array([1])) == pytest.approx(0.25)


@pytest.mark.parametrize(("gain", "is_tie"), [(0.16, True), (0.05, False)])
def test_a_rival_that_was_not_fitted_may_gain_by_a_fit_as_the_best_did(gain, is_tie):
    """The linear account saw 0.22 of the loss, the fit took away 0.49 of it."""
    best, rival = (
        _evidence(kind, g, 1)
        for kind, g in ((JointCoulombFriction, 0.22), (JointLoadFriction, gain))
    )
    before, found = (
        SimpleNamespace(loss=loss, settings=DEFAULT_SETTINGS) for loss in (100.0, 51.0)
    )
    ties = ties_by_fit(best, [rival], [(best, found)], before, found)
    assert ties == ((rival,) if is_tie else ())


def test_what_the_other_blocks_say_nothing_of_goes_to_null():
    """A column acts in one block, and by rounding in the others."""
    back, rows, size = -2.0, 80, 4
    A = np.full((rows, 1), 1e-12)
    A[:size] = 3.0
    r = np.full(rows, 0.5)
    regression = BlockRegression(
        A, r, np.arange(0, rows, size), np.ones(1), np.zeros(1), 1, np.inf,
        SelectionSettings(), r,
    )  # fmt: skip
    losses = regression.held_out_losses(np.array([0]), np.array([back]))
    assert losses[0] == pytest.approx(size * (0.5 + 3.0 * back) ** 2, rel=1e-3)
    np.testing.assert_allclose(losses[1:], size * 0.25)

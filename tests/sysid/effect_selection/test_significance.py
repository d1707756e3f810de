"""p-values of what blocks gain."""

import numpy as np
import pytest
from scipy.stats import binom

from sysid.effect_selection.settings import SelectionSettings
from sysid.effect_selection.significance import (
    Scores,
    family_p,
    ranks_p,
    share_better,
    worse_p,
)

_FEW = SelectionSettings(sign_flips=399)  # p-values are multiples of 1 / 400
_FAMILIES = 800


@pytest.fixture(scope="module", params=[0.0, 0.9], ids=["independent", "correlated"])
def null_p(request):
    """The least p-value of each of many families in which nothing explains anything."""
    random = np.random.default_rng(0)
    size = (_FAMILIES, 20, 12)
    common = random.standard_normal((*size[:2], 1))
    rho = request.param
    gains = np.sqrt(rho) * common + np.sqrt(1.0 - rho) * random.standard_normal(size)
    return np.array(
        [family_p(_scores(g), _FEW, seed).min() for seed, g in enumerate(gains)]
    )


def _scores(values):
    """Of candidates with a parameter each, of unit power by chance."""
    unit = values / np.linalg.norm(values, axis=0)
    return [Scores(v.sum(axis=0, keepdims=True), v[:, None]) for v in unit.T]


def test_alarms_are_as_many_as_alpha_says(null_p):
    """Where nothing is to be found, in 99 of 100 such tests."""
    for alpha in (0.02, 0.05, 0.2):
        low, high = binom.interval(0.99, _FAMILIES, alpha)
        assert low <= np.sum(null_p < alpha) <= high, alpha


def test_a_candidate_that_all_blocks_gain_by_is_significant():
    random = np.random.default_rng(0)
    gains = random.standard_normal((20, 12))
    gains[:, 7] += 2.0
    p = family_p(_scores(gains), SelectionSettings())
    assert p[7] < 0.01 and np.delete(p, 7).min() > 0.05


def test_ten_blocks_can_reject_among_many_candidates():
    """Of candidates as strong as they are useless, each has its own sign pattern."""
    random = np.random.default_rng(1)
    values = 0.3 * random.standard_normal((10, 113))
    scores = [Scores(v.sum(keepdims=True), v[:, None]) for v in values.T]
    scores[5] = Scores(np.array([10.0]), values[:, 5, None])
    p = family_p(scores, SelectionSettings())
    assert p[5] < 0.001 and np.delete(p, 5).min() > 0.01


def test_parameters_are_allowed_for():
    """Ten parameters explain as much by chance as ten times one."""
    random = np.random.default_rng(2)
    blocks = [random.standard_normal((30, m)) / np.sqrt(30.0) for m in (1, 10)]
    scores = [Scores(np.full(b.shape[1], 1.5), b) for b in blocks]
    one, ten = (family_p([s], SelectionSettings())[0] for s in scores)
    assert ten < one
    assert family_p([Scores(np.full(10, 0.5), blocks[1])], _FEW)[0] > 0.5


def test_gains_are_compared_block_by_block():
    random = np.random.default_rng(0)
    best = 10.0 ** random.uniform(-1, 2, 12)  # one block far beyond the others
    assert worse_p(best, best) == 1.0
    assert worse_p(0.9 * best, best) < 0.01
    assert worse_p(best + random.standard_normal(12), best) > 0.05


def test_blocks_that_hardly_change_have_no_vote():
    gains = np.array([1.0, 1.0, 1.0, -1.0, -1e-3, -1e-3])
    assert share_better(gains, SelectionSettings()) == 0.75


def test_a_candidate_of_few_blocks_cannot_be_more_certain_than_their_signs():
    """Of three blocks that count, one flip of signs in four gives as much by chance."""
    blocks = np.zeros((40, 1))
    blocks[:3] = 1.0
    certain = Scores(np.array([30.0]), blocks)
    bounded = Scores(np.array([30.0]), blocks, 0.25)
    assert family_p([certain], _FEW)[0] < 0.01
    assert family_p([bounded], _FEW)[0] == 0.25


def _family(random, blocks=11, useless=200):
    """Returns gains (blocks, 1 + useless): one that all blocks gain by, then noise."""
    plain = 1.0 + 0.3 * random.random((blocks, 1))
    return np.hstack([plain, 1e-4 * random.normal(size=(blocks, useless))])


def test_candidates_of_no_use_do_not_hide_what_all_blocks_gain_by():
    gains = _family(np.random.default_rng(0))
    p = ranks_p(gains, 0.01 * len(gains), _FEW)
    assert p[0] < 0.01
    assert ranks_p(gains, 0.0, _FEW)[0] > 0.05  # as they would otherwise


def test_signed_ranks_of_noise_reject_as_often_as_they_say():
    random, rejected = np.random.default_rng(2), 0
    for _ in range(200):
        shared = random.normal(size=(11, 5))
        gains = shared @ random.normal(size=(5, 40)) + random.normal(size=(11, 40))
        p = ranks_p(gains, 1.0, _FEW)
        rejected += bool((p[gains.sum(axis=0) >= 1.0] < 0.05).any())
    assert rejected <= 18  # 10 are expected; of 200 at 5 %, 19 are one in a hundred

"""Which effects are selected, and which are rivals of them."""

import numpy as np
import pytest
from scipy.signal import lfilter

from drake_disasm.effects import JointCoulombFriction, JointViscousFriction
from sysid.effect_selection.forward_selection import (
    Gain,
    Term,
    largest_t_p,
    select,
    step_of,
)
from sysid.fitting.block_grams import BlockGrams, blocks_of
from sysid.fitting.candidates import Candidate
from sysid.fitting.settings import DEFAULT_SETTINGS
from tests.sysid.effect_selection.made import FREE, linear_system, of_joint, selected

_ROWS = 480


def _columns(random, count, width=1):
    """Returns columns of so many effects, slow and fast, by candidate."""
    each = {}
    for number in range(count):
        white = random.standard_normal((_ROWS, width))
        slow = lfilter([1.0], [1.0, -0.8 * (number % 2)], white, axis=0)
        each[f"j{number}"] = slow / slow.std(axis=0)
    return each


def _names(numbers):
    return {f"JointCoulombFriction.j{number}" for number in numbers}


def test_hidden_effects_are_selected_the_greatest_first():
    random = np.random.default_rng(0)
    columns = _columns(random, 12)
    each = list(columns.values())
    r = 5.0 - 3.0 * each[3][:, 0] + 1.5 * each[8][:, 0] + random.standard_normal(_ROWS)
    found = selected(linear_system(columns, r))
    assert found.names == ("JointCoulombFriction.j3", "JointCoulombFriction.j8")
    assert all(step.rivals == () for step in found.steps)
    # Of what is left without it, with the other in.
    assert found.steps[0].chosen.share == pytest.approx(9.0 / 10.0, abs=0.03)


def test_noise_alone_selects_nothing():
    for seed in range(20):
        random = np.random.default_rng(seed)
        columns = _columns(random, 30, width=2)
        assert not selected(linear_system(columns, random.standard_normal(_ROWS))).names


def test_what_looks_like_an_effect_is_its_rival_and_the_simpler_one_is_chosen():
    random = np.random.default_rng(1)
    columns = _columns(random, 4)
    own = columns["j1"]
    columns["wide"] = np.hstack([own, own**3])
    columns["near"] = own + 0.05 * random.standard_normal(own.shape)
    r = 2.0 * own[:, 0] + random.standard_normal(_ROWS)
    found = selected(linear_system(columns, r))
    assert found.names == ("JointCoulombFriction.j1",)
    [step] = found.steps
    rivals = {name for gain in step.rivals for name in gain.term.names}
    assert rivals == {"JointCoulombFriction.wide", "JointCoulombFriction.near"}


def test_an_effect_enters_with_as_few_amplitudes_as_are_about_as_good():
    random = np.random.default_rng(2)
    columns = _columns(random, 3, width=4)
    r = columns["j2"] @ [0.0, 2.0, 0.0, 0.0] + random.standard_normal(_ROWS)
    [term] = selected(linear_system(columns, r)).terms
    assert term.names == ("JointCoulombFriction.j2",)
    assert term.columns.tolist() == [1 + 8 + 1]


@pytest.mark.parametrize(
    ("bounds", "shows"), [(FREE, True), ((0.0, 9.0), True), ((-9.0, 0.0), False)]
)
def test_an_amplitude_keeps_to_its_bounds(bounds, shows):
    random = np.random.default_rng(3)
    columns = _columns(random, 1)
    r = random.standard_normal(_ROWS) - 2.0 * columns["j0"][:, 0]
    assert (
        bool(selected(linear_system(columns, r, bounds=[FREE, bounds])).names) == shows
    )


def test_a_stand_in_for_two_effects_gives_way_to_them():
    random = np.random.default_rng(4)
    columns = _columns(random, 6)
    first, second = columns["j1"], columns["j4"]
    stand_in = first + second + 0.6 * random.standard_normal(first.shape)
    columns["both"] = stand_in / stand_in.std()
    r = 3.0 * (first + second)[:, 0] + random.standard_normal(_ROWS)
    assert set(selected(linear_system(columns, r)).names) == _names([1, 4])


def test_a_kind_at_all_joints_enters_at_once_and_without_those_that_lack_it():
    random = np.random.default_rng(5)
    A = random.standard_normal((_ROWS, 1, 9))
    A[..., 0] = 1.0
    joints = range(4)
    kinds = (JointCoulombFriction, JointViscousFriction)
    candidates = [[Candidate.of(kind(joint=f"j{i}")) for i in joints] for kind in kinds]
    terms = [
        Term((each,), np.array([1 + 4 * k + i]), np.zeros(1, np.int64))
        for k, kind in enumerate(candidates)
        for i, each in enumerate(kind)
    ]
    terms += [
        Term(tuple(each), 1 + 4 * k + np.arange(4), np.arange(4))
        for k, each in enumerate(candidates)
    ]
    r = A[:, 0] @ [0, 0, 0, 0, 0, 1.0, -1.0, 0.0, 1.0] + random.standard_normal(_ROWS)
    one = np.zeros(_ROWS, np.int64)
    grams = BlockGrams.of(
        [A],
        r[:, None],
        np.ones((_ROWS, 1)),
        blocks_of(one, 48),
        one,
        np.array([FREE] * 9),
    )
    found = select(grams, np.arange(1), terms, DEFAULT_SETTINGS)
    assert set(found.names) == {f"JointViscousFriction.j{i}" for i in (0, 1, 3)}


def test_channels_count_by_what_is_left_of_them():
    """An effect in a quiet channel is not hidden by noise in a loud one."""
    random = np.random.default_rng(6)
    A = np.zeros((_ROWS, 2, 2))
    A[:, 0, 0], A[:, 1, 1] = random.standard_normal((2, _ROWS))
    noise = random.standard_normal((_ROWS, 2)) * [100.0, 1.0]
    one = np.zeros(_ROWS, np.int64)
    grams = BlockGrams.of(
        [A],
        noise + A @ [0.0, 1.0],
        np.ones((_ROWS, 2)),
        blocks_of(one, 48),
        one,
        np.array([FREE] * 2),
    )
    terms = [
        Term((of_joint(f"j{i}"),), np.array([i]), np.zeros(1, np.int64)) for i in (0, 1)
    ]
    empty = np.array([], np.int64)
    assert select(grams, empty, terms, DEFAULT_SETTINGS).names == (
        "JointCoulombFriction.j1",
    )
    weights = np.ones(2)
    assert not select(grams, empty, terms, DEFAULT_SETTINGS, weights).names


@pytest.mark.parametrize("size", [1, 3, 30])
def test_p_values_are_uniform_where_nothing_is_to_be_found(size):
    """Of several coefficients, the largest with Bonferroni: at most as many."""
    random, nu, p = np.random.default_rng(7), 7, []
    for _ in range(400):
        x = random.standard_normal(size)
        scores = random.standard_normal((size, nu))
        p.append(largest_t_p(x, scores @ scores.T / nu, nu))
    share = np.mean(np.array(p) < 0.1)
    assert (0.06 if size == 1 else 0.0) <= share <= 0.14


def test_of_fits_that_all_lose_the_one_that_loses_least_is_the_step():
    candidate = Candidate.of(JointCoulombFriction("shoulder"))
    term = Term((candidate,), np.arange(1), np.zeros(1, dtype=int))
    one = np.ones(8)
    losing = [Gain.of(term, one, times * one) for times in (1.02, 1.3)]
    assert step_of(losing, DEFAULT_SETTINGS).chosen is losing[0]


def test_channels_in_which_nothing_is_explained_do_not_make_rivals() -> None:
    """What is left in the second channel says nothing of the first."""
    before = np.column_stack([np.full(8, 4.0), np.full(8, 10.0)])
    best, worse = before.copy(), before.copy()
    best[:, 0], worse[:, 0] = 1.0, 1.2
    term = Term(
        (Candidate.of(JointCoulombFriction("shoulder")),), *np.zeros((2, 1), int)
    )
    gain, other = (Gain.of(term, before, after) for after in (best, worse))
    assert gain.room == pytest.approx(8.0 / before.sum())
    assert not other.is_ambiguous_with(gain, DEFAULT_SETTINGS)
    gain, other = (
        Gain.of(term, before.sum(axis=1), after.sum(axis=1)) for after in (best, worse)
    )
    assert other.is_about_as_good_as(gain, DEFAULT_SETTINGS)


def test_folds_in_which_nothing_is_explained_do_not_make_rivals() -> None:
    """Half of the folds stay as they are: what the model gets wrong there."""
    before = np.array([4.0, 4.0, 4.0, 4.0, 1.0, 1.0, 1.0, 1.0])
    best, worse = before.copy(), before.copy()
    best[4:], worse[4:] = 0.1, (0.13, 0.14, 0.15, 0.8)
    term = Term(
        (Candidate.of(JointCoulombFriction("shoulder")),), *np.zeros((2, 1), int)
    )
    gain, other = (Gain.of(term, before, after) for after in (best, worse))
    assert gain.room == pytest.approx(0.4 / 20.0)
    assert other.is_ambiguous_with(gain, DEFAULT_SETTINGS)  # 4 of 8 folds
    worse[:4] = 4.01
    other = Gain.of(term, before, worse)
    assert not other.is_ambiguous_with(gain, DEFAULT_SETTINGS)
    assert other.is_about_as_good_as(
        Gain.of(term, before, worse - 1e-3), DEFAULT_SETTINGS
    )

"""The detector of shifts: against integration, and against simulated episodes."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import nct, norm
from scipy.stats import t as t_distribution

from sysid.monitoring.detector import SHIFT, WINDOW, ShiftDetector, log_bayes_factor


def detector(reference: np.ndarray) -> ShiftDetector:
    size = reference.shape[1]
    return ShiftDetector(np.full(size, 1.0 / size), np.full(size, 1e-9), reference)


def alarm_after(known: ShiftDetector, episodes, level: float) -> int | None:
    """Returns how many episodes it took."""
    for number, x in enumerate(episodes, start=1):
        known = known.added(np.atleast_1d(x))
        if known.evidence().log_total >= np.log(level):
            return number
    return None


@pytest.mark.parametrize(("n", "m", "t"), [(5, 3, 2.0), (20, 2, -4.0), (3, 8, 0.3)])
def test_the_bayes_factor_is_the_integral_over_shifts(n, m, t):
    nu, effective = n + m - 2, 1.0 / (1.0 / n + 1.0 / m)

    def _integrand(delta):
        weight = norm.pdf(delta, 0.0, SHIFT)
        return nct.pdf(t, nu, delta * np.sqrt(effective)) * weight

    wanted = quad(_integrand, -15.0, 15.0, limit=200)[0] / t_distribution.pdf(t, nu)
    difference = t / np.sqrt(effective)
    found = log_bayes_factor(*map(np.array, (n, m, difference, 1.0)))
    assert np.exp(found) == pytest.approx(wanted, rel=1e-3)


@pytest.mark.parametrize("draw", ["normal", "standard_t"])
def test_false_alarms_are_as_rare_as_stated(draw):
    random, level, runs = np.random.default_rng(0), 50.0, 60
    arguments = {"df": 4} if draw == "standard_t" else {}
    x = getattr(random, draw)(size=(10 + 120, runs), **arguments)
    known = detector(x[:10])
    rang = np.zeros(runs, dtype=bool)
    spent = 0
    for row in x[10:]:
        spent += int(np.sum(~rang))
        known = known.added(row)
        rang |= known.evidence().log_each >= np.log(level)
    assert spent / max(rang.sum(), 1) > level


def test_a_shift_is_found_soon_and_dated_and_measured():
    random = np.random.default_rng(1)
    reference = random.normal(size=(20, 1)) + 7.0
    quiet = random.normal(size=15) + 7.0
    late = random.normal(size=20) + 12.0
    known = detector(reference)
    for x in [*quiet, *late[:4]]:
        known = known.added(np.array([x]))
    assert known.evidence().log_total > np.log(1000.0)
    start = known.start(0)
    assert start == len(quiet)
    shift = known.shift(0, start)
    assert shift.age == 4
    assert shift.interval[0] < 5.0 < shift.interval[1]


def test_one_odd_episode_raises_no_alarm():
    random = np.random.default_rng(2)
    known, x = detector(random.normal(size=(20, 1))), random.normal(size=40)
    x[10] = 100.0
    assert alarm_after(known, x, 100.0) is None


def test_units_do_not_matter():
    random = np.random.default_rng(3)
    x = random.normal(size=(30, 1)) + 2.0 * (np.arange(30)[:, None] > 22)
    found = []
    for scale, offset in ((1.0, 0.0), (1e-6, 3.0)):
        known = detector(scale * x[:10] + offset)
        known = ShiftDetector(known.weights, 1e-9 * scale * np.ones(1), known.history)
        for row in x[10:]:
            known = known.added(scale * row + offset)
        found.append(known.evidence().log_total)
    assert found[0] == pytest.approx(found[1], rel=1e-6)


def test_memory_is_bounded_and_gaps_are_left_out():
    random = np.random.default_rng(4)
    known = detector(random.normal(size=(5, 2)))
    for number in range(3 * WINDOW):
        known = known.added(np.array([random.normal(), np.nan if number % 2 else 0.0]))
    assert len(known.history) == 2 * WINDOW and known.starts == WINDOW
    assert np.isfinite(known.evidence().log_total)


def test_what_no_episode_shows_is_no_evidence():
    known = detector(np.full((5, 1), np.nan))
    for _ in range(50):
        known = known.added(np.array([np.nan]))
    assert known.evidence().log_total == -np.inf


def test_without_scatter_rounding_is_no_shift():
    known = detector(np.full((5, 1), 3.0))
    assert alarm_after(known, [3.0 + 1e-12] * 30, 100.0) is None


@pytest.mark.slow
def test_correlated_episodes_raise_more_alarms_than_stated():
    """The limit that the docstring states."""
    random = np.random.default_rng(5)
    late = []
    for _ in range(30):
        x = [0.0]
        for _ in range(400):
            x.append(0.5 * x[-1] + np.sqrt(0.75) * random.normal())
        known = detector(np.array(x[1:11])[:, None])
        late.append(alarm_after(known, x[11:], 1000.0) or 400)
    assert 30 < np.mean(late) < 200

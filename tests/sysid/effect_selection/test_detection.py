"""Limits of detection: effects as large as they say are found, most of the time."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid.effect_selection.detection import (
    DetectionLimit,
    detection_limits,
    is_detectable,
)
from sysid.effect_selection.linear_account import LinearAccount
from tests.sysid.effect_selection.made import linear_system, selected

_ROWS, _NAME = 480, "JointCoulombFriction.j"
_RANGE = 10.0  # N, of the parameters: columns are by shares of it


def _drawn(seed, amplitude=0.0, noise=1.0):
    """Returns a system with so much of an effect [N], beside nine others."""
    random = np.random.default_rng(seed)
    columns = {f"k{i}": random.standard_normal((_ROWS, 1)) for i in range(9)}
    columns = {"j": 3.0 * random.standard_normal((_ROWS, 1)), **columns}
    effect = amplitude / _RANGE * columns["j"][:, 0]
    return linear_system(columns, noise * random.standard_normal(_ROWS) - effect)


def _limits(system, doubted=()):
    found = selected(system)
    account = LinearAccount.of_selection(system, found, found.names)
    return {limit.effect: limit for limit in detection_limits(account, doubted)}


@pytest.mark.parametrize(("times", "least", "most"), [(1, 0.5, 0.97), (2, 1.0, 1.0)])
def test_most_are_found_at_the_limit_and_all_at_twice_the_limit(times, least, most):
    limit = times * np.mean([_limits(_drawn(s))[_NAME].amplitude for s in range(5)])
    found = [_NAME in selected(_drawn(seed, limit)).names for seed in range(100, 150)]
    assert least <= np.mean(found) <= most


def test_limits_are_in_proportion_to_the_noise_and_none_beyond_the_bounds():
    quiet, loud = (_limits(_drawn(0, noise=noise))[_NAME] for noise in (0.1, 0.4))
    assert loud.amplitude == pytest.approx(4.0 * quiet.amplitude, rel=1e-6)
    assert quiet.unit == "N" and quiet.share == pytest.approx(quiet.amplitude / 5.0)
    deaf = _limits(_drawn(0, noise=30.0))[_NAME]
    assert deaf.amplitude is None and deaf.share > 1.0


@pytest.mark.parametrize(("times", "expected"), [(0.5, 1.0), (3.0, 3.0)])
def test_no_limit_is_below_what_was_fitted_and_not_found(times, expected):
    system = _drawn(0)
    [term] = [each for each in system.terms if each.names == (_NAME,)]
    [candidate], alone = term.candidates, _limits(system)[_NAME]
    effects = (candidate.only([alone.field]),)
    values = {f"{_NAME}.{alone.field}": -times * alone.amplitude}
    doubted = [SimpleNamespace(effects=effects, values=values)]
    found = _limits(system, doubted)[_NAME]
    assert found.amplitude == pytest.approx(expected * alone.amplitude)
    assert found.share == pytest.approx(expected * alone.share)


def test_what_the_model_itself_can_do_is_not_asked_for():
    random = np.random.default_rng(0)
    columns = {"j": np.full((_ROWS, 1), 2.0)}  # as the base has, an offset
    assert not _limits(linear_system(columns, random.standard_normal(_ROWS)))


@pytest.mark.parametrize(("seen", "shows"), [(1, False), (2, False), (3, True)])
def test_a_kind_is_detectable_if_most_of_its_shapes_are(seen, shows):
    limits = [
        DetectionLimit(
            "GroovePatch", field, 0.1 if i < seen else None, "1", 1.0, f"{i}"
        )
        for i in range(4)
        for field in ("size", "width")
    ]
    assert is_detectable(limits, "GroovePatch") == shows

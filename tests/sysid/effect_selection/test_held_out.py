"""What blocks cost that nothing was fitted to."""

import numpy as np
import pytest

from drake_disasm.effects import SensorCrossTalk, SensorDrift
from drake_disasm.logs import read_logs, write_static_wrench
from sysid.effect_selection.candidates import candidates
from sysid.effect_selection.fit import Fit
from sysid.effect_selection.fitter import Fitter
from sysid.effect_selection.held_out import contiguous_folds, held_out_loss
from sysid.effect_selection.settings import DEFAULT_SETTINGS
from sysid.models.from_logs import ModelChoice, model_of
from sysid.workers import Workers

_ROWS, _NOISE, _WEIGHT = 60, 0.05, 9.0  # readings, N and N m, N
_DRIFT = 0.01  # N per reading


@pytest.fixture(scope="module")
def fitter(tmp_path_factory) -> Fitter:
    """Of a weight in many poses, whose fz drifts."""
    random = np.random.default_rng(0)
    quaternions = random.normal(size=(_ROWS, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]
    folder = tmp_path_factory.mktemp("held_out")
    ones = np.ones((_ROWS, 6))
    bare = write_static_wrench(folder / "bare", quaternions, ones, "S", "weigh", {})
    model = model_of(read_logs([bare]), ModelChoice())
    theta = np.array([_WEIGHT / 9.81, *np.zeros(len(model.parameters) - 1)])
    wrench = model.predictions(theta) + _NOISE * random.normal(size=(_ROWS, 6))
    wrench[:, 2] += _DRIFT * np.arange(_ROWS)
    measured = model.measurements.with_values(wrench)
    measured = measured.with_noise(np.full(6, _NOISE), "stated")
    return Fitter(
        model.with_measurements(measured), Workers(), np.inf, DEFAULT_SETTINGS
    )


def _fit(fitter: Fitter, *kinds: type) -> Fit:
    return fitter.fit(tuple(candidates(fitter.base, kinds)[:1]) if kinds else ())


def test_each_block_is_predicted_by_a_fit_to_all_others(fitter):
    fit = _fit(fitter)
    linear, measured = fit.linearisation, fit.model.measurements
    folds = contiguous_folds(measured.episode, DEFAULT_SETTINGS.held_out_folds)
    expected = 0.0
    for fold in np.unique(folds):
        own = folds == fold
        others = fitter.with_base(fitter.base.of_rows(~own)).fit(())
        left = fitter.base.of_rows(own)
        error = left.predictions(others.theta) - left.measurements.values
        expected += np.sum((error / _NOISE) ** 2)
    assert held_out_loss(fit) == pytest.approx(expected, rel=1e-3)
    assert held_out_loss(fit) > np.sum(linear.residual**2)


def test_what_is_there_lowers_it_and_what_is_not_does_not(fitter):
    bare = held_out_loss(_fit(fitter))
    assert held_out_loss(_fit(fitter, SensorDrift)) < 0.9 * bare
    assert _fit(fitter, SensorCrossTalk).loss < _fit(fitter).loss
    assert held_out_loss(_fit(fitter, SensorCrossTalk)) > bare

"""What blocks cost that nothing was fitted to."""

import numpy as np
import pytest

from drake_disasm.effects import SensorCrossTalk, SensorDrift
from drake_disasm.logs import read_logs, write_static_wrench
from sysid.fitting.candidates import candidates
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import DEFAULT_SETTINGS
from sysid.models.from_logs import ModelChoice, model_of
from sysid.residuals.held_out import contiguous_folds, held_out_errors
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
    errors = held_out_errors(fit, fit, None)
    folds = contiguous_folds(fit.model.measurements.episode, 10)
    for fold in np.unique(folds):
        own = folds == fold
        others = fitter.with_base(fitter.base.of_rows(~own)).fit(())
        left = fitter.base.of_rows(own)
        predicted = left.predictions(others.theta)
        np.testing.assert_allclose(errors.before[own], predicted, atol=1e-4)


def test_what_is_there_lowers_the_held_out_loss_and_what_is_not_does_not(fitter):
    bare, drift, other = (
        _fit(fitter, *kinds) for kinds in ((), (SensorDrift,), (SensorCrossTalk,))
    )
    loss = bare.held_out_losses.sum()
    assert loss > bare.loss
    assert drift.held_out_losses.sum() < 0.9 * loss
    assert other.loss < bare.loss and other.held_out_losses.sum() > loss

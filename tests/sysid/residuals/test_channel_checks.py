"""What single channels show: against residuals that are made to show it."""

import dataclasses

import numpy as np
import pytest

from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import SelectionSettings
from sysid.models.base import LogModel
from sysid.models.measurements import Channel, Measurements
from sysid.parameters import Parameter
from sysid.residuals.channel_checks import channel_findings
from sysid.validation import null_logs
from sysid.workers import Workers

_EPISODES, _ROWS, _PERIOD = 8, 60, 0.1
_SETTINGS = SelectionSettings()


class _Ramp(LogModel):
    """Two channels that rise with time, by as much as a parameter says."""

    affine = True

    def __init__(self, residual):
        rows = _EPISODES * _ROWS
        self.time = np.tile(np.arange(_ROWS) * _PERIOD, _EPISODES)
        self.parameters = (Parameter("slope", 1.0, 0.0, 5.0, "N/s"),)
        self.measurements = Measurements(
            self.predict(np.ones(1), slice(None)) + residual,
            (Channel("fx", "N", 1.0), Channel("fy", "N", 1.0)),
            np.repeat(np.arange(_EPISODES), _ROWS),
            tuple(f"episode_{i}" for i in range(_EPISODES)),
            _PERIOD,
        )
        assert len(residual) == rows

    def predict(self, theta, rows):
        return np.column_stack([theta[0] * self.time[rows]] * 2)

    def select_rows(self, mask):
        return self.replace(time=self.time[mask])


def _white(seed=0):
    size = (_EPISODES * _ROWS, 2)
    return np.random.default_rng(seed).standard_normal(size)


def _found(residual, noise_is_stated=True, model_error=0.0):
    model = _Ramp(residual)
    error = model_error * np.ones_like(residual) if model_error else None
    measured = dataclasses.replace(model.measurements, model_error=error)
    model = model.with_measurements(measured)
    fitter = Fitter(
        model, Workers(), np.inf, _SETTINGS, noise_is_stated=noise_is_stated
    )
    return [(each.channel, each.text) for each in channel_findings(fitter.fit(()))]


def _time():
    return np.tile(np.arange(_ROWS) * _PERIOD, _EPISODES)


def test_a_sine_is_found_with_its_frequency():
    residual = _white()
    residual[:, 1] += 3.0 * np.sin(2 * np.pi * 1.3 * _time())
    (line, text), (excess, size) = _found(residual)
    assert (line, excess) == ("fy", "fy")
    assert text.startswith("periodic at 1.3 Hz")  # of frequencies 0.17 Hz apart
    assert size.startswith("2.3 times")
    assert _found(residual, noise_is_stated=False) == [(line, text)]


def test_a_model_that_states_its_own_error_may_be_off_by_as_much_in_a_pattern():
    residual, sine = 0.1 * _white(), np.sin(2 * np.pi * 1.3 * _time())
    for size, shows in ((2.0, False), (9.0, True)):
        residual[:, 1] += size * sine
        assert bool(_found(residual, model_error=2.0)) == shows


def test_outlying_rows_are_counted_and_placed():
    residual = _white()
    residual[[130, 131, 150], 1] += 30.0
    text = "3 outlying rows in episode_2 (row 130, 131, 150)"
    assert ("fy", text) in _found(residual)


@pytest.mark.parametrize(
    "noise", [null_logs.heavy_tailed, null_logs.autoregressive(0.9)]
)
def test_noise_alone_shows_nothing(noise):
    shape = np.ones((_EPISODES * _ROWS, 2))
    drawn = [noise(np.random.default_rng(seed), shape) for seed in range(30)]
    found = [_found(residual) for residual in drawn]
    assert sum(bool(each) for each in found) <= 1, found


def test_more_than_the_stated_noise_is_said_only_of_its_channel():
    residual = _white()
    residual[:, 0] *= 2.0
    assert _found(residual) == [("fx", "1.9 times its noise, of unknown origin")]

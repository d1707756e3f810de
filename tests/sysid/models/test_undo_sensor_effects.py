"""Recorded episodes: effects on the sensor are undone."""

import numpy as np
import pytest

from drake_disasm.cell.tool import Tool
from drake_disasm.effects import (
    Effect,
    SensorDeadBand,
    SensorGainDrift,
    SensorMounting,
    SensorSaturation,
)
from drake_disasm.scenario import load_scenario
from sysid.models.sensor_reading import SensorReading
from sysid.models.undo_sensor_effects import undone

_SCENARIO = load_scenario("removal")
_READING = SensorReading(_SCENARIO, Tool.from_models(_SCENARIO), "cell")
_TIMES = np.arange(40.0)


def _read(effect: Effect, wrench: np.ndarray) -> np.ndarray:
    """Returns how wrenches are read, once a second at A."""
    states = np.hstack([np.zeros_like(wrench), wrench])
    return _READING.read([effect], states, _READING.at_rest, _TIMES)[:, 6:]


def _read_all(effect: Effect, wrenches: np.ndarray) -> np.ndarray:
    """Returns how some such records (k, n, 6) are read."""
    return np.stack([_read(effect, wrench) for wrench in wrenches])


def _wrenches() -> np.ndarray:
    random = np.random.default_rng(5)
    return random.normal(0.0, [4, 4, 4, 0.5, 0.5, 0.5], (len(_TIMES), 6))


@pytest.mark.parametrize(
    "effect",
    [
        SensorGainDrift(fx=0.1, fz=0.06),  # fivefold at last
        SensorMounting(rx=0.4, rz=-0.3),
    ],
    ids=lambda effect: type(effect).__name__,
)
def test_what_was_read_is_undone(effect):
    wrench = _wrenches()
    found = undone(lambda w: _read_all(effect, w), _read(effect, wrench))
    np.testing.assert_allclose(found, wrench, atol=1e-6)


def test_what_a_dead_band_hides_stays_small():
    wrench, effect = _wrenches(), SensorDeadBand(force=1.0, width=2.0)
    found = undone(lambda w: _read_all(effect, w), _read(effect, wrench))
    wide = np.abs(wrench) > 4.0
    np.testing.assert_allclose(found[wide], wrench[wide], atol=0.01)
    assert np.abs(found - wrench).max() < 2.0


def test_a_saturated_channel_is_left_as_it_is_read():
    wrench, effect = _wrenches(), SensorSaturation(share=1.0, limit=3.0)
    read = _read(effect, wrench)
    found = undone(lambda w: _read_all(effect, w), read)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(_read(effect, found), read, atol=1e-2)

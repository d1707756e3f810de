"""Effects on the sensor's reading that come late, are small, or set in."""

import numpy as np
import pytest

from drake_disasm import effects as ef
from drake_disasm.devices.sensor_chain import BETWEEN, sensed_along, sensed_sample

G_W = np.array([0.0, 0.0, -9.81])
WRENCH = np.array([1.0, -0.2, 3.0, 0.04, -0.005, 0.1])
_PERIOD = 0.1  # s


def _at(*times: float, mass: float = 0.0) -> ef.Sensing:
    R_WS = np.broadcast_to(np.eye(3), (len(times), 3, 3))
    return ef.Sensing(np.array(times), R_WS, G_W, mass)


def test_a_gain_drifts_from_zero_on_and_a_step_stays() -> None:
    effect = ef.SensorGainDrift(fx=0.01, tz=-0.02)
    read = effect.apply(np.tile(WRENCH, (2, 1)), _at(0.0, 5.0))
    np.testing.assert_array_equal(read[0], WRENCH)
    np.testing.assert_allclose(read[1], WRENCH * [1.05, 1, 1, 1, 1, 0.9])
    effect = ef.SensorStep(fy=-2.0, tx=0.1, onset=9.5, rise=1.0)
    read = effect.apply(np.zeros((5, 6)), _at(0.0, 9.4, 10.0, 10.6, 1e4))
    np.testing.assert_allclose(read[:, 1], [0, 0, -1, -2, -2])
    np.testing.assert_allclose(read[:, 3], [0, 0, 0.05, 0.1, 0.1])


@pytest.mark.parametrize(
    ("beyond", "expected"),
    [(0.0, [1.0, 0.0, 3.0, 0.04, 0.0, 0.1]),
     (1.0, [0.5, 0.0, 2.5, 0.015, 0.0, 0.075])],
)  # fmt: skip
def test_a_band_reads_zero_and_beyond_it_all_or_less(
    beyond: float, expected: list[float]
) -> None:
    """Half width 0.5 N, and 0.025 N m."""
    effect = ef.SensorDeadBand(force=1.0, torque=1.0, width=0.5, beyond=beyond)
    read = effect.apply(WRENCH, _at(0.0))
    np.testing.assert_allclose(read[0], expected, atol=2e-4)


def test_a_band_is_about_the_weight_of_the_payload() -> None:
    effect = ef.SensorDeadBand(force=1.0, torque=1.0, width=0.5)
    weight = np.array([0.0, 0.0, -9.81, 0.0, 0.0, 0.0])
    small = np.array([0.3, -0.3, 0.3, 0.0, 0.0, 0.0])
    read = effect.apply(weight + small, _at(0.0, mass=1.0))
    np.testing.assert_allclose(read[0], weight, atol=2e-4)


def _loads(steps: int) -> np.ndarray:
    return np.random.default_rng(0).standard_normal((steps, 6))


def _along(effect: ef.SensorEffect, loads: np.ndarray) -> np.ndarray:
    times = _PERIOD * np.arange(1.0, len(loads) + 1.0)
    return sensed_along(loads, [effect], _at(*times), np.zeros(6), _at(0.0))


@pytest.mark.parametrize("steps", [1, 3])
def test_a_delay_by_whole_samples_shifts_rows(steps: int) -> None:
    loads = _loads(8)
    read = _along(ef.SensorDelay(1.0, steps * _PERIOD), loads)
    np.testing.assert_allclose(read[steps:], loads[:-steps], atol=1e-9)
    np.testing.assert_allclose(read[: steps - 1], 0.0, atol=1e-9)


@pytest.mark.parametrize("delay", [0.004, 0.0999])
def test_a_delay_of_less_is_on_the_line_between_two_samples(delay: float) -> None:
    """No first-order lag: what was before the sample before does not show."""
    loads, share = _loads(8), delay / _PERIOD
    read = _along(ef.SensorDelay(1.0, delay), loads)
    expected = (1.0 - share) * loads[1:] + share * loads[:-1]
    np.testing.assert_allclose(read[1:], expected, atol=1e-9)


@pytest.mark.parametrize("effect", [ef.SensorDelay(0.8, 0.07), ef.SensorLag(0.8, 0.2)])
def test_an_episode_at_once_is_read_as_sample_by_sample(
    effect: ef.SensorMemoryEffect, monkeypatch: pytest.MonkeyPatch
) -> None:
    loads, steps = _loads(60), np.r_[1:41, 1:21]
    between = np.random.default_rng(1).standard_normal((60, BETWEEN, 6))
    sensing, rest = _at(*(_PERIOD * steps)), _at(0.0)
    given = loads, [effect], sensing, np.zeros(6), rest, between
    at_once = sensed_along(*given)
    monkeypatch.setattr(type(effect), "along", lambda *_: None)
    np.testing.assert_allclose(at_once, sensed_along(*given), atol=1e-9)


def test_a_late_sensor_reads_what_was_between_two_loads() -> None:
    """Where loads are off the line by as much on the way, and a delay ends there."""
    between = np.zeros((8, BETWEEN, 6))
    between[:, BETWEEN // 2] = 1.0
    times = _at(*(_PERIOD * np.arange(1.0, 9.0)))
    effect = ef.SensorDelay(1.0, _PERIOD / 2.0)
    given = _loads(8), [effect], times, np.zeros(6), _at(0.0)
    change = sensed_along(*given, between) - sensed_along(*given)
    np.testing.assert_allclose(change, 1.0, atol=1e-9)


@pytest.mark.parametrize("interval", [0.002, 0.025])
def test_a_sensor_of_any_rate_delays_a_ramp_exactly(interval: float) -> None:
    effect, memory = ef.SensorDelay(1.0, 0.25), np.full(512, np.nan)
    for k in range(round(1.0 / interval) + 1):
        load = np.full(6, k * interval)
        gap = interval if k else 0.0
        read, memory = sensed_sample(load, [effect], _at(0.0), memory, gap)
    np.testing.assert_allclose(read, 0.75, atol=1e-9)
    again, _ = sensed_sample(load, [effect], _at(0.0), memory, 0.0)
    np.testing.assert_array_equal(again, read)

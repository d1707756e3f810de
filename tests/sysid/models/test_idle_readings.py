"""Readings without a load: what is the sensor's own moves no bolt."""

import numpy as np
import pytest

from sysid.models.idle_readings import IdleReadings

_NOISE = np.array([0.05, 0.05, 0.1, 0.005, 0.005, 0.005])
_LEVER = np.array([0.0, 0.0, 0.2])  # m
_STEPS, _TOUCHES = 60, 30
_TIME = np.arange(_STEPS + 1) * 0.1


def _readings(offset: np.ndarray, seed: int = 1) -> list[np.ndarray]:
    """Returns four episodes that touch at a step; a force acts on the bolt's head."""
    random = np.random.default_rng(seed)
    found = []
    for _ in range(4):
        force = np.zeros((_STEPS + 1, 3))
        force[_TOUCHES:] = [6.0, 0.0, 1.0]
        load = np.hstack([force, np.cross(_LEVER, force)])
        found.append(load + offset + random.normal(0.0, _NOISE, load.shape))
    return found


def _warmed(size: float) -> np.ndarray:
    """Returns an offset (steps + 1, 6) of the torque about y that sets in."""
    found = np.zeros((_STEPS + 1, 6))
    found[:, 4] = size * -np.expm1(-_TIME)
    return found


def test_a_torque_that_sets_in_is_the_sensors_until_the_bolt_touches():
    readings, real = _readings(_warmed(0.2)), _warmed(0.2)
    offsets = IdleReadings.of(readings, _NOISE, _LEVER).offsets(readings)
    idle = slice(5, _TOUCHES - 2)
    np.testing.assert_allclose(offsets[idle, 4], real[idle, 4], atol=0.015)
    np.testing.assert_allclose(offsets[_TOUCHES + 2 :, 4], real[_TOUCHES, 4], atol=0.02)
    np.testing.assert_allclose(offsets[:, [0, 1, 2, 3, 5]], 0.0, atol=1e-12)


def test_an_offset_from_the_start_is_taken_off_throughout():
    bias = np.array([2.0, 0.0, 0.0, 0.0, 0.1, 0.0])
    readings = _readings(bias)
    offsets = IdleReadings.of(readings, _NOISE, _LEVER).offsets(readings)
    np.testing.assert_allclose(offsets[:, 0], 2.0, atol=0.1)
    np.testing.assert_allclose(offsets[:, 4], 0.1, atol=0.01)


@pytest.mark.parametrize("undone", [0.1, 0.3])
def test_what_moves_the_bolt_does_not_depend_on_what_is_undone(undone):
    """An offset that an effect has taken off, or too much of it, is none any more."""
    readings = _readings(_warmed(0.2))
    idle = IdleReadings.of(readings, _NOISE, _LEVER)
    raw = readings[0] - idle.offsets(readings)
    others = [each - _warmed(undone) for each in readings]
    free = slice(0, _TOUCHES - 2)
    load = (others[0] - idle.offsets(others))[free]
    np.testing.assert_allclose(load, raw[free], atol=0.03)


def test_neither_noise_nor_a_couple_while_the_bolt_touches_is_an_offset():
    readings = _readings(np.zeros(6))
    offsets = IdleReadings.of(readings, _NOISE, _LEVER).offsets(readings)
    np.testing.assert_allclose(offsets, 0.0, atol=1e-12)
    for each in readings:
        each[_TOUCHES:, 4] += 0.5
    offsets = IdleReadings.of(readings, _NOISE, _LEVER).offsets(readings)
    np.testing.assert_allclose(offsets, 0.0, atol=1e-12)


def test_the_moment_of_a_force_that_may_be_none_is_no_offset():
    """Just below the noise, on the head: its moment is that of its lever."""
    random, force = np.random.default_rng(3), np.array([0.1, 0.0, 0.0])
    load = np.concatenate([force, np.cross(_LEVER, force)])
    readings = [random.normal(0.0, _NOISE, (60, 6)) for _ in range(4)]
    for each in readings:
        each[1:] += load
    offsets = IdleReadings.of(readings, _NOISE, _LEVER).offsets(readings)
    np.testing.assert_allclose(offsets[:, 3:], 0.0, atol=1e-12)

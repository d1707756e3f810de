"""Logs that carry an effect nobody declared; simulated, and called that.

A generator draws magnitude and seed for an effect and writes a log without a trace of
what it did: a verdict has nothing but the log to go by.
"""

import copy
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from drake_disasm.effects import Effect, SensorBias, SensorEffect, amplitudes
from drake_disasm.effects.sensor.payload_error import PayloadError
from drake_disasm.logs import Log, read_log, write_static_wrench
from drake_disasm.scenario import Scenario
from sysid.effect_selection.close_loop import ClosedLoop, close_loop
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.static_wrench import StaticWrenchModel

FORCE_NOISE, TORQUE_NOISE = 0.05, 0.002  # N, N m
READINGS = 100
_PAYLOAD = PayloadError(mass=1.2, cx=0.01, cy=-0.02, cz=0.06)
_BIAS = SensorBias(fx=1.0, fy=-2.0, fz=3.0, tx=0.1, ty=-0.2, tz=0.05)


def static_log(
    folder: Path,
    kinds: Sequence[type[SensorEffect]],
    level: float,
    seed: int,
    correlation: float = 0.0,
    shape: Mapping[str, float] | None = None,
) -> Log:
    """Writes readings at rest with effects of a kind each, and reads them.

    Args:
        folder: of the log.
        kinds: effects; none for a null log.
        level: rms of what an effect leaves unexplained, in units of the noise.
        seed: of everything that is drawn.
        correlation: of the noise from one reading to the next.
        shape: parameters of the effects' shapes, by name.
    """
    random = np.random.default_rng(seed)
    R_WS = Rotation.random(READINGS, random_state=seed).as_quat()[:, [3, 0, 1, 2]]
    clean = _readings(folder / "clean", R_WS, [])
    shaped = [kind(**(shape or {})) for kind in kinds]
    effects = [_drawn(e, random, folder, R_WS, clean, level) for e in shaped]
    reading = _readings(folder / "with", R_WS, effects)
    noise = np.array([FORCE_NOISE] * 3 + [TORQUE_NOISE] * 3)
    reading = reading + noise * _correlated(random, READINGS, correlation)
    write_static_wrench(folder / "log", R_WS, reading, "S", "weigh", {})
    return read_log(folder / "log")


def _correlated(random: np.random.Generator, rows: int, rho: float) -> np.ndarray:
    """Returns noise of unit variance (rows, 6), correlated from row to row."""
    white = random.standard_normal((rows, 6))
    white[1:] *= np.sqrt(1.0 - rho**2)
    return np.asarray(lfilter([1.0], [1.0, -rho], white, axis=0))


def closed(log: Log, library: Sequence[type[Effect]] | None = None) -> ClosedLoop:
    """Returns all that closing the loop finds in a log."""
    return close_loop(model_of([log], ModelChoice()), library=library)


def _readings(folder: Path, R_WS: np.ndarray, effects: list[Effect]) -> np.ndarray:
    """Returns noise-free readings (n, 6) of the payload through effects."""
    write_static_wrench(folder, R_WS, np.zeros((len(R_WS), 6)), "S", "weigh", {})
    scenario = Scenario()
    scenario.effects = [copy.deepcopy(_PAYLOAD), copy.deepcopy(_BIAS), *effects]
    model = StaticWrenchModel([read_log(folder)], scenario, ())
    return model.predict(np.zeros(0), slice(0, len(R_WS)))


def _drawn(
    effect: SensorEffect,
    random: np.random.Generator,
    folder: Path,
    R_WS: np.ndarray,
    clean: np.ndarray,
    level: float,
) -> Effect:
    """Returns an effect with amplitudes that leave as much unexplained as wanted."""
    kind = type(effect)
    fields = amplitudes(kind)
    chosen = random.choice(fields, size=min(2, len(fields)), replace=False)
    directions = random.choice([-1.0, 1.0], len(chosen)) * random.uniform(0.5, 1, 2)
    units = {"f": FORCE_NOISE, "t": TORQUE_NOISE}
    for field, direction in zip(chosen, directions, strict=False):
        setattr(effect, field, 1e-3 * direction * units.get(field[0], 0.01))
    change = _readings(folder / f"unit_{kind.__name__}", R_WS, [effect]) - clean
    scale = level / _unexplained(change, R_WS)
    for field in chosen:
        setattr(effect, field, float(scale * getattr(effect, field)))
    return effect


def _unexplained(change: np.ndarray, R_WS: np.ndarray) -> float:
    """Returns the rms in units of the noise that payload and bias can't take up."""
    R = Rotation.from_quat(R_WS[:, [1, 2, 3, 0]])
    g_S = R.inv().apply([0.0, 0.0, -9.81])
    eye = np.tile(np.eye(3), (len(R_WS), 1))
    force = np.hstack([g_S.reshape(-1, 1), eye])
    cross = np.cross(np.eye(3)[None], g_S[:, None]).swapaxes(1, 2).reshape(-1, 3)
    torque = np.hstack([cross, eye])
    left = [
        (y.ravel() - A @ np.linalg.lstsq(A, y.ravel(), rcond=None)[0]) / noise
        for A, y, noise in (
            (force, change[:, :3], FORCE_NOISE),
            (torque, change[:, 3:], TORQUE_NOISE),
        )
    ]
    return float(np.sqrt(np.mean(np.square(left))))

"""Noise of simulated logs: white, slow, heavy-tailed, and like a real residual."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from real_data import data_folder
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from drake_disasm.common.errors import DisasmError

Array = NDArray[np.float64]

#: Noise, half of which are torques that no library has; see `simulated.unmodelled`.
UNMODELLED = "unmodelled"
NOISES = ("white", "ar0.9", "ar0.98", "t3", "residual")

_FORGETS = 1000  # rows, after which a process knows nothing of its first row
_SIEVE_ORDER = 30  # of the autoregression that stands for a real residual
_EVERY = 2  # rows of a recording at 200 Hz, for a log at 100 Hz


def drawn_noise(
    kind: str, random: np.random.Generator, rows: int, channels: int
) -> Array:
    """Returns noise (rows, channels) of about unit variance.

    Args:
        kind: one of NOISES; "ar0.9" is correlated by 0.9 from row to row.
        random: draws.
        rows, channels: the shape.

    Raises:
        DisasmError: the kind is unknown, or the real residual's data are missing.
    """
    if kind == "white":
        return random.standard_normal((rows, channels))
    if kind == "t3":
        return random.standard_t(3, (rows, channels)) / np.sqrt(3.0)
    if kind == "residual":
        return _sieve(random, rows, channels)
    if kind.startswith("ar"):
        rho = float(kind.removeprefix("ar"))
        size = (rows + _FORGETS, channels)
        white = np.sqrt(1.0 - rho**2) * random.standard_normal(size)
        return np.asarray(lfilter([1.0], [1.0, -rho], white, axis=0)[_FORGETS:])
    raise DisasmError(f"noise '{kind}': unknown; take one of {', '.join(NOISES)}")


def _sieve(random: np.random.Generator, rows: int, channels: int) -> Array:
    """Returns noise like the residual of a real arm: an autoregressive sieve.

    Innovations are drawn with replacement row by row, so that channels stay
    correlated, and go through the model that whitened them (Bühlmann 1997).
    """
    residual = _real_residual()[:, np.arange(channels) % 7]
    models = [_autoregression(column) for column in residual.T]
    white = np.column_stack(
        [
            lfilter(a, [1.0], column)
            for a, column in zip(models, residual.T, strict=True)
        ]
    )[_SIEVE_ORDER:]
    drawn = white[random.integers(0, len(white), rows + _FORGETS)]
    noise = np.column_stack(
        [lfilter([1.0], a, column) for a, column in zip(models, drawn.T, strict=True)]
    )[_FORGETS:]
    return np.asarray(noise / np.sqrt(np.mean(residual**2, axis=0)))


def _autoregression(series: Array) -> Array:
    """Returns the whitening polynomial [1, -a_1, ...], by Yule and Walker."""
    covariance = np.correlate(series, series, "full")[len(series) - 1 :]
    lags = covariance[: _SIEVE_ORDER + 1] / len(series)
    return np.append(1.0, -solve_toeplitz(lags[:-1], lags[1:]))


def _real_residual() -> Array:
    """Returns what a smooth account leaves of a real arm's torques (n, 7), at 100 Hz.

    Of `kuka_lwr4`: least squares on sines and cosines of the joints' angles, their
    products with a neighbour's, accelerations, and dry and viscous friction, which
    stand for rigid bodies and friction without a model of either.
    """
    path: Path = data_folder("kuka_lwr4") / "recording_1.npz"
    data = np.load(path)
    q, v, vd = (data[k] for k in ("positions", "velocities", "accelerations"))
    # The horizontal joint angles' sums turn the links; pairs of joints suffice.
    waves = np.hstack([np.sin(q), np.cos(q)])
    pairs = np.hstack([waves[:, i : i + 1] * waves for i in range(14)])
    inertia = np.hstack([vd, *(vd * np.cos(q[:, i : i + 1]) for i in range(7))])
    friction = np.hstack([v, np.tanh(v / 0.02), np.ones((len(q), 1))])
    columns = np.hstack([waves, pairs, inertia, friction])
    tau = data["torques"]
    left = tau - columns @ np.linalg.lstsq(columns, tau, rcond=None)[0]
    return np.asarray(left[::_EVERY])

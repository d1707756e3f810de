"""Noise of simulated logs: white, slow, heavy-tailed, and like a real residual."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from real_data import data_folder

from drake_disasm.common.errors import DisasmError
from sysid.validation.null_logs import autoregressive, heavy_tailed, sieve, white

Array = NDArray[np.float64]

#: Noise, half of which are torques that no library has; see `simulated.unmodelled`.
UNMODELLED = "unmodelled"
NOISES = ("white", "ar0.9", "ar0.98", "t3", "residual")

_KINDS = {"white": white, "t3": heavy_tailed}
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
    if kind == "residual":
        noise = sieve(_real_residual()[:, np.arange(channels) % 7])
    elif kind in _KINDS:
        noise = _KINDS[kind]
    elif kind.startswith("ar"):
        noise = autoregressive(float(kind.removeprefix("ar")))
    else:
        raise DisasmError(f"noise '{kind}': unknown; take one of {', '.join(NOISES)}")
    return noise(random, np.zeros((rows, channels)))


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

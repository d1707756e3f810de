"""Readings of a force/torque sensor, a log each day, and their closed loop."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from drake_disasm.common.files import make_folder, write_json
from drake_disasm.logs import read_logs, write_static_wrench
from sysid.effect_selection.close_loop import close_loop
from sysid.models.from_logs import ModelChoice, model_of
from sysid.monitoring.reference import KEY, Reference


def write_day(
    folder: Path, seed: int, bias: float = 0.0, rows: int = 24, noise: float = 0.02
) -> Path:
    """Writes readings of 1.2 kg at rest, with more bias of fx; returns the folder.

    Args:
        folder: of the log.
        seed: of orientations and noise.
        bias: [N].
        rows: of the log.
        noise: [N].
    """
    R = Rotation.random(rows, random_state=seed)
    g_S = R.inv().apply([0.0, 0.0, -9.81])
    wrench = np.hstack([1.2 * g_S, np.cross([0, 0, 0.06], g_S)])
    wrench += [1.0 + bias, 2, 3, 0, 0.1, 0]
    random = np.random.default_rng(seed)
    wrench += noise * random.normal(size=wrench.shape) * [1, 1, 1, 0.1, 0.1, 0.1]
    quaternions = R.as_quat()[:, [3, 0, 1, 2]]
    return write_static_wrench(folder, quaternions, wrench, "S", "w", {})


def write_reference(folder: Path, days: int = 4) -> Path:
    """Writes logs of some days and the output of their closed loop; returns that."""
    logs = read_logs([write_day(folder / f"known_{n}", 100 + n) for n in range(days)])
    choice = ModelChoice(fixed=True)
    closed = close_loop(model_of(logs, choice), test=())
    known = Reference.of(closed, logs, choice)
    make_folder(folder / "closed")
    write_json(folder / "closed" / "result.json", {KEY: known.to_mapping()})
    return folder / "closed"

"""Static readings of a force/torque sensor: from arrays, and in the sensor's frame."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_disasm.logs.columns import flat_columns
from drake_disasm.logs.header import LogHeader
from drake_disasm.logs.reader import Episode
from drake_disasm.logs.schema import STATIC_WRENCH
from drake_disasm.logs.writer import LogWriter


def write_static_wrench(
    folder: str | Path,
    R_WS: ArrayLike,
    wrench: ArrayLike,
    frame: str,
    task: str,
    provenance: Mapping[str, Any],
    time: ArrayLike | None = None,
    file_format: str = "parquet",
) -> Path:
    """Writes a log of static readings from arrays, as one episode.

    Args:
        folder: an empty folder, or one to be made.
        R_WS: `(rows, 4)`, orientation of the sensor S in the world W (z up) as unit
            quaternions [qw, qx, qy, qz].
        wrench: `(rows, 6)`, [fx, fy, fz, tx, ty, tz], N and N·m: wrench that the
            load exerts on the sensor at So, expressed in `frame`.
        frame: "S" or "W".
        task: name of the task.
        provenance: where the readings are from.
        time: `(rows,)`, s; without it the order of the rows is written.
        file_format: "parquet" or "csv".

    Returns:
        The folder.

    Raises:
        DisasmError: the arrays break the format, or the folder is not empty.
    """
    header = LogHeader("static_wrench", task, provenance, frames={"wrench": frame})
    order = np.arange(len(np.asarray(wrench)), dtype=float)
    clock = {"order": order} if time is None else {"time": time}
    columns = flat_columns(
        STATIC_WRENCH.name, {**clock, "R_WS": R_WS, "wrench": wrench}
    )
    with LogWriter(folder, header, file_format) as writer:
        writer.write_episode(columns)
    return writer.folder


def sensor_wrench(header: LogHeader, episode: Episode) -> NDArray[np.float64]:
    """The wrench at So in the sensor's frame S, whatever frame the log states.

    Returns:
        `(rows, 6)`, [fx, fy, fz, tx, ty, tz], N and N·m.
    """
    wrench: NDArray[np.float64] = episode["wrench"]
    if header.frames["wrench"] == "S":
        return wrench
    vectors_W = wrench.reshape(-1, 2, 3)
    vectors_S: NDArray[np.float64] = np.einsum(
        "nij,nki->nkj", rotation_matrices(episode["R_WS"]), vectors_W
    )
    return vectors_S.reshape(-1, 6)


def rotation_matrices(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation matrices `(n, 3, 3)` of quaternions `(n, 4)`, [qw, qx, qy, qz].

    The quaternions are normalised first, as a log's may be rounded.
    """
    w, x, y, z = (quaternions / np.linalg.norm(quaternions, axis=1)[:, None]).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)

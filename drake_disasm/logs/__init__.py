"""Measured logs: a folder with `log.yaml` and one table per episode.

The format is described in `docs/reference/log-format.md`, so that anybody can write a
log without this code; `drake_disasm.logs.schema` declares it as data. In short::

    with LogWriter(folder, LogHeader("joint_motion", ...)) as writer:
        writer.write_episode(flat_columns("joint_motion", {"time": t, "q": q}))
    log = read_log(folder)
    q = log.episodes[0]["q"]  # (rows, joints), rad

Bad input raises `drake_disasm.common.errors.DisasmError`: one line that names the file,
the column or key, and the remedy.
"""

from drake_disasm.logs.columns import flat_columns
from drake_disasm.logs.header import LogHeader
from drake_disasm.logs.open_episode import OpenEpisode
from drake_disasm.logs.reader import Episode, Log, read_log, read_logs
from drake_disasm.logs.schema import KINDS, SCHEMA, SI_UNITS
from drake_disasm.logs.static_wrench import (
    rotation_matrices,
    sensor_wrench,
    write_static_wrench,
)
from drake_disasm.logs.writer import LogWriter

__all__ = [
    "KINDS",
    "SCHEMA",
    "SI_UNITS",
    "Episode",
    "Log",
    "LogHeader",
    "LogWriter",
    "OpenEpisode",
    "flat_columns",
    "read_log",
    "read_logs",
    "rotation_matrices",
    "sensor_wrench",
    "write_static_wrench",
]

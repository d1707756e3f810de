"""Recordings of other programs, made into logs of ours.

::

    source = read_source(Path("run.mcap"))
    fields = guessed_map(source, "joint_motion", Known(joints, urdf="arm.urdf"))
    imported = import_recordings([source], fields, ImportProcessing())
    write_log(imported, [source], fields, Path("out/log"), {})
"""

from drake_disasm.logs.importing.field_map import FieldMap, read_map
from drake_disasm.logs.importing.guess import (
    Known,
    NoGuessError,
    guessed_map,
    map_to_fill_in,
)
from drake_disasm.logs.importing.importer import Imported, import_recordings, write_log
from drake_disasm.logs.importing.processing import ImportProcessing
from drake_disasm.logs.importing.source import Source, read_source

__all__ = [
    "FieldMap",
    "ImportProcessing",
    "Imported",
    "Known",
    "NoGuessError",
    "Source",
    "guessed_map",
    "import_recordings",
    "map_to_fill_in",
    "read_map",
    "read_source",
    "write_log",
]

"""Writes recordings as a log, with what was done to them in its provenance."""

import collections
import dataclasses
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.resources import ONE_JOINT_MODELS
from drake_disasm.logs import LogHeader, LogWriter, flat_columns
from drake_disasm.logs.importing.field_map import FieldMap, quantity_of
from drake_disasm.logs.importing.orientations import JOINTS, normalised
from drake_disasm.logs.importing.processing import (
    Done,
    ImportProcessing,
    Processed,
    process,
)
from drake_disasm.logs.importing.recording import Recording, check_share, recordings_of
from drake_disasm.logs.importing.signals import LowPass, clock_of
from drake_disasm.logs.importing.source import Source
from drake_disasm.logs.importing.units import UNITS
from drake_disasm.logs.importing.usage import check_torques
from drake_disasm.logs.schema import KINDS, Form, Rule

Array = NDArray[np.float64]

_MADE = ("time", "v", "vd")  # by `recording` and `processing`
_SHORT = "between gaps that are too near"  # why rows are left out
_FILTER = "zero-phase FIR low-pass, sinc with Blackman window"


@dataclasses.dataclass(frozen=True)
class Imported:
    """What a log is to hold.

    Attributes:
        recordings: as recorded.
        episodes: columns of each.
        period: of the rows [s], or None.
        done: signal processing, of joint motion; None of other kinds.
        spans: the recording of each episode, with the times of its first and last row.
    """

    recordings: tuple[Recording, ...]
    episodes: tuple[dict[str, Array], ...]
    period: float | None
    done: Done | None
    spans: tuple[tuple[Recording, float, float], ...] = ()

    @property
    def dropped(self) -> dict[str, int]:
        """How many rows of all recordings were left out, by the reason."""
        found = collections.Counter[str]()
        for each in self.recordings:
            found.update(each.dropped)
        if self.done and self.done.short:
            found[_SHORT] = self.done.short
        return dict(found)

    @property
    def held(self) -> dict[str, dict[str, list[list[Any]]]]:
        """Where channels repeat a value, as plain data: see `repeats.held_of`."""
        smeared = 0.5 / self.done.cutoff if self.done else 0.0
        found = {}
        for number, (each, first, last) in enumerate(self.spans):
            parts = {
                name: [part.within(first, last, smeared) for part in held]
                for name, held in each.held.items()
            }
            found[f"episode_{number:04d}"] = {
                name: [list(dataclasses.astuple(h)) for h in held if h]
                for name, held in sorted(parts.items())
                if any(held)
            }
        return {name: parts for name, parts in found.items() if parts}

    @property
    def rows(self) -> int:
        """Of all episodes."""
        return sum(len(next(iter(each.values()))) for each in self.episodes)


def import_recordings(
    sources: Sequence[Source],
    fields: FieldMap,
    processing: ImportProcessing,
    shifts: bool = True,
    accept: bool = False,
    even: bool = True,
) -> Imported:
    """Returns recordings as episodes of a log.

    Args:
        sources: each gives one episode or more.
        fields: what is what in all of them.
        processing: of joint motion; rows of other kinds are taken as they are.
        shifts: whether to take away shifts between streams of a bag.
        accept: whether torques, or more than a tenth of the rows, may be left out.
        even: whether stamps of arrival are made even.

    Raises:
        DisasmError: the map does not fit them, or nothing is left.
    """
    _check_needed(fields)
    for source in () if accept else sources:
        check_torques(source, fields)
    found = [
        each.between(*processing.between)
        for source in sources
        for each in recordings_of(source, fields, shifts, accept, even)
    ]
    if fields.kind != "joint_motion":
        episodes = tuple(
            _as_recorded(each, fields.kind, fields.is_order) for each in found
        )
        period = (
            clock_of(found[0].time).period if fields.kind == "transitions" else None
        )
        spans = tuple(_span(each, each.time) for each in found)
        return Imported(tuple(found), episodes, period, None, spans)
    parts, done = process(found, processing)
    rows = sum(len(each.time) for each in found)
    check_share(found[0].name, {_SHORT: done.short}, rows, accept)
    period = float(np.median(np.diff(parts[0].columns["time"])))
    episodes = tuple(_from_its_begin(part) for part in parts)
    spans = tuple(_span(part.recording, part.columns["time"]) for part in parts)
    return Imported(tuple(found), episodes, period, done, spans)


def _span(recording: Recording, time: Array) -> tuple[Recording, float, float]:
    return recording, float(time[0]), float(time[-1])


def _check_needed(fields: FieldMap) -> None:
    """Refuses a map without what the kind needs and nothing else can tell."""
    for quantity in KINDS[fields.kind].quantities:
        name = quantity.name
        if quantity.required and name not in (*fields.columns, *_MADE):
            raise DisasmError(
                f"map: a {fields.kind} log needs {name}; say which channels it is in"
            )


def _as_recorded(recording: Recording, kind: str, is_order: bool) -> dict[str, Array]:
    clock = {"time": recording.time - recording.time[0]}
    if is_order:
        clock = {"order": recording.time}
    # Those of another stream are interpolated.
    columns = clock | {
        name: normalised(values) if quantity_of(kind, name).is_rotation else values
        for name, values in recording.columns.items()
    }
    return _unstacked(columns, kind)


def _from_its_begin(part: Processed) -> dict[str, Array]:
    time = part.columns["time"]
    return _unstacked(part.columns | {"time": time - time[0]}, "joint_motion")


def _unstacked(columns: Mapping[str, Array], kind: str) -> dict[str, Array]:
    """Returns scalars as (n,), vectors as (n, k)."""
    scalar = (Form.SCALAR, Form.TERMS)
    return {
        name: values[:, 0]
        if values.ndim == 2 and quantity_of(kind, name).form in scalar
        else values
        for name, values in columns.items()
    }


def write_log(
    imported: Imported,
    sources: Sequence[Source],
    fields: FieldMap,
    folder: Path,
    provenance: Mapping[str, Any],
) -> None:
    """Writes a log.

    Args:
        imported: what it holds.
        sources: where that is from.
        fields: what was what in them.
        folder: of the log, empty or new.
        provenance: command, date, versions, commit; all that was done is added.

    Raises:
        DisasmError: the folder is not empty, or the log would not be valid.
    """
    arm: dict[str, Any] = {"joints": fields.joints, "urdf": _lasting(fields)}
    if any(column.form == JOINTS for column in fields.columns.values()):
        # What tells an orientation alone is no part of a log without an arm.
        rules = KINDS[fields.kind].keys
        arm = {k: v for k, v in arm.items() if rules[k] is not Rule.FORBIDDEN}
    header = LogHeader(
        kind=fields.kind,
        task=fields.task,
        provenance=dict(provenance) | {"import": origin(imported, sources, fields)},
        frames=fields.frames,
        period=imported.period,
        drive=dict(fields.drive) or None,
        **arm,
    )
    with LogWriter(folder, header) as writer:
        for columns in imported.episodes:
            writer.write_episode(flat_columns(fields.kind, columns))


def _lasting(fields: FieldMap) -> str | None:
    """Returns the name of a map's URDF that holds wherever a program is started."""
    urdf = fields.urdf
    if how := lone_joint(fields):
        return ONE_JOINT_MODELS[how]
    if not urdf or urdf.startswith("package:"):
        return urdf or None
    return str(Path(urdf).resolve())


def lone_joint(fields: FieldMap) -> str:
    """Returns what a single joint without a URDF does; "" where there is no such joint.

    It slides if its position is in a unit of length or its torque in one of force, or
    else turns. A packaged model stands in for its URDF.
    """
    is_alone = len(fields.joints) == 1 and not fields.urdf
    if fields.kind != "joint_motion" or not is_alone:
        return ""
    units = [fields.columns[n].unit for n in ("q", "tau") if n in fields.columns]
    dimensions = [UNITS[unit][0] for unit in units if unit in UNITS]
    return "slides" if {"length", "force"} & {*dimensions} else "turns"


def origin(
    imported: Imported, sources: Sequence[Source], fields: FieldMap
) -> dict[str, Any]:
    """Returns everything that was done, as plain data."""
    found: dict[str, Any] = {
        "sources": {p: sha for source in sources for p, sha in source.files.items()},
        "map": yaml.safe_load(fields.to_yaml()),
        "rows_dropped": imported.dropped,
    }
    shifts = {
        f"{each.name}: {name}": dataclasses.asdict(shift) | {"taken": shift.is_seen}
        for each in imported.recordings
        for name, shift in each.shifts.items()
    }
    if notes := [note for source in sources for note in source.notes]:
        found["notes"] = notes
    if shifts:
        found["shifts"] = {n: _finite(values) for n, values in shifts.items()}
    stamps = {e.name: e.evened.words() for e in imported.recordings if e.evened}
    if stamps:
        found["stamps"] = stamps
    wraps = {e.name: e.wraps for e in imported.recordings if e.wraps}
    for name, values in (("wraps", wraps), ("held", imported.held)):
        if values:
            found[name] = values
    if imported.done:
        found["processing"] = processing_origin(imported.done)
    return found


def _finite(values: Mapping[str, Any]) -> dict[str, Any]:
    return {
        n: v if isinstance(v, bool) or math.isfinite(v) else str(v)
        for n, v in values.items()
    }


def processing_origin(done: Done) -> dict[str, Any]:
    """Returns what was done to make rows, as plain data; see `low_pass_of`."""
    filtered = math.isfinite(done.cutoff)
    return {
        "filter": _FILTER if filtered else "none",
        "cutoff_Hz": float(done.cutoff) if filtered else None,
        "derivatives": "of the filter's kernel" if filtered else "as recorded",
        "rows_lost_at_each_end": done.reach,
        "decimation": done.decimation,
        "recordings_resampled": done.resampled,
        "noise_in_accelerations": {f"q.{n}": float(s) for n, s in done.noise.items()},
        "quanta": {name: float(step) for name, step in done.quanta.items()},
        "gaps": sum(len(clock.gaps) for clock in done.clocks),
        "rows_lost": sum(clock.lost for clock in done.clocks),
    }


def low_pass_of(header: LogHeader) -> LowPass | None:
    """Returns the filter that acted on a log, at the rate of what was recorded.

    None if its provenance states none.
    """
    cutoff: Any
    every: Any
    done = _processing_in(header)
    if not isinstance(done, Mapping) or done.get("filter") != _FILTER:
        return None
    cutoff, every = done.get("cutoff_Hz"), done.get("decimation")
    is_number = isinstance(cutoff, int | float) and isinstance(every, int)
    if not is_number or not header.period:
        return None
    is_possible = every > 0 and 0.0 < cutoff < 0.5 * every / header.period
    return LowPass(float(cutoff), header.period / every) if is_possible else None


def is_noise(header: LogHeader) -> bool:
    """Whether an import saw no joint of a log move clearly more than its noise."""
    done = _processing_in(header)
    return isinstance(done, Mapping) and done.get("noise_in_accelerations") == {}


def _processing_in(header: LogHeader) -> Any:
    """Returns `processing_origin` of a log; None, or anything, if it states none."""
    done: Any = header.provenance
    for key in ("import", "processing"):
        done = done.get(key) if isinstance(done, Mapping) else None
    return done

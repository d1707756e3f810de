"""A recording as rows of a log: mapped, in SI units, on one time line."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from drake_disasm.cell.parsing import movable_joints
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.text import clipped
from drake_disasm.logs.importing.field_map import (
    Column,
    FieldMap,
    may_be_ordered,
    quantity_of,
)
from drake_disasm.logs.importing.orientations import (
    FORMS,
    JOINTS,
    check_angles,
    frame_poses,
    quaternions,
)
from drake_disasm.logs.importing.repeats import Held, held_stretches
from drake_disasm.logs.importing.shift import (
    MOST_JOINTS,
    UNKNOWN,
    Features,
    Shift,
    estimated_shift,
    joint_features,
    link_features,
    motion_features,
)
from drake_disasm.logs.importing.signals import clock_of, resample, unwrapped
from drake_disasm.logs.importing.source import Source
from drake_disasm.logs.importing.stamps import Evened, evened
from drake_disasm.logs.importing.stream import CLOSEST, LARGEST, Stream
from drake_disasm.logs.importing.units import UNITS, factor

Array = NDArray[np.float64]

_OF_OTHERS = "of other channels"
_POSITIONS = ("q", "q_commanded")
_MOST_DROPPED = 0.1  # of the rows, unless the user accepts more


@dataclasses.dataclass(frozen=True)
class Recording:
    """Rows of one episode, as recorded.

    Attributes:
        name: of the source, with the episode's number if there are several.
        time: (n,) increasing [s].
        columns: (n, k) of each quantity, SI.
        dropped: how many rows were left out, by the reason.
        shifts: of other streams' clocks, by the stream's name.
        evened: what was done to stamps of arrival; None of others.
        held: stretches over which a measured channel repeats a value, by "tau.0".
        wraps: jumps of a whole turn that were taken out of positions, by "q.0".
    """

    name: str
    time: Array
    columns: dict[str, Array]
    dropped: dict[str, int] = dataclasses.field(default_factory=dict)
    shifts: dict[str, Shift] = dataclasses.field(default_factory=dict)
    evened: Evened | None = None
    held: dict[str, tuple[Held, ...]] = dataclasses.field(default_factory=dict)
    wraps: dict[str, int] = dataclasses.field(default_factory=dict)

    def between(self, begin: float, end: float) -> "Recording":
        """Returns the rows between two times since its begin [s].

        Raises:
            DisasmError: there are none.
        """
        since = self.time - self.time[0]
        rows = (since >= begin) & (since <= end)
        if rows.sum() < 2:
            raise DisasmError(
                f"{self.name}: lasts {since[-1]:.4g} s; nothing is left between "
                f"{begin:g} and {end:g} s"
            )
        columns = {name: values[rows] for name, values in self.columns.items()}
        return dataclasses.replace(self, time=self.time[rows], columns=columns)


def recordings_of(
    source: Source,
    fields: FieldMap,
    shifts: bool = True,
    accept: bool = False,
    even: bool = True,
) -> list[Recording]:
    """Returns the episodes of a source.

    Args:
        source: the recording.
        fields: what is what in it.
        shifts: whether to estimate and take away shifts between streams.
        accept: whether more than a tenth of the rows may be left out.
        even: whether stamps of arrival are made even.

    Raises:
        DisasmError: the map names what is not there, or nothing is left.
    """
    stream = main_stream(source, fields)
    time = _time(source, stream, fields)
    own = _columns_of(source, stream, fields.columns)
    columns = {n: _values(source, n, column, fields) for n, column in own.items()}
    numbers = source.channel(fields.episode) if fields.episode else np.zeros(len(time))
    # Rests are read when they are reached: their stamps were never even.
    may_even = even and fields.rate is None and not may_be_ordered(fields.kind)
    foreign = _of_others(stream, own, (fields.time, fields.episode))
    found = []
    for number in np.unique(numbers[np.isfinite(numbers)]):
        rows = (numbers == number) & ~foreign
        label = (
            f"{source.path.name}[{number:g}]" if fields.episode else source.path.name
        )
        part = {name: values[rows] for name, values in columns.items()}
        numbered = None if stream.sequence is None else stream.sequence[rows]
        evening = _Evening(may_even, numbered)
        clean = _clean(label, time[rows], part, accept, evening)
        if count := int((foreign & (numbers == number)).sum()):
            dropped = clean.dropped | {_OF_OTHERS: count}
            clean = dataclasses.replace(clean, dropped=dropped)
        found.append(clean)
    if not found:
        raise DisasmError(f"{source.path}: '{fields.episode}' numbers no episode")
    others = {n: c for n, c in fields.columns.items() if n not in own}
    features = _features(fields) if shifts and others else None
    rest = dataclasses.replace(fields, columns=others)
    return [_with_others(each, source, rest, features, accept) for each in found]


def _of_others(
    stream: Stream, columns: Mapping[str, Column], clocks: Sequence[str | None]
) -> NDArray[np.bool_]:
    """Returns which rows (n,) of a table are those of other channels.

    A program that writes several topics in one table leaves the cells of all others
    empty in each row.

    Args:
        stream: the table.
        columns: of the map.
        clocks: channels that number the rows of all topics.
    """
    mapped = {channel for column in columns.values() for channel in column.channels}
    own, others = (np.zeros(stream.rows, dtype=bool) for _ in range(2))
    for name, values in stream.channels.items():
        is_filled = ~np.isnan(values)
        if name in mapped:
            own |= is_filled
        elif name not in clocks and not is_filled.all():  # one of all rows is of none
            others |= is_filled
    return others & ~own


def _features(fields: FieldMap) -> Features | None:
    """Returns what wrenches depend on: the last link's motion, of an arm we know."""
    if "q" not in fields.columns:
        return None
    if fields.urdf:
        return link_features(fields.urdf, fields.joints)
    return joint_features if len(fields.joints) <= MOST_JOINTS else None


def main_stream(source: Source, fields: FieldMap) -> Stream:
    """Returns the stream on whose time line the log is: that of the first column."""
    if not fields.columns:
        raise DisasmError("map: has no columns")
    return source.stream_of(next(iter(fields.columns.values())).channels[0])


def _time(source: Source, stream: Stream, fields: FieldMap) -> Array:
    """Returns the times (n,) of a stream's rows [s], or their order."""
    if fields.rate is not None:
        return np.arange(stream.rows) / fields.rate
    if fields.time is not None:
        time = source.channel(fields.time)
        if len(time) != stream.rows:
            raise DisasmError(
                f"map: '{fields.time}' has {len(time)} rows, '{stream.names[0]}' "
                f"{stream.rows}; name the time of these, or give `rate`"
            )
        return time * factor(fields.time_unit, "map: time")
    if stream.time is not None:
        return stream.time
    if fields.is_order:
        return np.arange(float(stream.rows))
    raise DisasmError(
        "map: say which channel is the time, time: {from: NAME}, or how many rows a "
        "second there are, time: {rate: HZ}"
    )


def _values(source: Source, name: str, column: Column, fields: FieldMap) -> Array:
    """Returns a quantity's values (n, k) in SI units, orientations as quaternions."""
    stream = source.stream_of(column.channels[0])
    for channel in column.channels:
        if source.stream_of(channel) is not stream:
            raise DisasmError(
                f"map: {name} takes channels of two topics; take them from one"
            )
    where = f"map: {name}"
    raw = np.stack([stream.channels[channel] for channel in column.channels], axis=1)
    values = raw * np.array(column.factors(stream.constants, where)) + column.offset
    if column.form == JOINTS:
        return _of_frame(values, name, column, fields)
    if not column.form:
        return values
    first = len(column.channels) - FORMS[column.form].channels
    has_unit = UNITS.get(column.unit, ("",))[0] == "angle"
    turned = quaternions(values[:, first:], column.form, has_unit, where)
    return np.concatenate([values[:, :first], turned], axis=1)


def _of_frame(q: Array, name: str, column: Column, fields: FieldMap) -> Array:
    """Returns orientations, or poses, of a frame of the arm by its joints (n, j)."""
    where = f"map: {name}"
    if not fields.urdf:
        raise DisasmError(f"{where} follows from joints; give the arm's URDF by `urdf`")
    joints = fields.joints or movable_joints(fields.urdf)
    if len(joints) != q.shape[1]:
        raise DisasmError(
            f"{where} has {q.shape[1]} channels for the URDF's {len(joints)} joints "
            f"({clipped(', '.join(joints))}); name theirs by `joints`"
        )
    check_angles(q, bool(column.unit), where)
    poses = frame_poses(q, fields.urdf, joints, column.frame)
    return poses[:, -len(quantity_of(fields.kind, name).components) :]


@dataclasses.dataclass(frozen=True)
class _Evening:
    """Whether stamps of arrival are made even, and the numbers (n,) of the rows."""

    wanted: bool = False
    sequence: Array | None = None


_NONE = _Evening()


def _clean(
    name: str,
    time: Array,
    columns: dict[str, Array],
    accept: bool,
    evening: "_Evening" = _NONE,
) -> Recording:
    """Returns the rows that hold numbers at times that increase.

    Raises:
        DisasmError: they are fewer than two, or nine tenths without being accepted.
    """
    whole = np.abs(time) < LARGEST
    for values in columns.values():
        whole &= (np.abs(values) < LARGEST).all(axis=1)
    order = np.flatnonzero(whole)
    if not accept:
        _check_fine(name, time[order])
    columns, wraps = _unwrapped(time, columns, order)
    found = None
    if evening.wanted and "q" in columns:
        numbers = None if evening.sequence is None else evening.sequence[order]
        found = evened(time[order], columns["q"][order], numbers)
    if found:
        time = time.copy()
        time[order] = found.time
    kept = order[_later(time[order])]
    dropped = {
        "without numbers": len(time) - len(order),
        "at the time of an earlier row, or before": len(order) - len(kept),
    }
    dropped = {why: count for why, count in dropped.items() if count}
    check_share(name, dropped, len(time), accept)
    if len(kept) < 2:
        raise DisasmError(f"{name}: no two rows hold numbers at times that increase")
    rows = {n: values[kept] for n, values in columns.items()}
    held = held_stretches(time[kept], rows)
    return Recording(name, time[kept], rows, dropped, {}, found, held, wraps)


def _later(time: Array) -> NDArray[np.bool_]:
    """Returns which times (n,) are after all that come before."""
    closest = CLOSEST * clock_of(time).period
    greatest = np.maximum.accumulate(time)
    later = np.diff(time, prepend=-np.inf) > 0.0
    later[1:] &= time[1:] - greatest[:-1] > closest
    return np.asarray(later)


def _unwrapped(
    time: Array, columns: dict[str, Array], rows: NDArray[np.int64]
) -> tuple[dict[str, Array], dict[str, int]]:
    """Returns columns with positions that are continuous, and the jumps taken out.

    Args:
        time, columns: as recorded.
        rows: numbers of those that hold numbers.
    """
    found = dict(columns)
    wraps: dict[str, int] = {}
    for name in set(_POSITIONS) & set(columns):
        turned, counts = unwrapped(time[rows], columns[name][rows])
        found[name] = columns[name].copy()
        found[name][rows] = turned
        wraps |= {f"{name}.{n}": int(c) for n, c in enumerate(counts) if c}
    return found, wraps


def check_share(name: str, dropped: dict[str, int], rows: int, accept: bool) -> None:
    """Refuses to leave out more than a tenth of the rows.

    Args:
        name: of the recording.
        dropped: rows by the reason.
        rows: in all.
        accept: whether the user wants it so.

    Raises:
        DisasmError: says how many, and why.
    """
    if accept or sum(dropped.values()) <= _MOST_DROPPED * rows:
        return
    words = ", ".join(f"{count} {why}" for why, count in dropped.items())
    raise DisasmError(
        f"{name}: more than a tenth of {rows} rows would be left out: {words}; "
        "correct the recording or the map, or accept it by `accept_left_out`"
    )


def _check_fine(name: str, time: Array) -> None:
    """Refuses times of which more than a tenth are those of the row before."""
    stamps, counts = np.unique(time, return_counts=True)
    steps = np.diff(time)
    if len(stamps) < 2 or (steps == 0.0).sum() <= _MOST_DROPPED * len(time):
        return
    if (steps < 0.0).any():
        return  # episodes one after the other, rather than a coarse clock
    first = 1 if len(stamps) > 2 else 0  # the first stamp may lack rows
    rate = counts[first:-1].sum() / (stamps[-1] - stamps[first])
    raise DisasmError(
        f"{name}: the time has steps of {np.median(np.diff(stamps)):.4g} s with "
        f"{np.median(counts):g} rows each; if these were sampled evenly, give their "
        f"rate, `rate` {rate:.4g}"
    )


def _with_others(
    recording: Recording,
    source: Source,
    others: FieldMap,
    features: Features | None,
    accept: bool,
) -> Recording:
    """Returns the rows with other streams' channels, where those reach."""
    for stream, columns in _by_stream(source, others.columns):
        values = {n: _values(source, n, c, others) for n, c in columns.items()}
        if stream.time is None:
            raise DisasmError(f"map: {', '.join(values)} has no time of its own")
        other = _clean(stream.name, stream.time, values, accept)
        recording = _joined(recording, other, features, accept)
    return recording


def _by_stream(
    source: Source, columns: Mapping[str, Column]
) -> Iterator[tuple[Stream, dict[str, Column]]]:
    for stream in source.streams:
        if own := _columns_of(source, stream, columns):
            yield stream, own


def _columns_of(
    source: Source, stream: Stream, columns: Mapping[str, Column]
) -> dict[str, Column]:
    """Returns the columns whose channels are in a stream."""
    return {
        name: column
        for name, column in columns.items()
        if source.stream_of(column.channels[0]) is stream
    }


def _joined(
    recording: Recording, other: Recording, features: Features | None, accept: bool
) -> Recording:
    seconds, known = 0.0, dict(recording.shifts)
    known[other.name] = UNKNOWN
    if features and "q" in recording.columns:
        stacked = np.concatenate(list(other.columns.values()), axis=1)
        motion = motion_features(recording.time, recording.columns["q"], features)
        found = estimated_shift(*motion, other.time, stacked)
        known[other.name] = found
        seconds = found.seconds if found.is_seen else 0.0
    time = other.time + seconds
    inside = (recording.time >= time[0]) & (recording.time <= time[-1])
    if inside.sum() < 2:
        raise DisasmError(
            f"{recording.name}: {other.name} was recorded at another time"
        )
    outside = {f"before or after {other.name}": int((~inside).sum())}
    check_share(recording.name, outside, len(inside), accept)
    dropped = recording.dropped | (outside if not inside.all() else {})
    dropped |= {f"{why} in {other.name}": n for why, n in other.dropped.items()}
    columns = {name: values[inside] for name, values in recording.columns.items()}
    columns |= {
        name: resample(time, values, recording.time[inside])
        for name, values in other.columns.items()
    }
    late = {
        name: tuple(
            dataclasses.replace(
                each, begin=each.begin + seconds, end=each.end + seconds
            )
            for each in held
        )
        for name, held in other.held.items()
    }
    return dataclasses.replace(
        recording,
        time=recording.time[inside],
        columns=columns,
        dropped=dropped,
        shifts=known,
        held=recording.held | late,
        wraps=recording.wraps | other.wraps,
    )

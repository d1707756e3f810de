"""Several files as columns of one recording."""

import collections
import hashlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs.importing.guess import Known, time_label, unit_of_times
from drake_disasm.logs.importing.signals import resample
from drake_disasm.logs.importing.source import Source
from drake_disasm.logs.importing.stream import CLOSEST, LARGEST, Stream
from drake_disasm.logs.importing.units import factor

Array = NDArray[np.float64]

#: Ways to join files.
WAYS = ("time", "rows")


def joined(sources: Sequence[Source], way: str, known: Known) -> Source:
    """Returns the tables of several files as one, on the first one's rows.

    Channels that several files have get their file's name before theirs. On time, other
    files' channels are taken at the first one's times, by cubic splines, where all were
    recorded.

    Args:
        sources: of one table each; more than one.
        way: "time" or "rows".
        known: how the time is called.

    Raises:
        DisasmError: they are of several lengths, or have no times in common.
    """
    if len(sources) < 2:
        raise DisasmError("`join`: give the files that are columns of one recording")
    tables = [_table(source) for source in sources]
    by_time = way == "time" and known.rate is None
    interpolated = list[str]()
    if by_time:
        parts, interpolated = _on_time(sources, tables, known)
    else:
        parts = _by_rows(sources, tables)
    count = collections.Counter(name for part in parts for name in part)
    time = time_label(tables[0], known)
    channels, labels = dict[str, Array](), dict[str, str]()
    for i, (source, table, part) in enumerate(zip(sources, tables, parts, strict=True)):
        for name, values in part.items():
            is_first_time = i == 0 and name == time
            is_alone = count[name] == 1 or is_first_time
            unique = name if is_alone else f"{source.label}.{name}"
            if unique in channels:
                raise DisasmError(
                    f"`join`: '{unique}' is in two files of one name; rename one"
                )
            channels[unique] = values
            if name in table.labels:
                labels[unique] = table.labels[name]
    digest = hashlib.sha256("".join(s.sha256 for s in sources).encode()).hexdigest()
    stream = Stream(
        "",
        channels,
        constants={n: c for table in tables for n, c in table.constants.items()},
        labels=labels,
        left_out={n: why for table in tables for n, why in table.left_out.items()},
        notes=(*_notes(sources, tables), *interpolated),
    )
    return Source(
        sources[0].path,
        (stream,),
        digest,
        tuple((str(source.path), source.sha256) for source in sources),
    )


def _table(source: Source) -> Stream:
    if len(source.streams) != 1 or source.streams[0].name:
        raise DisasmError(
            f"{source.path}: `join` takes files of one table each; this one has "
            f"{len(source.streams)} streams"
        )
    return source.streams[0]


def _by_rows(
    sources: Sequence[Source], tables: Sequence[Stream]
) -> list[dict[str, Array]]:
    first = tables[0].rows
    for source, table in zip(sources, tables, strict=True):
        if table.rows != first:
            raise DisasmError(
                f"{source.path}: has {table.rows} rows, {sources[0].path.name} "
                f"{first}; join them on time, or cut them to the same rows"
            )
    return [dict(table.channels) for table in tables]


def _on_time(
    sources: Sequence[Source], tables: Sequence[Stream], known: Known
) -> tuple[list[dict[str, Array]], list[str]]:
    """Returns the channels of each table on the first one's times, and how."""
    names = [_time_of(s, t, known) for s, t in zip(sources, tables, strict=True)]
    times = [_seconds(t.channels[n]) for t, n in zip(tables, names, strict=True)]
    if all(np.array_equal(time, times[0]) for time in times):
        return [
            {n: v for n, v in table.channels.items() if i == 0 or n != names[i]}
            for i, table in enumerate(tables)
        ], []
    at, (begin, end) = times[0], _common(sources, times)
    kept = (at >= begin) & (at <= end)
    parts = [{n: v[kept] for n, v in tables[0].channels.items()}]
    rates = [_rate_words(time) for time in times]
    words = [
        f"{source.label}, at {rate}, interpolated at the times of "
        f"{sources[0].label}, at {rates[0]}"
        for source, rate in zip(sources[1:], rates[1:], strict=True)
    ]
    for table, time, name in zip(tables[1:], times[1:], names[1:], strict=True):
        parts.append(
            {
                n: _taken(time, values, at[kept])
                for n, values in table.channels.items()
                if n != name
            }
        )
    return parts, words


def _rate_words(time: Array) -> str:
    steps = np.diff(time[np.isfinite(time)])
    return f"{1.0 / np.median(steps):.4g} Hz" if (steps > 0).any() else "one time"


def _notes(sources: Sequence[Source], tables: Sequence[Stream]) -> list[str]:
    """Returns the notes on each table, the other files' with the file's label."""
    return [
        f"{source.label}: {note}" if i else note
        for i, (source, table) in enumerate(zip(sources, tables, strict=True))
        for note in table.notes
    ]


def _time_of(source: Source, table: Stream, known: Known) -> str:
    name = time_label(table, known)
    if name is None:
        raise DisasmError(
            f"{source.path}: no channel is called as time is, to join it on; join by "
            "rows, or name it `time`"
        )
    return name


def _seconds(values: Array) -> Array:
    return values * factor(unit_of_times(values), "time")


def _common(sources: Sequence[Source], times: Sequence[Array]) -> tuple[float, float]:
    """Returns when all files were recorded [s].

    Raises:
        DisasmError: that is less than nine tenths of the first one's rows.
    """
    begin = max(float(np.nanmin(time)) for time in times)
    end = min(float(np.nanmax(time)) for time in times)
    inside = ((times[0] >= begin) & (times[0] <= end)).sum()
    if 10 * inside < 9 * len(times[0]):
        names = " and ".join(source.path.name for source in sources)
        raise DisasmError(
            f"`join`: {names} have no clock in common: only {inside} of "
            f"{len(times[0])} rows are at times of all; correct them, or join by rows"
        )
    return begin, end


def _taken(time: Array, values: Array, at: Array) -> Array:
    """Returns values (n,) at other times (m,), from the rows that hold numbers."""
    whole = (np.abs(time) < LARGEST) & (np.abs(values) < LARGEST)
    stamps, first = np.unique(time[whole], return_index=True)
    steps = np.diff(stamps, prepend=-np.inf)
    apart = steps > CLOSEST * np.median(steps)
    stamps, first = stamps[apart], first[apart]
    if len(stamps) < 2:
        return np.full(len(at), np.nan)
    found = resample(stamps, values[whole][first][:, None], at)[:, 0]
    return np.where((at >= stamps[0]) & (at <= stamps[-1]), found, np.nan)

"""What is in a recording, and what was done to it, in words."""

import math
from collections.abc import Iterator

import numpy as np

from drake_disasm.importing.importer import Imported
from drake_disasm.importing.signals import clock_of, quantum
from drake_disasm.importing.source import Source
from drake_disasm.importing.stream import Stream

_SHOWN = 60  # channels of a stream


def described(source: Source, time: str | None = None, unit: float = 1.0) -> str:
    """Returns the streams of a recording with rates, gaps and ranges.

    Args:
        source: the recording.
        time: channel of a table's time, if it is known.
        unit: of that [s].
    """
    lines = [f"{source.path}:"]
    for stream in source.streams:
        lines += _stream_lines(stream, time, unit)
    return "\n".join(lines)


def _stream_lines(stream: Stream, time: str | None, unit: float) -> Iterator[str]:
    head = f"  {stream.name or 'table'}: {stream.rows} rows"
    if stream.kind:
        head += f", {stream.kind}"
    times = stream.time
    if times is None and time in stream.channels:
        times = unit * stream.channels[str(time)]
    if times is not None and len(times) > 1:
        head += f", {_clock_words(times)}"
    if stream.received is not None and stream.time is not stream.received:
        late = stream.received - np.asarray(stream.time)
        head += (
            f", received {1e3 * np.median(late):.3g} ms after their stamps "
            f"(± {1e3 * late.std():.2g} ms)"
        )
    yield head
    for name, value in stream.constants.items():
        yield f"    {name} = {value:.6g} (a constant)"
    for name in stream.names[:_SHOWN]:
        yield f"    {name}: {_range_words(stream.channels[name])}"
    if len(stream.names) > _SHOWN:
        yield f"    ... and {len(stream.names) - _SHOWN} more"


def _clock_words(time: np.ndarray) -> str:
    clock = clock_of(time)
    if not clock.period:
        return "time stands still"
    words = f"{1.0 / clock.period:.4g} Hz, jitter {1e3 * clock.jitter:.2g} ms"
    if clock.lost:
        words += f", {clock.lost} rows lost"
    if clock.gaps:
        words += f", {len(clock.gaps)} gaps of up to {max(clock.gaps):.2g} s"
    if clock.repeated:
        words += f", {clock.repeated} rows whose time does not increase"
    return words


def _range_words(values: np.ndarray) -> str:
    finite = values[np.isfinite(values)]
    if not len(finite):
        return "no numbers"
    if np.ptp(finite) == 0.0:
        return f"constant, {finite[0]:.6g}"
    words = f"{finite.min():.5g} to {finite.max():.5g}"
    if step := quantum(finite):
        words += f", in steps of {step:.3g}"
    if len(finite) < len(values):
        words += f", {len(values) - len(finite)} rows without a number"
    return words


def summary(imported: Imported) -> str:
    """Returns what was done, and what the data are like."""
    count = len(imported.episodes)
    lines = [f"{imported.rows} rows in {count} episode{'s' if count > 1 else ''}"]
    dropped = sum(each.dropped for each in imported.recordings)
    if dropped:
        lines.append(f"{dropped} rows without numbers or with earlier times left out")
    for each in imported.recordings:
        for name, s in each.shifts.items():
            words = (
                f"off by {1e3 * s.seconds:+.2f} ms (95 %: {1e3 * s.low:+.2f} to "
                f"{1e3 * s.high:+.2f}), taken away"
                if s.is_seen
                else "not compared: `urdf` tells what its sensor should read"
            )
            lines.append(f"{each.name}: the clock of {name} is {words}")
    if done := imported.done:
        lines += _done_lines(imported)
        steps = ", ".join(f"{n} {s:.3g}" for n, s in list(done.quanta.items())[:8])
        if steps:
            lines.append(f"rounded, which is noise of a third of that: {steps}")
    return "\n".join(lines)


def _done_lines(imported: Imported) -> Iterator[str]:
    done = imported.done
    assert done is not None
    lost, gaps = sum(c.lost for c in done.clocks), sum(len(c.gaps) for c in done.clocks)
    if done.resampled:
        yield (
            f"{done.resampled} of {len(done.clocks)} recordings were not sampled "
            f"evenly ({lost} rows lost, {gaps} gaps): resampled, and parted at gaps"
        )
    if not math.isfinite(done.cutoff):
        yield "no filter"
        return
    yield (
        f"low-pass of {done.cutoff:.3g} Hz on all columns, without phase shift; v and "
        "vd are its derivatives where they were not recorded"
    )
    kept = "all others" if done.decimation == 1 else f"one of {done.decimation} others"
    yield f"{done.reach} rows lost at either end; {kept} kept"

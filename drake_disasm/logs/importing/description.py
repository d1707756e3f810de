"""What is in a recording, and what was done to it, in words."""

import math
import operator
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from drake_disasm.logs.importing.field_map import FieldMap
from drake_disasm.logs.importing.guess import Known, time_label, unit_of_times
from drake_disasm.logs.importing.importer import Imported, lone_joint
from drake_disasm.logs.importing.recording import Recording
from drake_disasm.logs.importing.signals import clock_of, quantum
from drake_disasm.logs.importing.source import Source
from drake_disasm.logs.importing.stream import Stream
from drake_disasm.logs.importing.units import factor
from drake_disasm.logs.importing.usage import uses

Array = NDArray[np.float64]

_FIRST = 3  # values of a channel that are shown


def described(
    source: Source, kind: str = "joint_motion", fields: FieldMap | None = None
) -> str:
    """Returns what is in a recording, and what becomes of it.

    Streams with their rates and gaps, every channel with its range, its first values
    and its use, and what is left out, with the reason.

    Args:
        source: the recording.
        kind: of the log that is wanted.
        fields: the map; None where none is guessed.
    """
    lines, becomes = [f"{source.path}:"], uses(source, kind, fields)
    for stream in source.streams:
        lines += _stream_lines(stream, becomes, fields)
    return "\n".join(lines)


def _stream_lines(
    stream: Stream, becomes: Mapping[str, str], fields: FieldMap | None
) -> Iterator[str]:
    head = f"  {stream.name or 'table'}: {stream.rows} rows"
    if stream.kind:
        head += f", {stream.kind}"
    times = _times(stream, fields)
    if times is not None and len(times) > 1:
        head += f", {_clock_words(times)}"
    if stream.received is not None and stream.time is not stream.received:
        late = stream.received - np.asarray(stream.time)
        head += (
            f", received {1e3 * np.median(late):.3g} ms after their stamps "
            f"(± {1e3 * late.std():.2g} ms)"
        )
    yield head
    yield from (f"    {note}" for note in stream.notes)
    for name, value in stream.constants.items():
        yield f"    {name} = {value:.6g} (a constant)"
    for name, values in stream.channels.items():
        label = stream.labels.get(name)
        text = f"{name} ({label})" if label else name
        first = ", ".join(f"{value:.5g}" for value in values[:_FIRST])
        yield f"    {text}: {_range_words(values)}; {first} ... -> {becomes[name]}"
    for name, why in stream.left_out.items():
        yield f"    {name}: left out: it {why}"


def _times(stream: Stream, fields: FieldMap | None) -> Array | None:
    """Returns the times (n,) of a stream [s], by the map or a channel's name."""
    if fields and fields.rate is not None:
        return np.arange(stream.rows) / fields.rate
    if stream.time is not None:
        return stream.time
    name = fields.time if fields else time_label(stream, Known())
    if name not in stream.channels or (fields and fields.is_order):
        return None
    values = stream.channels[str(name)]
    unit = fields.time_unit if fields else unit_of_times(values)
    return values * factor(unit, "map: time")


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
    for why, rows in imported.dropped.items():
        lines.append(f"{rows} row{'s' if rows > 1 else ''} {why} left out")
    for each in imported.recordings:
        if each.evened:
            lines.append(f"{each.name}: {each.evened.words()}")
        for name, s in each.shifts.items():
            words = (
                f"off by {1e3 * s.seconds:+.2f} ms (95 %: {1e3 * s.low:+.2f} to "
                f"{1e3 * s.high:+.2f}), taken away"
                if s.is_seen
                else "not compared: `urdf` tells what its sensor should read"
            )
            lines.append(f"{each.name}: the clock of {name} is {words}")
        lines += _raw_lines(each)
    if done := imported.done:
        lines += _done_lines(imported)
        steps = ", ".join(f"{n} {s:.3g}" for n, s in list(done.quanta.items())[:8])
        if steps:
            lines.append(f"rounded, which is noise of a third of that: {steps}")
    return "\n".join(lines)


def _raw_lines(recording: Recording) -> Iterator[str]:
    """Yields what stands in the rows as recorded: wraps, and values that repeat."""
    if wraps := recording.wraps:
        words = ", ".join(f"{name} {count} times" for name, count in wraps.items())
        yield f"{recording.name}: jumps of a whole turn taken out: {words}"
    for name, held in recording.held.items():
        seconds = sum(each.end - each.begin for each in held)
        at_end = all(each.at_end for each in held)
        why = "saturated" if at_end else "did the sensor stop"
        value = "its end value" if at_end else "a value"
        yield (
            f"{recording.name}: {name} repeats {value} for {seconds:.3g} s in all, "
            f"first from {held[0].begin - recording.time[0]:.4g} s on: {why}?"
        )


def joint_words(fields: FieldMap) -> str:
    """Returns what is assumed of a single joint without a URDF; "" of others."""
    how = lone_joint(fields)
    other = "slides, give `unit: m`" if how == "turns" else "turns, give `unit: rad`"
    return how and (
        f"no URDF: '{fields.joints[0]}' {how}, and moves one unknown body (if it "
        f"{other} of q in a map)"
    )


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
    if noise := done.noise:
        joint, share = max(noise.items(), key=operator.itemgetter(1))
        words = f"{100.0 * share:.2g} %"
        yield f"noise in the accelerations: at most {words} of their rms (q.{joint})"
    if noisy := done.noisy:
        names = ", ".join(f"q.{joint}" for joint in noisy)
        yield f"moves, but its acceleration is not above its noise: {names}"
    if done.over_velocity:
        joint, ratio = max(done.over_velocity.items(), key=operator.itemgetter(1))
        yield (
            f"accelerations from positions have at most {ratio:.3g} times the "
            f"rms of those from the recorded velocities (q.{joint})"
        )
    kept = "all others" if done.decimation == 1 else f"one of {done.decimation} others"
    yield f"{done.reach} rows lost at either end; {kept} kept"

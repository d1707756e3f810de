"""Guesses what is what in a recording, from names, metadata and message types."""

import dataclasses
import json
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.text import clipped
from drake_disasm.logs.importing.field_map import Column, FieldMap, may_be_ordered
from drake_disasm.logs.importing.orientations import FORMS
from drake_disasm.logs.importing.presets import Preset
from drake_disasm.logs.importing.source import Source
from drake_disasm.logs.importing.stream import Stream
from drake_disasm.logs.importing.units import NORMALISED
from drake_disasm.logs.importing.vectors import (
    orientation_of,
    unclear_angles,
    wrench_of,
)
from drake_disasm.logs.importing.vocabulary import (
    NAMES,
    Label,
    Tokens,
    is_alive,
    labels_of,
    left_out_of,
    matched,
    named,
    numbered,
    tokens_of,
)
from drake_disasm.logs.schema import KINDS, WRENCH

_EPISODE = ("episode_index", "episode", "trial", "run")
#: What is looked for, by the kind of log.
_OF_JOINTS = {
    "joint_motion": ("q", "tau", "current"),
    "joint_torque_static": ("q", "tau"),
    "joint_response": ("q", "q_commanded", "supply", "enabled"),
}
_SCALARS = ("supply", "enabled")
_TORQUES = ("tau", "current")  # the first, if both are there
#: Kinds of log that names alone tell.
_NAMED = ("joint_response", "static_wrench")
#: What some kinds need besides positions, in words.
_NEEDED = {"q_commanded": "commanded joint positions", "tau": "joint torques"}


@dataclasses.dataclass(frozen=True)
class Known:
    """What is known of a recording beside its names.

    Attributes:
        joints: their names, of a URDF or of the user; () for the recording's.
        in_order: whether `joints` are in the order of the channels, where no name says.
        urdf: of the arm, or "".
        rate: rows a second [Hz], or None.
        preset: what wrote the recording, or None.
    """

    joints: Sequence[str] = ()
    in_order: bool = False
    urdf: str = ""
    rate: float | None = None
    preset: Preset | None = None

    @property
    def names(self) -> Mapping[str, tuple[str, ...]]:
        """What the quantities are called; by a preset, first what it calls them."""
        return self.preset.all_names if self.preset else NAMES


class NoGuessError(DisasmError):
    """The names of a recording do not tell what is what.

    Attributes:
        reason: what no name tells.
    """

    def __init__(self, where: object, reason: str) -> None:
        """Says so, with what to do.

        Args:
            where: the recording's path, or the stream's name.
            reason: what no name tells.
        """
        self.reason = reason
        super().__init__(
            f"{where}: {reason}; `show` prints the channels, `save_map` writes a map "
            "to fill in, which is given by `map`; `preset` knows some programs' names"
        )


def map_to_fill_in(kind: str, source: Source) -> str:
    """Returns a map as YAML that names what a kind of log needs, and no channels.

    Args:
        kind: of the log.
        source: the recording, whose channels stand above it as a comment.
    """
    names = [name for stream in source.streams for name in stream.names]
    lines = [
        "# Write the names of channels into each `from: []`, one for each component;",
        "# a quantity with # before it is optional. The channels are:",
        *(f"#   {', '.join(names[i : i + 6])}" for i in range(0, len(names), 6)),
        f"kind: {kind}",
        "joints: []  # their names in the URDF, in the order of the channels",
        f"time: {{from: {_likely_time(source)}, unit: s}}  # or {{rate: HZ}}",
        *_frames_to_choose(kind),
        "columns:",
    ]
    for quantity in KINDS[kind].quantities:
        if quantity.name not in ("time", "extra"):
            mark = "" if quantity.required else "# "
            hint = f"; `as` {', '.join(FORMS)}" if quantity.is_rotation else ""
            lines.append(
                f"  {mark}{quantity.name}: {{from: []}}  # {quantity.meaning}{hint}"
            )
    return "\n".join(lines) + "\n"


def _frames_to_choose(kind: str) -> Iterator[str]:
    """Yields the lines of a map that choose frames, where a kind leaves a choice."""
    for quantity in KINDS[kind].quantities:
        if quantity.frame_is_stated and len(quantity.frames) > 1:
            first, *rest = quantity.frames
            yield f"frames: {{{quantity.name}: {first}}}  # or {', '.join(rest)}"


def _likely_time(source: Source) -> str:
    """Returns the channel that is called as time is, or increases in every row."""
    for stream in source.streams:
        if (name := time_label(stream, Known())) is not None:
            return json.dumps(name, ensure_ascii=False)
        for name, values in stream.channels.items():
            if len(values) > 2 and (np.diff(values) > 0.0).all():
                return json.dumps(name, ensure_ascii=False)
    return "TIME"


def guessed_map(source: Source, kind: str, known: Known | None = None) -> FieldMap:
    """Returns a map of what is there, as far as names tell.

    Velocities and accelerations of the recording are left out: they are made from the
    position, so that one filter acts on all.

    Args:
        source: the recording.
        kind: of the log.
        known: of it.

    Raises:
        NoGuessError: nothing that the kind needs is known by its name.
    """
    known = known or Known()
    try:
        return _guessed(source, kind, known)
    except NoGuessError as error:
        kinds = [each for each in _NAMED if _has_all(source, each, known)]
        if not kinds:
            raise
        reason = f"{error.reason}; its channels are those of `kind` {kinds[0]}"
        raise NoGuessError(source.path, reason) from None


def _guessed(source: Source, kind: str, known: Known) -> FieldMap:
    if kind in _OF_JOINTS:
        return _of_joints(source, known, kind)
    if kind in ("static_wrench", "contact"):
        return _sensor(source, known, kind)
    raise NoGuessError(source.path, f"a map of kind {kind} is not guessed")


def _has_all(source: Source, kind: str, known: Known) -> bool:
    """Whether a recording has what a kind of log needs."""
    try:
        return bool(_guessed(source, kind, known))
    except DisasmError:
        return False


def _of_joints(source: Source, known: Known, kind: str) -> FieldMap:
    """Returns the map of an arm's positions and torques, or what was commanded."""
    stream, columns = None, dict[str, Column]()
    joints: tuple[str, ...] = ()
    reasons = list[str]()
    for each in source.streams:
        try:
            found, names = _columns_of(each, known, _OF_JOINTS[kind])
        except _AmbiguousError as error:
            reasons.append(str(error))
            continue
        if "q" in found and (stream is None or len(found) > len(columns)):
            stream, columns, joints = each, found, names
    if stream is None:
        raise NoGuessError(source.path, _why_no_positions(source, known, reasons))
    for name, words in _NEEDED.items():
        if KINDS[kind].needs(name) and name not in columns:
            why = f"no channel is called as {words} are"
            why += _left_out(source, name, known)
            raise NoGuessError(source.path, why)
    time, unit = _time_and_unit(stream, known, source, kind)
    return FieldMap(
        kind=kind,
        columns=columns | _other_wrenches(source, stream),
        time=time,
        time_unit=unit,
        rate=known.rate,
        episode=next((n for n in _EPISODE if n in stream.channels), ""),
        urdf=known.urdf,
        joints=joints,
    )


class _AmbiguousError(DisasmError):
    """Names of a stream's joints say no order."""


def _why_no_positions(source: Source, known: Known, reasons: Sequence[str]) -> str:
    if reasons:
        return reasons[0]
    if any(stream.is_unnamed and not stream.labels for stream in source.streams):
        return (
            "has no line of names above its rows: its columns are column_0, column_1, "
            "..., of which a map says what each is"
        )
    if left := _left_out(source, "q", known):
        return f"no channel is called as joint positions are{left}"
    if known.preset:
        names = ", ".join(known.preset.names["q"][:3])
        return (
            f"preset '{known.preset.name}' does not fit: no channel is called {names}"
        )
    return "no channel is called as joint positions are"


def _left_out(source: Source, quantity: str, known: Known) -> str:
    """Returns what is no channel though its name says a quantity, in words; or ""."""
    found = [
        words
        for stream in source.streams
        for words in left_out_of(stream, quantity, known.names)
    ]
    return f": {'; '.join(found[:3])}" if found else ""


def _columns_of(
    stream: Stream, known: Known, quantities: Sequence[str]
) -> tuple[dict[str, Column], tuple[str, ...]]:
    """Returns those quantities of joints that a stream has, and the joints' names."""
    names = known.names
    labels, joints, keys = _positions(stream, known)
    if not labels:
        return {}, ()
    found = {"q": labels}
    for quantity in quantities[1:]:
        own = numbered(stream, names.get(quantity, ()))
        if len(own) != (1 if quantity in _SCALARS else len(labels)):
            by_name = named(stream, quantity, names)
            both = [by_name.get(key, []) for key in keys]
            own = [x[0] for x in both] if all(len(x) == 1 for x in both) else []
        channels = [x.channel for x in own]
        if own and (quantity not in _TORQUES or is_alive(stream, channels)):
            found[quantity] = own
    if "tau" in found:
        found.pop("current", None)
    columns = {q: _column(x) for q, x in found.items()}
    if preset := known.preset:
        columns = {q: preset.adapted(q, c, stream) for q, c in columns.items()}
    return {q: _lerobot(c, stream) for q, c in columns.items()}, joints


#: Channels of the positions, names of the joints, and what the channels' names have.
_Positions = tuple[list[Label], tuple[str, ...], list[Tokens]]


def _positions(stream: Stream, known: Known) -> _Positions:
    """Returns the channels of the joints' positions, and the joints' names.

    Numbered ones are those of a chain from its base. Named ones are matched with the
    joints that are known, whatever order they are in.

    Raises:
        _AmbiguousError: they are named, and not as the joints are.
    """
    joints = tuple(known.joints)
    counted = numbered(stream, known.names["q"])
    own = known.preset.joints if known.preset else ()
    if len(own) == len(counted) > 0:
        by_preset = {tokens_of(n): [x] for n, x in zip(own, counted, strict=True)}
        return _as_known(by_preset, joints or own, known)
    by_name = named(stream, "q", known.names)
    if by_name and (not counted or (joints and len(counted) != len(joints))):
        return _as_known(by_name, joints, known)
    numbers = [f"joint_{i}" for i in range(len(counted))]
    return counted, joints or tuple(numbers), [tokens_of(name) for name in numbers]


def _as_known(
    by_name: Mapping[Tokens, list[Label]], joints: tuple[str, ...], known: Known
) -> _Positions:
    """Returns named channels in the order of the joints that are known, or their own.

    Raises:
        _AmbiguousError: a name is there twice, or they are not those of the joints.
    """
    for name, labels in by_name.items():
        if len(labels) > 1:
            both = " and ".join(f"'{clipped(x.channel)}'" for x in labels[:2])
            raise _AmbiguousError(
                f"{both} are both the position of '{'_'.join(name)}'; rename one, or "
                "name the right one in a map"
            )
    listed = list(by_name)
    first = [labels[0] for labels in by_name.values()]
    if not joints:
        return first, tuple("_".join(name) for name in listed), listed
    order, reasons = matched(joints, listed)
    if len(order) == len(joints) and not reasons:
        return [first[i] for i in order], joints, [listed[i] for i in order]
    if known.in_order and len(first) == len(joints):
        elsewhere = _elsewhere(joints, listed)
        if not elsewhere:
            return first, joints, listed
        reasons = [*reasons, *elsewhere]
    names = ", ".join("_".join(name) for name in listed[:9])
    raise _AmbiguousError(
        (reasons or [f"the recording's joints ({names}) are not {', '.join(joints)}"])[
            0
        ]
        + "; give `joints`, the URDF's names in the order of the recording's, or a map"
    )


def _elsewhere(joints: Sequence[str], listed: Sequence[Tokens]) -> list[str]:
    """Returns which joints have their names in another place of the recording's."""
    places = {joint: matched([joint], listed)[0] for joint in joints}
    return [
        f"'{joint}' is number {i + 1} of `joints`, and {places[joint][0] + 1} of the "
        "recording's"
        for i, joint in enumerate(joints)
        if places[joint] not in ([], [i])
    ]


def _column(labels: Sequence[Label]) -> Column:
    """Returns a quantity of these channels, in the unit that their names say."""
    units = {label.unit for label in labels}
    channels = tuple(label.channel for label in labels)
    return Column(channels, units.pop() if len(units) == 1 else "")


def _lerobot(column: Column, stream: Stream) -> Column:
    """Returns positions of LeRobot's own motors as such: they are not radians."""
    labels = [stream.labels.get(name, "") for name in column.channels]
    if column.unit or not all(label.endswith(".pos") for label in labels):
        return column
    return dataclasses.replace(column, unit=NORMALISED)


def time_label(stream: Stream, known: Known) -> str | None:
    """Returns the channel of a table that is called as time is; None if none is."""
    labels = {label.plain: label.channel for label in reversed(labels_of(stream))}
    for name in known.names["time"]:
        if name in labels:
            return labels[name]
        behind = [c for text, c in labels.items() if text.endswith(f".{name}")]
        times = [stream.channels[c] for c in behind]
        if times and all(np.array_equal(time, times[0], True) for time in times):
            return behind[-1]  # of the first structure
    return None


def _time_and_unit(
    stream: Stream, known: Known, source: Source, kind: str
) -> tuple[str | None, str]:
    """Returns the channel of the time, and its unit.

    The unit is that of its name, of the preset, or by how far apart its values are.
    Without a time, that of the order with "1", where the kind of log may have one.
    """
    if known.rate is not None or stream.time is not None:
        return None, "s"
    name = time_label(stream, known)
    if name is None and may_be_ordered(kind):
        order = numbered(stream, NAMES["order"])
        return (order[0].channel if len(order) == 1 else None), "1"
    if name is None:
        raise NoGuessError(
            source.path,
            "no channel is called as time is (give the rows a second by `rate`)"
            + _left_out(source, "time", known),
        )
    said = next(x.unit for x in labels_of(stream) if x.channel == name)
    unit = said or (known.preset.time_unit if known.preset else "")
    return name, unit or unit_of_times(stream.channels[name], may_be_ordered(kind))


def unit_of_times(values: np.ndarray, at_rest: bool = False) -> str:
    """Returns the unit in which most steps of times (n,) are of a usual size.

    Of readings at rest, that in which they take from half a minute to eight hours.
    """
    values = values[np.isfinite(values)]
    steps = np.diff(values) if len(values) > 1 else np.zeros(1)
    size, most = (np.sum(steps), 3e4) if at_rest else (np.median(steps), 0.5)
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("us", 1e6)):
        if size < most * factor:
            return unit
    return "ns"


def _other_wrenches(source: Source, stream: Stream) -> dict[str, Column]:
    """Returns a wrench of another topic, as extra columns."""
    for other in source.streams:
        is_topic = other is not stream and bool(other.name)
        found = wrench_of(other) if is_topic else None
        if found:
            return {
                f"extra.{name}": Column((channel,))
                for name, channel in zip(WRENCH, found[0].channels, strict=True)
            }
    return {}


def _sensor(source: Source, known: Known, kind: str) -> FieldMap:
    """Returns the map of a force/torque sensor's readings."""
    columns, main, frame = dict[str, Column](), None, "S"
    for stream in source.streams:
        if found := wrench_of(stream, known.preset):
            columns["wrench"], frame = found
            main = stream
        if orientation := orientation_of(stream, known.preset):
            columns["R_WS"] = orientation
    if main is None or len(columns) < 2:
        raise NoGuessError(source.path, _why_no_reading(source, known))
    time, unit = _time_and_unit(main, known, source, kind)
    if kind == "contact" and "free" in main.channels:
        columns["free"] = Column(("free",))
    return FieldMap(kind, columns, time, unit, known.rate, frames={"wrench": frame})


def _why_no_reading(source: Source, known: Known) -> str:
    """Returns what no name tells of a wrench and its orientation."""
    tables = [stream for stream in source.streams if not stream.name]
    for stream in tables:
        if names := unclear_angles(stream):
            return (
                f"{', '.join(names)} may be a rotation vector or roll, pitch and yaw; "
                "say which by `as` in a map"
            )
    names = known.names["q"]
    if any(numbered(s, names) or named(s, "q", known.names) for s in source.streams):
        return (
            "no channels are called as an orientation is; if it follows from the "
            "joints, give `as: joints` and the sensor's `frame` in a map"
        )
    return "no channels are called as a wrench with an orientation is"

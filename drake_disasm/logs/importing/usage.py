"""What an import makes of each channel, and which torques it would leave out."""

from collections.abc import Mapping

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.text import clipped
from drake_disasm.logs.importing.field_map import FieldMap
from drake_disasm.logs.importing.orientations import JOINTS
from drake_disasm.logs.importing.recording import main_stream
from drake_disasm.logs.importing.source import Source
from drake_disasm.logs.importing.stream import Stream
from drake_disasm.logs.importing.vocabulary import (
    NAMES,
    is_alive,
    labels_of,
    left_out_of,
    named,
    numbered,
    read,
)

_MADE = "velocities and accelerations are made from the positions"
#: Why a quantity is not in a map, where the kind does not take it.
_WHY = {
    "v": _MADE,
    "vd": _MADE,
    "current": "a motor's current; name it as `current` in the map",
    "time": "another time",
    "order": "another order",
}


def uses(source: Source, kind: str, fields: FieldMap | None = None) -> dict[str, str]:
    """Returns what becomes of each channel, or why it is not used.

    Args:
        source: the recording.
        kind: of the log.
        fields: the map; None where none is guessed.
    """
    used = _used(fields) if fields else {}
    found = dict[str, str]()
    for stream in source.streams:
        known = _quantities(stream)
        for name in stream.names:
            found[name] = used.get(name) or _why_not(stream, name, known, kind)
    return found


def _used(fields: FieldMap) -> dict[str, str]:
    found = {fields.episode: "numbers the episodes"} if fields.episode else {}
    if fields.time:
        found[fields.time] = "order" if fields.is_order else "time"
    for name, column in fields.columns.items():
        many = len(column.channels) > 1
        is_of_joints = (
            column.form in ("", JOINTS)
            and not name.startswith("extra")
            and len(fields.joints) == len(column.channels)
        )
        head = f"{name} as {column.form}" if column.form else name
        for i, channel in enumerate(column.channels):
            use = f"{head}.{i}" if many else head
            use += f", {fields.joints[i]}" if is_of_joints else ""
            found[channel] = f"{use} ({column.why})" if column.why else use
    return found


def _quantities(stream: Stream) -> dict[str, str]:
    """Returns the quantity that each channel's name says, of those that do."""
    found = {
        label.channel: quantity
        for label in labels_of(stream)
        if (quantity := read(label, NAMES)[0])
    }
    for quantity, usual in NAMES.items():
        for label in numbered(stream, usual):
            found.setdefault(label.channel, quantity)
    return found


def _why_not(stream: Stream, name: str, known: Mapping[str, str], kind: str) -> str:
    quantity = known.get(name)
    values = stream.channels[name]
    if quantity in _WHY:
        return f"not used: {_WHY[quantity]}"
    if not is_alive(stream, [name]):
        return "not used: it says nothing"
    steps = np.diff(values)
    if quantity is None and len(steps) > 1 and (steps > 0.0).all():
        return "not used: it increases in every row, as a time or a count does"
    if quantity is None:
        return f"not used: its name says no quantity of a {kind} log"
    joint = {x.channel: read(x, NAMES)[1] for x in labels_of(stream)}[name]
    whose = f" of '{'_'.join(joint)}'" if joint and not joint[0].isdigit() else ""
    return f"not used: {quantity}{whose} by its name, and not in the map"


def check_torques(source: Source, fields: FieldMap) -> None:
    """Refuses a map of a joint's motion that leaves out torques that are there.

    Raises:
        DisasmError: names them.
    """
    if not _lacks_torques(fields):
        return
    used, stream = _used(fields), main_stream(source, fields)
    by_name = named(stream, "tau", NAMES)
    labels = numbered(stream, NAMES["tau"]) + [x for k in by_name.values() for x in k]
    left = [x.channel for x in labels if x.channel not in used]
    out = left_out_of(stream, "tau", NAMES)
    if out or (left and is_alive(stream, left)):
        raise DisasmError(
            f"{source.path}: has torques that are not in the map: "
            f"{_some([*out, *left])}; add them as tau, or accept it by "
            "`accept_left_out`"
        )


def without_torques(source: Source, fields: FieldMap) -> str:
    """Returns what a log of joint motion without torques is not good for, or ""."""
    if not _lacks_torques(fields):
        return ""
    stream, used = main_stream(source, fields), _used(fields)
    left = [n for n in stream.names if n not in used and is_alive(stream, [n])]
    words = "the log has no torques, without which no effect can be found"
    if "q_commanded" in _quantities(stream).values():
        words += "; with commanded positions it may be one of `kind` joint_response"
    if not left:
        return words
    return (
        f"{words}; not used: {_some(left)}; if these are torques, save the map by "
        "`save_map` and name them there as tau"
    )


def _lacks_torques(fields: FieldMap) -> bool:
    """Returns whether a map of a joint's motion has neither torques nor currents."""
    return fields.kind == "joint_motion" and not {"tau", "current"} & set(
        fields.columns
    )


def _some(names: list[str]) -> str:
    """Returns the first names of a list, in words."""
    return ", ".join(map(clipped, names[:3])) + (" ..." if len(names) > 3 else "")

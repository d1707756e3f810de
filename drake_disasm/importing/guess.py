"""Guesses what is what in a recording, from names and message types."""

import re
from collections.abc import Sequence

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.importing.field_map import Column, FieldMap
from drake_disasm.importing.source import Source
from drake_disasm.importing.stream import Stream
from drake_disasm.importing.units import UNITS
from drake_disasm.logs.schema import KINDS

#: What channels of a table are called, the more usual names first; a number may follow.
_NAMES = {
    "time": (
        "time", "t", "times", "timestamp", "stamp", "time_s", "seconds", "__time",
        "date", "datetime",
    ),
    "q": (
        "q", "qm", "position", "positions", "pos", "joint_position", "joint_positions",
        "joint_pos", "q_measured", "actual_q", "angle", "angles", "theta",
        "observation.state", "msr_pos", "q_msr",
    ),
    "tau": (
        "tau", "torque", "torques", "effort", "efforts", "joint_torque",
        "joint_torques", "joint_effort", "tau_measured", "actual_torque", "tau_j",
        "msr_trq", "force", "tau_msr", "tau_m",
    ),
    "q_commanded": (
        "q_commanded", "q_cmd", "q_desired", "q_des", "q_d", "q_ref", "q_target",
        "goal_position", "goal_positions", "goal", "position_command", "command",
        "commanded_position", "desired_position", "target_position", "target_q",
        "reference", "setpoint", "action",
    ),
    "supply": ("supply", "input_volts", "supply_voltage", "voltage", "vin"),
    "enabled": ("enabled", "torque_enable", "enable", "motor_on"),
}  # fmt: skip
_EPISODE = ("episode_index", "episode", "trial", "run")
_WRENCH = ("force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z")
_QUATERNION = ("orientation.w", "orientation.x", "orientation.y", "orientation.z")
_PLAIN_WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
_PLAIN_QUATERNION = ("qw", "qx", "qy", "qz")

#: What is looked for, by the kind of log.
_OF_JOINTS = {
    "joint_motion": ("q", "tau"),
    "joint_response": ("q", "q_commanded", "supply", "enabled"),
}
#: Before measured and commanded points of a controller's state, old and new names.
_PREFIXES = {"": "", "actual.": "desired.", "feedback.": "reference."}


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
            "to fill in, which is given by `map`"
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
        "time: {from: TIME, unit: s}",
        "columns:",
    ]
    for quantity in KINDS[kind].quantities:
        if quantity.name not in ("time", "extra"):
            mark = "" if quantity.required else "# "
            lines.append(f"  {mark}{quantity.name}: {{from: []}}  # {quantity.meaning}")
    return "\n".join(lines) + "\n"


def guessed_map(
    source: Source, kind: str, joints: Sequence[str] = (), urdf: str = ""
) -> FieldMap:
    """Returns a map of what is there, as far as names tell.

    Velocities and accelerations of the recording are left out: they are made from the
    position, so that one filter acts on all.

    Args:
        source: the recording.
        kind: of the log.
        joints: their names, of a URDF; () for the recording's.
        urdf: of the arm.

    Raises:
        NoGuessError: nothing that the kind needs is known by its name.
    """
    if kind in ("joint_motion", "joint_response"):
        return _joint_motion(source, joints, urdf, kind)
    if kind == "static_wrench":
        return _static_wrench(source)
    raise NoGuessError(source.path, f"a map of kind {kind} is not guessed")


def _joint_motion(
    source: Source, joints: Sequence[str], urdf: str, kind: str
) -> FieldMap:
    """Returns the map of an arm's positions and torques, or what was commanded."""
    quantities = _OF_JOINTS[kind]
    stream, columns = None, dict[str, Column]()
    for each in source.streams:
        found = _joints_of(each, joints, quantities)
        if "q" in found and (stream is None or len(found) > len(columns)):
            stream, columns = each, found
    if stream is None:
        raise NoGuessError(source.path, "no channel is called as joint positions are")
    count = len(columns["q"].channels)
    columns = {n: c for n, c in columns.items() if len(c.channels) == count}
    if kind == "joint_response" and "q_commanded" not in columns:
        raise NoGuessError(
            source.path, "no channel is called as commanded joint positions are"
        )
    return FieldMap(
        kind=kind,
        columns=columns | _other_wrenches(source, stream),
        time=_time_of(stream),
        time_unit=_time_unit(stream),
        episode=next((n for n in _EPISODE if n in stream.channels), ""),
        urdf=urdf,
        joints=_names_of(columns["q"].channels, joints),
    )


def _joints_of(
    stream: Stream, joints: Sequence[str], quantities: Sequence[str]
) -> dict[str, Column]:
    """Returns those quantities of joints that a stream has."""
    if stream.name:
        found = _joints_of_topic(stream, joints)
        return {q: column for q, column in found.items() if q in quantities}
    found = dict[str, Column]()
    for quantity in quantities:
        channels = _numbered(stream, quantity)
        if not channels or (joints and len(channels) != len(joints)):
            channels = _by_joint(stream, quantity, joints) or channels
        if channels:
            found[quantity] = _column(channels)
    return found


def _joints_of_topic(stream: Stream, joints: Sequence[str]) -> dict[str, Column]:
    """Returns positions and efforts of JointState, or of a controller's state."""
    for prefix, goal in _PREFIXES.items():
        fields = {"q": f"{prefix}position.", "tau": f"{prefix}effort."}
        if goal:
            fields["q_commanded"] = f"{goal}position."
        found = {
            q: tuple(n for n in stream.names if n.startswith(f"{stream.name}:{field}"))
            for q, field in fields.items()
        }
        if joints:
            found = {q: _ordered(c, joints) for q, c in found.items()}
        if found["q"]:
            moving = {q: c for q, c in found.items() if c and _is_alive(stream, c)}
            return {q: Column(c) for q, c in moving.items()}
    return {}


def _ordered(channels: Sequence[str], joints: Sequence[str]) -> tuple[str, ...]:
    """Returns the joints' channels in their order; none if one is not there."""
    by_joint = {name.rpartition(".")[2]: name for name in channels}
    if not all(joint in by_joint for joint in joints):
        return ()
    return tuple(by_joint[joint] for joint in joints)


def _is_alive(stream: Stream, channels: Sequence[str]) -> bool:
    """Whether any channel is not constant: an effort that nobody fills in is 0."""
    return any(np.ptp(stream.channels[name]) > 0 for name in channels)


def _plain_names(stream: Stream) -> dict[str, str]:
    """Returns the channels by their names in small letters, without unit, with dots.

    "/joint_states/Position[0] [deg]" is "joint_states.position[0]".
    """
    found = dict[str, str]()
    for name in stream.names:
        plain = _name_and_unit(name)[0].lower().replace("/", ".").strip(".")
        found.setdefault(plain, name)
    return found


def _name_and_unit(channel: str) -> tuple[str, str]:
    """Returns a channel's name, and the unit in brackets behind it, if it is known."""
    match = re.fullmatch(r"(.*?)[ _]*[\[(]([^\[\]()]+)[\])]", channel)
    is_unit = match and match[2].strip() in UNITS and not match[2].strip().isdigit()
    return (match[1], match[2].strip()) if match and is_unit else (channel, "")


def _column(channels: Sequence[str]) -> Column:
    """Returns a quantity of these channels, in the unit that their names say."""
    units = {_name_and_unit(name)[1] for name in channels}
    return Column(tuple(channels), units.pop() if len(units) == 1 else "")


def _numbered(stream: Stream, quantity: str) -> list[str]:
    """Returns channels as NAME, or NAME0, NAME.0, NAME_0, NAME[0] ... in order.

    Or behind a prefix that all of them have and no others: field.NAME0.
    """
    plain = _plain_names(stream)
    for usual in _NAMES[quantity]:
        if usual in plain:
            return [plain[usual]]
        pattern = re.compile(rf"(|.*\.){re.escape(usual)}[._\[ ]?(\d+)\]?$")
        by_prefix = dict[str, dict[int, str]]()
        for name, channel in plain.items():
            if match := pattern.match(name):
                by_prefix.setdefault(match[1], {})[int(match[2])] = channel
        if len(by_prefix) != 1 and "" not in by_prefix:
            continue
        found = by_prefix.get("") or next(iter(by_prefix.values()))
        if min(found) < 2 and sorted(found) == list(
            range(min(found), min(found) + len(found))
        ):
            return [found[i] for i in sorted(found)]
    return []


def _by_joint(stream: Stream, quantity: str, joints: Sequence[str]) -> list[str]:
    """Returns channels whose names join a quantity's and a joint's."""
    plain = _plain_names(stream)
    for usual in _NAMES[quantity]:
        for form in ("{q}.{j}", "{q}_{j}", "{j}.{q}", "{j}_{q}"):
            ends = [form.format(q=usual, j=joint.lower()) for joint in joints]
            found = [
                [c for n, c in plain.items() if n == end or n.endswith(f".{end}")]
                for end in ends
            ]
            if found and all(len(channels) == 1 for channels in found):
                return [channel for [channel] in found]
    return []


def _time_of(stream: Stream) -> str | None:
    if stream.time is not None:
        return None
    plain = _plain_names(stream)
    found = next((plain[name] for name in _NAMES["time"] if name in plain), None)
    if found is None:
        raise NoGuessError(stream.name or "table", "no channel is called as time is")
    return found


def _time_unit(stream: Stream) -> str:
    """Returns the unit of the time, by its name or how far apart its values are."""
    name = _time_of(stream)
    if name is None:
        return "s"
    if said := _name_and_unit(name)[1]:
        return said
    step = float(np.median(np.diff(stream.channels[name])))
    for unit, most in (("s", 0.5), ("ms", 500.0), ("us", 5e5)):
        if step < most:
            return unit
    return "ns"


def _names_of(channels: Sequence[str], joints: Sequence[str]) -> tuple[str, ...]:
    if joints:
        return tuple(joints)
    ends = [re.split(r"[.:]", name)[-1] for name in channels]
    if len(set(ends)) < len(ends) or all(end.isdigit() for end in ends):
        return tuple(f"joint_{i}" for i in range(len(channels)))
    return tuple(ends)


def _other_wrenches(source: Source, stream: Stream) -> dict[str, Column]:
    """Returns a wrench of another topic, as extra columns."""
    for other in source.streams:
        channels = _wrench_of(other) if other is not stream else None
        if channels:
            return {
                f"extra.{name}": Column((channel,))
                for name, channel in zip(_PLAIN_WRENCH, channels, strict=True)
            }
    return {}


def _wrench_of(stream: Stream) -> tuple[str, ...] | None:
    if not stream.name:
        return _PLAIN_WRENCH if set(_PLAIN_WRENCH) <= set(stream.names) else None
    for prefix in ("wrench.", ""):
        names = tuple(f"{stream.name}:{prefix}{end}" for end in _WRENCH)
        if set(names) <= set(stream.names):
            return names
    return None


def _static_wrench(source: Source) -> FieldMap:
    columns, time = dict[str, Column](), None
    for stream in source.streams:
        if wrench := _wrench_of(stream):
            columns["wrench"] = Column(wrench)
            time = _time_of(stream)
        for prefix in ("pose.", ""):
            ends = _QUATERNION if stream.name else _PLAIN_QUATERNION
            names = tuple(
                f"{stream.name}:{prefix}{e}" if stream.name else e for e in ends
            )
            if set(names) <= set(stream.names):
                columns["R_WS"] = Column(names)
    if len(columns) < 2:
        raise NoGuessError(
            source.path, "no channels are called as a wrench with an orientation is"
        )
    return FieldMap("static_wrench", columns, time, frames={"wrench": "S"})

"""Channels of wrenches and orientations, by what programs call their components."""

from collections.abc import Mapping, Sequence

from drake_disasm.logs.importing.field_map import Column
from drake_disasm.logs.importing.orientations import FORMS, USUAL
from drake_disasm.logs.importing.presets import Preset
from drake_disasm.logs.importing.stream import Stream
from drake_disasm.logs.importing.vocabulary import labels_of, numbered
from drake_disasm.logs.schema import WRENCH

_WRENCH = ("force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z")
_QUATERNION = ("orientation.w", "orientation.x", "orientation.y", "orientation.z")
_WRENCHES = (
    WRENCH,
    ("fx", "fy", "fz", "mx", "my", "mz"),
    ("force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z"),
)


def _with_axes(heads: Sequence[str], axes: str) -> list[tuple[str, ...]]:
    return [tuple(f"{head}{axis}" for axis in axes) for head in heads]


#: What the components of an orientation are called in a table, by its form.
_ORIENTATIONS: Mapping[str, Sequence[tuple[str, ...]]] = {
    USUAL: _with_axes(("q", "q_", "orientation_", "quat_", "quaternion_"), "wxyz"),
    "matrix": [
        tuple(f"{head}{i}{gap}{j}" for i in numbers for j in numbers)
        for head in ("r", "r_", "rot", "rot_")
        for gap in ("", "_")
        for numbers in ((1, 2, 3), (0, 1, 2))
    ],
    "rotation_vector": _with_axes(
        ("rotvec_", "rot_vec_", "rotation_vector_", "rvec_", "axis_angle_"), "xyz"
    ),
    "roll_pitch_yaw": [("roll", "pitch", "yaw")],
}
_UNCLEAR = ("rx", "ry", "rz")  # a rotation vector, or angles about axes


def wrench_of(
    stream: Stream, preset: Preset | None = None
) -> tuple[Column, str] | None:
    """Returns a stream's wrench and the frame that it is in, S where nothing is known.

    Args:
        stream: a topic or a table.
        preset: what wrote it, whose names come first.
    """
    names = preset.names.get("wrench", ()) if preset else ()
    own = tuple(x.channel for x in numbered(stream, names))
    if preset and len(own) == len(WRENCH):
        frame = preset.wrench_frame
        return Column(own, why=f"in {frame}, as {preset.about} has it"), frame
    channels = _vector_of(stream, ("wrench.", ""), _WRENCH, _WRENCHES)
    return (Column(channels), "S") if channels else None


def orientation_of(stream: Stream, preset: Preset | None = None) -> Column | None:
    """Returns a stream's orientation, in the form that the names say.

    Args:
        stream: a topic or a table.
        preset: what wrote it, whose names come first.
    """
    if preset and preset.pose_form:
        pose = tuple(x.channel for x in numbered(stream, preset.names["pose"]))
        if len(pose) == 3 + FORMS[preset.pose_form].channels:
            why = f"as {preset.about} has it"
            return Column(pose[3:], form=preset.pose_form, why=why)
    for form, ways in _ORIENTATIONS.items():
        fields = _QUATERNION if form == USUAL else ()
        if channels := _vector_of(stream, ("pose.", ""), fields, ways):
            return _in_form(stream, channels, form)
    return None


def unclear_angles(stream: Stream) -> tuple[str, ...] | None:
    """Returns a table's channels that may be a rotation vector or roll, pitch, yaw."""
    return _components(stream, [_UNCLEAR])


def _in_form(stream: Stream, channels: tuple[str, ...], form: str) -> Column:
    """Returns an orientation's column, with the unit and the reason that names say."""
    units = {x.unit for x in labels_of(stream) if x.channel in channels}
    unit = units.pop() if FORMS[form].has_angles and len(units) == 1 else ""
    words = form.partition("_wxyz")[0].replace("_", " ")
    return Column(channels, unit, form=form, why=f"its name says {words}")


def _vector_of(
    stream: Stream,
    prefixes: tuple[str, ...],
    fields: tuple[str, ...],
    ways: Sequence[tuple[str, ...]],
) -> tuple[str, ...] | None:
    """Returns the channels of a vector's components.

    Args:
        stream: a topic or a table.
        prefixes: of the fields in a topic's messages.
        fields: what they are called there; () where no message has them.
        ways: in which they are called in a table.
    """
    if not stream.name:
        return _components(stream, ways)
    for prefix in prefixes:
        names = tuple(f"{stream.name}:{prefix}{end}" for end in fields)
        if names and set(names) <= set(stream.names):
            return names
    return None


def _components(
    stream: Stream, ways: Sequence[tuple[str, ...]]
) -> tuple[str, ...] | None:
    """Returns a table's channels of a vector's components, in one of these ways.

    All of them may have the same before their names.
    """
    labels = {"_".join(x.tokens).lower(): x.channel for x in labels_of(stream)}
    for way in ways:
        heads = [name.removesuffix(way[0]) for name in labels if name.endswith(way[0])]
        found = [
            tuple(labels[f"{head}{end}"] for end in way)
            for head in heads
            if all(f"{head}{end}" in labels for end in way)
        ]
        if len(found) == 1:
            return found[0]
    return None

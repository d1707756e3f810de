"""What programs call the quantities of a recording, and how its names read."""

import dataclasses
import functools
import re
from collections.abc import Mapping, Sequence

import numpy as np

from drake_disasm.common.text import clipped
from drake_disasm.logs.importing.stream import Stream
from drake_disasm.logs.importing.units import UNITS

Names = Mapping[str, tuple[str, ...]]

#: What channels of a table are called, the more usual names first; a number may follow.
NAMES: Names = {
    "time": (
        "time", "t", "times", "timestamp", "stamp", "time_s", "seconds", "__time",
        "date", "datetime",
    ),
    "q": (
        "q", "qm", "position", "positions", "pos", "joint_position", "joint_positions",
        "joint_pos", "q_measured", "actual_q", "angle", "angles", "theta",
        "observation.state", "msr_pos", "q_msr", "actual.positions", "actual.position",
        "feedback.positions", "feedback.position",
    ),
    "tau": (
        "tau", "torque", "torques", "effort", "efforts", "joint_torque",
        "joint_torques", "joint_effort", "tau_measured", "actual_torque", "tau_j",
        "msr_trq", "force", "tau_msr", "tau_m", "actual.effort", "feedback.effort",
        "motor_torque", "motor_torques",
    ),
    "q_commanded": (
        "q_commanded", "q_cmd", "q_desired", "q_des", "q_d", "q_ref", "q_target",
        "goal_position", "goal_positions", "goal", "position_command", "command",
        "commanded_position", "desired_position", "target_position", "target_q",
        "reference", "setpoint", "action", "desired.positions", "desired.position",
        "reference.positions", "reference.position",
    ),
    "supply": ("supply", "input_volts", "supply_voltage", "voltage", "vin"),
    "enabled": ("enabled", "torque_enable", "enable", "motor_on"),
    "v": (
        "v", "qd", "dq", "velocity", "velocities", "vel", "joint_velocity", "speed",
        "joint_velocities", "actual_qd", "q_dot", "qdot",
    ),
    "vd": ("vd", "qdd", "ddq", "acceleration", "accelerations", "acc"),
    "order": ("order",),
    "current": ("current", "currents", "i", "actual_current", "motor_current",
        "target_current",
    ),
}  # fmt: skip
#: In what a quantity may be, where a unit stands behind its name.
_DIMENSIONS = {
    "time": ("time",),
    "q": ("angle", "length"),
    "q_commanded": ("angle", "length"),
    "tau": ("torque", "force"),
    "v": ("angular velocity", "velocity"),
    "current": ("current",),
}
_AXES = {("x",), ("y",), ("z",), ("w",)}
_ALONE = ("time", "order")  # nothing stands beside these
_BEFORE = "interface_values"  # before a joint's name in DynamicJointState

#: A joint's name, token by token.
Tokens = tuple[str, ...]


@dataclasses.dataclass(frozen=True)
class Label:
    """How a channel's name reads.

    Attributes:
        channel: its name in the recording.
        text: what metadata call it, without topic, unit and mark of a list.
        unit: behind it, in brackets or after an underscore, or "".
    """

    channel: str
    text: str
    unit: str

    @property
    def plain(self) -> str:
        """In small letters, with dots: "/joint_states/Motor position[0] [deg]" is
        "joint_states.motor_position[0]"."""
        return "_".join(self.text.lower().replace("/", ".").strip(".").split())

    @property
    def tokens(self) -> Tokens:
        """Its words."""
        words = tokens_of(self.text)
        before = tokens_of(_BEFORE)
        return words[len(before) :] if words[: len(before)] == before else words


def labels_of(stream: Stream) -> list[Label]:
    """Returns how the names of a stream's channels read."""
    texts = dict[str, str]()
    for name in stream.names:
        text = stream.labels.get(name, name).removeprefix(f"{stream.name}:")
        texts[name] = re.sub(r"^[-*•]\s+", "", text.strip())
    endings = dict[str, set[str]]()
    for text in texts.values():
        head, _, end = text.rpartition("_")
        endings.setdefault(head, set()).add(end)
    return [Label(n, *_text_and_unit(text, endings)) for n, text in texts.items()]


@functools.lru_cache(10_000)
def tokens_of(text: str) -> Tokens:
    """Returns the words of a name: "- Arm_1/joint" is ("Arm", "1", "joint")."""
    return tuple(word for word in re.split(r"[^0-9A-Za-z]+", text) if word)


def _text_and_unit(text: str, endings: Mapping[str, set[str]]) -> tuple[str, str]:
    """Returns a name, and the unit behind it, if it is known.

    In brackets it may be any; after an underscore one that the quantity may be in.

    Args:
        text: the name.
        endings: what stands behind the last underscore of names, by what stands before.
    """
    match = re.fullmatch(r"(.*?)[ _]*[\[(]([^\[\]()]+)[\])]", text)
    if match and match[2].strip() in UNITS and not match[2].strip().isdigit():
        return match[1], match[2].strip()
    head, _, end = text.rpartition("_")
    unit = _unit_at_end(head, end)
    # A letter may be a joint's: position_l, position_m.
    is_joint = len(end) == 1 and not all(
        _unit_at_end(head, each) for each in endings.get(head, ())
    )
    return (head, unit) if unit and not is_joint else (text, "")


def _unit_at_end(head: str, end: str) -> str:
    """Returns the unit that a name ends with, in which its quantity may be, or ""."""
    quantity = quantity_said(head, NAMES) if end else ""
    for unit, (dimension, _) in UNITS.items():
        is_same = end == unit or (len(end) > 1 and end.lower() == unit.lower())
        if is_same and dimension in _DIMENSIONS.get(quantity, ()):
            return unit
    return ""


def quantity_said(text: str, names: Names) -> str:
    """Returns the quantity that a name says, whatever number is behind it; or ""."""
    bare = re.sub(r"[._\[ ]?\d+\]?$", "", text)
    parts = (bare, re.split(r"[./]", bare)[-1])
    found = (read(Label(part, part, ""), names)[0] for part in parts)
    return next(filter(None, found), "")


def left_out_of(stream: Stream, quantity: str, names: Names) -> list[str]:
    """Returns what is left out of a stream though its name says a quantity, and why."""
    return [
        f"'{clipped(name)}' {why}"
        for name, why in stream.left_out.items()
        if quantity_said(name.removeprefix(f"{stream.name}:"), names) == quantity
    ]


def numbered(stream: Stream, usual: Sequence[str]) -> list[Label]:
    """Returns channels called NAME, or NAME0, NAME.0, NAME_0, NAME[0] ... in order.

    Or behind a prefix that all of them have and no others: field.NAME0.

    Args:
        stream: of them.
        usual: names of a quantity, of which the first that is there counts.
    """
    plain = dict[str, Label]()
    for label in labels_of(stream):
        plain.setdefault(label.plain, label)
    for name in usual:
        if name.lower() in plain:
            return [plain[name.lower()]]
        pattern = re.compile(rf"(|.*\.){re.escape(name.lower())}[._\[ ]?(\d+)\]?$")
        by_prefix = dict[str, dict[int, Label]]()
        for text, label in plain.items():
            if match := pattern.match(text):
                by_prefix.setdefault(match[1], {})[int(match[2])] = label
        if len(by_prefix) != 1 and "" not in by_prefix:
            continue
        found = by_prefix.get("") or next(iter(by_prefix.values()))
        if min(found) < 2 and max(found) == min(found) + len(found) - 1:
            return [found[i] for i in sorted(found)]
    return []


def named(stream: Stream, quantity: str, names: Names) -> dict[Tokens, list[Label]]:
    """Returns channels of a quantity whose names have a joint's beside it, by that.

    "arm_1_joint_position", "q_elbow" or "position.elbow"; the axes x, y, z, w are no
    joints, and numbers alone are `numbered`.
    """
    found = dict[Tokens, list[Label]]()
    for label in labels_of(stream):
        known, joint = read(label, names)
        if known != quantity or not joint or joint in _AXES or joint[0].isdigit():
            continue
        found.setdefault(joint, []).append(label)
    return found


def read(label: Label, names: Names) -> tuple[str, Tokens]:
    """Returns the quantity that a channel's name says, "" for none, and the rest of it.

    The quantity is at either end of it; of several the longest name counts, of two that
    are as long the one at the beginning.
    """
    _, dot, member = label.plain.rpartition(".")
    if dot and member in names.get("time", ()):
        return "time", ()  # of a structure
    words = label.tokens
    low = tuple(word.lower() for word in words)
    best, length, rest = "", 0.0, words
    for quantity, usual in names.items():
        for name in usual:
            own = tokens_of(name.lower())
            n = len(own)
            if not own or (quantity in _ALONE and own != low):
                continue
            if n >= length and low[:n] == own:
                best, length, rest = quantity, n + 0.5, words[n:]
            elif n > length and low[-n:] == own:
                # "arm_1_joint_position" is the position of arm_1_joint.
                cut = n - 1 if own[0] == "joint" else n
                best, length, rest = quantity, float(n), words[:-cut]
    if len(rest) > 1 and rest[-1].lower() == "pos":  # LeRobot's shoulder_pan.pos
        rest = rest[:-1]
    return best, rest


def matched(
    joints: Sequence[str], known: Sequence[Tokens]
) -> tuple[list[int], list[str]]:
    """Returns which of the known names is each joint's, and what is in the way.

    A name is a joint's if it is the same but for "joint", or if one of them ends with
    the other: what stands before is a prefix.

    Args:
        joints: names, of a URDF.
        known: of the recording, as `tokens_of`.

    Returns:
        numbers of the known names; () and reasons where a joint has none or several.
    """
    found, reasons = [], []
    for joint in joints:
        own = tokens_of(joint)
        same = [i for i, words in enumerate(known) if _bare(words) == _bare(own)]
        near = [i for i, words in enumerate(known) if _ends_alike(words, own)]
        either = same or near
        if len(either) == 1:
            found.append(either[0])
        elif either:
            names = " and ".join("_".join(known[i]) for i in either[:2])
            reasons.append(f"joint '{joint}' is matched twice, by {names}")
    if len(set(found)) < len(found):
        twice = next(i for i in found if found.count(i) > 1)
        reasons.append(f"'{'_'.join(known[twice])}' is matched by two joints")
    return found, reasons


def _bare(words: Tokens) -> Tokens:
    """Returns a name in small letters without "joint", but of "joint_1"."""
    low = _parted(words)
    bare = tuple(word for word in low if word != "joint")
    return bare if any(not word.isdigit() for word in bare) else low


def _parted(words: Tokens) -> Tokens:
    """Returns words in small letters, numbers apart: "Joint1" is ("joint", "1")."""
    return tuple(re.findall(r"\d+|[a-z]+", " ".join(words).lower()))


def _ends_alike(one: Tokens, other: Tokens) -> bool:
    """Whether one of two names ends with the other, with or without "joint"."""
    for a, b in ((_bare(one), _bare(other)), (_parted(one), _parted(other))):
        n = min(len(a), len(b))
        if n and a[-n:] == b[-n:] and not all(word.isdigit() for word in a[-n:]):
            return True
    return False


def is_alive(stream: Stream, channels: Sequence[str]) -> bool:
    """Whether any channel is not constant: an effort that nobody fills in is 0."""
    values = [stream.channels[name] for name in channels]
    return any(np.ptp(v[np.isfinite(v)]) > 0 for v in values if np.isfinite(v).any())

"""ROS 1 and ROS 2 bags and MCAP files, by rosbags; no ROS has to be installed."""

import collections
import dataclasses
from collections.abc import Iterator, Sized
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs.importing.stream import Stream, readable

_MOST_VALUES = 2**28
_NANO = 1e-9


def read_bag(path: Path) -> list[Stream]:
    """Reads every topic whose messages hold numbers.

    A field's channel is "topic:field.of.field"; of `sensor_msgs/JointState` and other
    messages that name joints "topic:position.JOINT", so that their order may change
    from message to message.

    Raises:
        DisasmError: rosbags is not installed, or the bag can't be read.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise DisasmError(
            f"{path}: reading bags needs rosbags; pip install 'drake_disasm[bags]'"
        ) from None
    store = get_typestore(Stores.LATEST)
    with readable(path), AnyReader([path], default_typestore=store) as reader:
        streams = [s for each in _by_topic(reader) for s in _streams(reader, each)]
    if not any(stream.channels for stream in streams):
        raise DisasmError(f"{path}: has no topic with messages of numbers")
    return streams


def _by_topic(reader: Any) -> Iterator[list[Any]]:
    """Yields the connections of each topic."""
    for topic in sorted({c.topic for c in reader.connections}):
        yield [c for c in reader.connections if c.topic == topic]


@dataclasses.dataclass
class _Messages:
    """Of one publisher on a topic, as columns."""

    kind: str
    rows: list[dict[str, float]] = dataclasses.field(default_factory=list)
    stamps: list[float] = dataclasses.field(default_factory=list)
    received: list[float] = dataclasses.field(default_factory=list)
    numbers: list[float] = dataclasses.field(default_factory=list)

    def add(self, row: dict[str, float], message: Any, received: float) -> None:
        """Adds a message.

        Args:
            row: numbers in it.
            message: with its header.
            received: when it was [s].
        """
        self.rows.append(row)
        self.received.append(received)
        header = getattr(message, "header", None)
        self.stamps.append(_stamp(message))
        self.numbers.append(float(getattr(header, "seq", np.nan)))

    def stream(self, topic: str, name: str) -> Stream:
        """Returns them as a stream.

        Args:
            topic: for its channels' names.
            name: of the stream; `topic`, if it has no other publishers of the same.
        """
        # What is in every message: the others can't be rows of one table.
        count = collections.Counter(n for row in self.rows for n in row)
        whole = {n for n, k in count.items() if k == len(self.rows)}
        names = [n for n in self.rows[0] if n in whole]
        out = {
            f"{name}:{n}": f"is in {k} of {len(self.rows)} messages"
            for n, k in count.items()
            if n not in whole
        }
        channels = {f"{name}:{n}": np.array([r[n] for r in self.rows]) for n in names}
        if not channels and not out:
            out = {name: "holds no numbers"}
        stamps, arrived = np.array(self.stamps), np.array(self.received)
        has_stamps = bool(np.isfinite(stamps).all() and (stamps > 0).all())
        sequence = np.array(self.numbers)
        counts = bool((np.diff(sequence) >= 1).all()) and len(sequence) > 1
        return Stream(
            name,
            channels,
            stamps if has_stamps else arrived,
            arrived,
            self.kind,
            left_out=out,
            sequence=sequence if counts else None,
        )


def _streams(reader: Any, connections: list[Any]) -> list[Stream]:
    """Returns a stream for each publisher of a topic, or a topic's one.

    Publishers are parted by the joints that their messages name. Those that name the
    same, or none, are parted by what the bag says of them (ROS 1), if they published at
    the same time; a node that was started again goes on with its stream.
    """
    topic = connections[0].topic
    parts = dict[tuple[str, tuple[str, ...]], _Messages]()
    count = 0
    for connection, when, raw in reader.messages(connections=connections):
        message = reader.deserialize(raw, connection.msgtype)
        key = (_publisher(connection), tuple(sorted(_joint_names(message))))
        row = dict(_numbers(message, ""))
        count += len(row)
        if count > _MOST_VALUES:
            raise DisasmError(f"topic {topic}: has more than {_MOST_VALUES} values")
        part = parts.setdefault(key, _Messages(connection.msgtype))
        part.add(row, message, when * _NANO)
    return _named(topic, _restarted(parts))


def _restarted(
    parts: dict[tuple[str, tuple[str, ...]], _Messages],
) -> list[_Messages]:
    """Returns the parts, those of nodes one after the other as one."""
    found = dict[tuple[str, ...], list[_Messages]]()
    for (_, joints), part in parts.items():
        same = found.setdefault(joints, [])
        if same and same[-1].received[-1] < part.received[0]:
            for field in ("rows", "stamps", "received", "numbers"):
                getattr(same[-1], field).extend(getattr(part, field))
        else:
            same.append(part)
    return [part for same in found.values() for part in same]


def _named(topic: str, parts: list[_Messages]) -> list[Stream]:
    """Returns streams that are called as the topic, or topic#2 where names collide."""
    found, used = list[Stream](), set[str]()
    for i, part in enumerate(parts):
        stream = part.stream(topic, topic)
        if used & set(stream.channels):
            stream = part.stream(topic, f"{topic}#{i + 1}")
        used |= set(stream.channels)
        found.append(stream)
    return found


def _publisher(connection: Any) -> str:
    return str(getattr(connection.ext, "callerid", None) or "")


def _stamp(message: Any) -> float:
    """Returns the time that a message's header carries [s]; NaN without a header."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    if stamp is None:
        return np.nan
    return float(stamp.sec + _NANO * stamp.nanosec)


def _numbers(value: Any, name: str) -> Iterator[tuple[str, float]]:
    """Yields name and value of all numbers in a message, its header left out."""
    names = _joint_names(value)
    for field in getattr(value, "__dataclass_fields__", {}):
        if field in ("header", "__msgtype__"):
            continue
        child, path = getattr(value, field), f"{name}.{field}" if name else field
        yield from _of_field(child, path, names)


def _joint_names(value: Any) -> list[str]:
    """Returns the joints that a message names, or the interfaces of one of them."""
    for field in ("name", "joint_names", "interface_names"):
        names = getattr(value, field, None)
        if isinstance(names, list) and names:
            return [str(name) for name in names]
    return []


def _of_field(child: Any, path: str, names: list[str]) -> Iterator[tuple[str, float]]:
    if isinstance(child, bool | int | float | np.number):
        yield path, float(child)
    elif isinstance(child, np.ndarray) and child.dtype.kind in "fiub":
        yield from zip(_paths(path, child, names), child.tolist(), strict=True)
    elif (
        isinstance(child, list) and child and hasattr(child[0], "__dataclass_fields__")
    ):
        # DynamicJointState has each joint's interfaces in a message of their own.
        for own, each in zip(_paths(path, child, names), child, strict=True):
            yield from _numbers(each, own)
    elif hasattr(child, "__dataclass_fields__"):
        # JointTrajectoryControllerState has its points' joints beside them.
        inner = dict(_numbers(child, path))
        if names:
            inner = {_with_joint(key, names): value for key, value in inner.items()}
        yield from inner.items()


def _paths(path: str, items: Sized, names: list[str]) -> list[str]:
    """Returns the path of each item, with its joint's name or its number."""
    ends = names if len(names) == len(items) else map(str, range(len(items)))
    return [f"{path}.{end}" for end in ends]


def _with_joint(key: str, names: list[str]) -> str:
    head, _, last = key.rpartition(".")
    is_index = last.isdigit() and int(last) < len(names)
    return f"{head}.{names[int(last)]}" if is_index else key

"""ROS 1 and ROS 2 bags and MCAP files, by rosbags; no ROS has to be installed."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.importing.stream import Stream, readable

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
        found = [_stream(reader, each) for each in _by_topic(reader)]
    streams = [stream for stream in found if stream is not None]
    if not streams:
        raise DisasmError(f"{path}: has no topic with messages of numbers")
    return streams


def _by_topic(reader: Any) -> Iterator[list[Any]]:
    """Yields the connections of each topic."""
    for topic in sorted({c.topic for c in reader.connections}):
        yield [c for c in reader.connections if c.topic == topic]


def _stream(reader: Any, connections: list[Any]) -> Stream | None:
    """Returns a topic's stream; None if its messages hold no numbers."""
    topic, kind = connections[0].topic, connections[0].msgtype
    rows, stamps, received = [], [], []
    count = 0
    for connection, when, raw in reader.messages(connections=connections):
        message = reader.deserialize(raw, connection.msgtype)
        row = dict(_numbers(message, ""))
        if not row:
            return None
        rows.append(row)
        count += len(row)
        if count > _MOST_VALUES:
            raise DisasmError(f"topic {topic}: has more than {_MOST_VALUES} values")
        received.append(when * _NANO)
        stamps.append(_stamp(message))
    # What is in every message: the others can't be rows of one table.
    first = rows[0] if rows else {}
    names = [name for name in first if all(name in row for row in rows)]
    if not names:
        return None
    channels = {f"{topic}:{n}": np.array([row[n] for row in rows]) for n in names}
    arrived = np.array(received)
    stamped = np.array([np.nan if s is None else s for s in stamps])
    has_stamps = bool(np.isfinite(stamped).all() and (stamped > 0).all())
    return Stream(topic, channels, stamped if has_stamps else arrived, arrived, kind)


def _stamp(message: Any) -> float | None:
    """Returns the time that a message's header carries [s]; None without a header."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    if stamp is None:
        return None
    return float(stamp.sec + _NANO * stamp.nanosec)


def _numbers(value: Any, name: str) -> Iterator[tuple[str, float]]:
    """Yields name and value of all numbers in a message, its header left out."""
    joints = getattr(value, "name", None) or getattr(value, "joint_names", None)
    names = [str(joint) for joint in joints] if isinstance(joints, list) else []
    for field in getattr(value, "__dataclass_fields__", {}):
        if field in ("header", "__msgtype__"):
            continue
        child, path = getattr(value, field), f"{name}.{field}" if name else field
        yield from _of_field(child, path, names)


def _of_field(child: Any, path: str, names: list[str]) -> Iterator[tuple[str, float]]:
    if isinstance(child, bool | int | float | np.number):
        yield path, float(child)
    elif isinstance(child, np.ndarray) and child.dtype.kind in "fiub":
        ends = (
            names if len(names) == len(child) else [str(i) for i in range(len(child))]
        )
        yield from zip((f"{path}.{end}" for end in ends), child.tolist(), strict=True)
    elif hasattr(child, "__dataclass_fields__"):
        # JointTrajectoryControllerState has its points' joints beside them.
        inner = dict(_numbers(child, path))
        if names:
            inner = {_with_joint(key, names): value for key, value in inner.items()}
        yield from inner.items()


def _with_joint(key: str, names: list[str]) -> str:
    head, _, last = key.rpartition(".")
    is_index = last.isdigit() and int(last) < len(names)
    return f"{head}.{names[int(last)]}" if is_index else key

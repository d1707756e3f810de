"""A ROS 2 bag with what real ones have: jitter, lost messages, clocks that differ."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

_BEGIN = 1.7e9  # s since 1970
_NANO = 1e-9
_TRANSPORT = 0.0005  # s from stamp to receipt


def bag_times(
    random: np.random.Generator,
    duration: float,
    rate: float,
    jitter: float = 0.1,
    lost: float = 0.02,
) -> np.ndarray:
    """Returns times (n,) [s] of messages, as drivers and networks leave them.

    Args:
        random: draws them.
        duration: [s].
        rate: nominal [Hz].
        jitter: width of the uniform distribution about each, in periods.
        lost: share of the messages that do not arrive.
    """
    count = round(duration * rate)
    times = (np.arange(count) + jitter * random.uniform(-0.5, 0.5, count)) / rate
    return np.asarray(times[random.random(count) >= lost])


class FakeBag:
    """Collects messages and writes them as a bag. Needs rosbags.

    Times are counted from the begin of the bag [s].
    """

    def __init__(self) -> None:
        """Begins an empty one."""
        from rosbags.typesys import Stores, get_typestore

        self._store = get_typestore(Stores.LATEST)
        self._messages: list[tuple[str, float, Any]] = []

    def add_joint_state(
        self, time: float, names: Sequence[str], q: np.ndarray, tau: np.ndarray
    ) -> None:
        """Adds positions and efforts (n,) of joints to /joint_states; no velocities."""
        kind = self._store.types["sensor_msgs/msg/JointState"]
        values = (np.array(q), np.zeros(0), np.array(tau))
        message = kind(self._header(time), list(names), *values)
        self._messages.append(("/joint_states", time, message))

    def add_wrench(self, time: float, wrench: np.ndarray) -> None:
        """Adds a wrench (6,) to /ft: force [N], then torque [N m]."""
        types = self._store.types
        vector = types["geometry_msgs/msg/Vector3"]
        both = vector(*wrench[:3]), vector(*wrench[3:])
        value = types["geometry_msgs/msg/Wrench"](*both)
        kind = types["geometry_msgs/msg/WrenchStamped"]
        self._messages.append(("/ft", time, kind(self._header(time), value)))

    def write(self, folder: Path, mcap: bool = True) -> None:
        """Writes the bag.

        Args:
            folder: of the bag; it must not be there.
            mcap: whether its file is MCAP, rather than SQLite.
        """
        from rosbags.rosbag2 import StoragePlugin, Writer

        plugin = StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3
        folder.parent.mkdir(parents=True, exist_ok=True)
        with Writer(folder, version=9, storage_plugin=plugin) as writer:
            topics: dict[str, Any] = {}
            for topic, time, message in sorted(self._messages, key=lambda m: m[1]):
                kind = message.__msgtype__
                if topic not in topics:
                    topics[topic] = writer.add_connection(
                        topic, kind, typestore=self._store
                    )
                raw = self._store.serialize_cdr(message, kind)
                received = round((_BEGIN + time + _TRANSPORT) / _NANO)
                writer.write(topics[topic], received, raw)

    def _header(self, time: float) -> Any:
        types, seconds = self._store.types, int(_BEGIN + time)
        nano = round((_BEGIN + time - seconds) / _NANO)
        stamp = types["builtin_interfaces/msg/Time"](seconds, nano)
        return types["std_msgs/msg/Header"](stamp, "base")

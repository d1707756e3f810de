"""How programs that many people record with write their recordings."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs.importing.field_map import Column
from drake_disasm.logs.importing.source import Source
from drake_disasm.logs.importing.stream import LARGEST, Stream
from drake_disasm.logs.importing.units import NORMALISED
from drake_disasm.logs.importing.vocabulary import NAMES, Names, numbered

Array = NDArray[np.float64]

_UR_JOINTS = (
    *("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"),
    *("wrist_1_joint", "wrist_2_joint", "wrist_3_joint"),
)


@dataclasses.dataclass(frozen=True)
class Preset:
    """A program that records.

    Attributes:
        name: of the preset.
        about: whose recordings these are.
        names: what it calls the quantities.
        time_unit: of its times; "" where that differs.
        units: of its quantities, where not SI.
        signs: of its quantities, where not the URDF's.
        joints: that it numbers, from the base; () where that differs.
        layout: of a table without names: the time, then these for each joint.
        has_currents: whether its torques may be motor currents.
        pose_form: of the orientation behind x, y, z in its "pose", or "".
        wrench_frame: in which its "wrench" is.
    """

    name: str
    about: str
    names: Names
    time_unit: str = ""
    units: Mapping[str, str] = dataclasses.field(default_factory=dict)
    signs: Mapping[str, float] = dataclasses.field(default_factory=dict)
    joints: tuple[str, ...] = ()
    layout: tuple[str, ...] = ()
    has_currents: bool = False
    pose_form: str = ""
    wrench_frame: str = "S"

    @property
    def all_names(self) -> Names:
        """What quantities are called, those that it does not have as usual."""
        return {**NAMES, **self.names}

    def labelled(self, source: Source) -> Source:
        """Returns a recording, a table without names with those of the layout.

        Raises:
            DisasmError: its columns are not those of the layout.
        """
        if not self.layout:
            return source
        streams = tuple(self._labelled(s, source) for s in source.streams)
        return dataclasses.replace(source, streams=streams)

    def _labelled(self, stream: Stream, source: Source) -> Stream:
        names = stream.names
        if not stream.is_unnamed or stream.left_out:
            return stream
        count = len(self.joints)
        blocks, rest = divmod(len(names) - 1, count)
        if rest or not 2 <= blocks <= len(self.layout):
            raise DisasmError(
                f"{source.path}: preset '{self.name}' does not fit: of a table without "
                f"names it knows the time and {count} columns each of "
                f"{', '.join(self.layout)}, and this one has {len(names)} columns; "
                "write a map"
            )
        texts = [f"{name}_{i}" for name in self.layout[:blocks] for i in range(count)]
        labels = dict(zip(names, [self.names["time"][0], *texts], strict=True))
        found = dataclasses.replace(stream, labels=labels)
        self._check_velocities(found, source)
        return found

    def _check_velocities(self, stream: Stream, source: Source) -> None:
        """Refuses a layout whose velocities are not those of its positions."""
        columns = list(stream.channels.values())
        count = len(self.joints)
        time = columns[0]
        q, v = (np.stack(columns[1 + k : 1 + k + count], 1) for k in (0, count))
        whole = np.asarray((np.abs(np.stack(columns, 1)) < LARGEST).all(axis=1))
        if not whole.any():
            return
        is_moving = (np.ptp(q[whole], axis=0) > 0) & (np.ptp(v[whole], axis=0) > 0)
        moving = np.flatnonzero(is_moving)
        step = time[2:] - time[:-2]
        rows = np.asarray(whole[2:] & whole[1:-1] & whole[:-2] & (step > 0))
        slope = (q[2:] - q[:-2])[rows] / step[rows, None]
        for i in moving if len(slope) > 1 else ():
            shared = [_correlation(slope[:, i], v[1:-1][rows, k]) for k in moving]
            if max(shared) <= 0.0 or moving[int(np.argmax(shared))] != i:
                raise DisasmError(
                    f"{source.path}: preset '{self.name}' does not fit: column "
                    f"{1 + count + i} is not the velocity of column {1 + i}; write a "
                    "map"
                )

    def adapted(self, quantity: str, column: Column, stream: Stream) -> Column:
        """Returns a column with this program's unit and sign.

        Args:
            quantity: of the column.
            column: of this program's channels.
            stream: of them.
        """
        if quantity in self.units and not column.unit:
            column = dataclasses.replace(column, unit=self.units[quantity])
        if quantity in self.signs:
            scales = (self.signs[quantity],) * len(column.channels)
            column = dataclasses.replace(column, scales=scales)
        if self.has_currents and quantity == "tau":
            column = _currents(column, stream)
        return column


def _correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Returns the correlation of two vectors; 0 if one is constant."""
    if not (np.ptp(one) > 0 and np.ptp(other) > 0):
        return 0.0
    with np.errstate(all="ignore"):
        found = float(np.corrcoef(one, other)[0, 1])
    return found if np.isfinite(found) else 0.0


def _currents(column: Column, stream: Stream) -> Column:
    """Returns torques that a UR recorded as motor currents [A].

    Where the controller's target current and moment are there, too, its own motor
    constants are known; they may differ from the robot's by some per cent.
    """
    labels = [stream.labels.get(name, name) for name in column.channels]
    if not all("current" in text and "torque" not in text for text in labels):
        return column
    found = dataclasses.replace(column, unit="A")
    names = ("target_current", "target_moment", "actual_qd")
    parts = [[x.channel for x in numbered(stream, (name,))] for name in names]
    if any(len(part) != len(column.channels) for part in parts):
        return found
    constants = [
        _motor_constant(*(stream.channels[name] for name in joint))
        for joint in zip(*parts, strict=True)
    ]
    if not all(constants):
        return found
    scales = tuple(float(f"{constant:.4g}") for constant in constants)
    return dataclasses.replace(found, scales=scales)


def _motor_constant(current: Array, moment: Array, v: Array) -> float:
    """Returns a joint's motor constant k [N m/A] in a UR's controller; 0 if unknown.

    Its target current is i = tau / k + a + b v + c sign(v) + d dv/dt: of the moment
    that rigid bodies need, with friction and the rotor beside it. k is known if 1 / k
    is above two standard errors of the least squares.

    Args:
        current, moment, v: (n,) target current [A] and moment [N m], and velocity.
    """
    basis = np.stack(
        [moment, np.ones_like(v), v, np.sign(v), np.gradient(v)] if len(v) > 1 else [v],
        axis=1,
    )
    whole = (np.abs(basis) < LARGEST).all(axis=1) & (np.abs(current) < LARGEST)
    basis, current = basis[whole], current[whole]
    spare = len(current) - basis.shape[1]
    if spare < 1 or np.ptp(moment[whole]) == 0.0:
        return 0.0
    covariance = np.linalg.pinv(basis.T @ basis)
    factors = covariance @ basis.T @ current
    noise = np.sum((current - basis @ factors) ** 2) / spare
    is_known = factors[0] > 2.0 * np.sqrt(max(noise * covariance[0, 0], 0.0)) > 0.0
    return float(1.0 / factors[0]) if is_known else 0.0


_ALL = (
    Preset(
        "rtde",
        "RTDE of Universal Robots",
        {
            "time": ("timestamp", "time"),
            "q": ("actual_q",),
            "v": ("actual_qd",),
            "tau": (*("actual_current_as_torque", "joint_torque", "actual_current"),),
            "q_commanded": ("target_q",),
            "pose": ("actual_tcp_pose",),
            "wrench": ("actual_tcp_force",),
        },
        "s",
        joints=_UR_JOINTS,
        layout=(
            *("actual_q", "actual_qd", "actual_current"),
            *("target_current", "target_moment"),
        ),
        has_currents=True,
        pose_form="rotation_vector",
        wrench_frame="W",  # at the TCP, in the base's axes
    ),
    Preset(
        "fri",
        "KUKA's FRI: pyfri, lbr_fri_ros2_stack, scripts",
        {
            "time": ("time", "t", "timestamp"),
            "q": (
                *("measured_joint_position", "measuredjointposition", "mp"),
                *("msr_pos", "q_msr", "q"),
            ),
            "tau": (
                *("measured_torque", "measuredtorque", "mt", "msr_trq", "tau_msr"),
                "tau",
            ),
            "q_commanded": (
                *("commanded_joint_position", "ipo_joint_position", "ip", "cmd_pos"),
            ),
        },
        signs={"tau": -1.0},
    ),
    Preset(
        "libfranka",
        "libfranka's records (logToCSV) and franka_ros",
        {
            "time": ("time", "duration"),
            "q": ("state.q", "q"),
            "tau": ("state.tau_j", "tau_j"),
            "q_commanded": ("state.q_d", "q_d"),
            "v": ("state.dq", "dq"),
        },
        "ms",
    ),
    Preset(
        "ros2_control",
        "joint_state_broadcaster and controllers' states",
        {
            "q": (
                *("position", "actual.positions", "feedback.positions"),
                *("actual.position", "feedback.position"),
            ),
            "tau": ("effort", "actual.effort", "feedback.effort"),
            "q_commanded": (
                *("desired.positions", "reference.positions"),
                *("desired.position", "reference.position"),
            ),
        },
    ),
    Preset(
        "lerobot",
        "LeRobot's datasets in its normalised units",
        {
            "time": ("timestamp",),
            "q": ("observation.state",),
            "q_commanded": ("action",),
        },
        "s",
        units={"q": NORMALISED, "q_commanded": NORMALISED},
    ),
    Preset(
        "matlab",
        "MATLAB's structures, Simulink's outputs",
        {
            "time": ("tout", "time", "t"),
            "q": (
                *("q", "qm", "q_meas", "q_raw", "pos", "q.signals.values", "q.data"),
                *("theta", "position", "positions"),
            ),
            "tau": (
                *("tau", "tau_meas", "tau_raw", "t_raw", "torque", "torques"),
                *("tau.signals.values", "tau.data", "effort"),
            ),
            "q_commanded": ("q_d", "qd_des", "q_ref", "q_des", "q_cmd"),
        },
    ),
)

#: By name.
PRESETS: Mapping[str, Preset] = {preset.name: preset for preset in _ALL}

"""Guards: each looks at the situation and names what must stop the robot, if anything.

A guard is a function of the situation alone, so that each is tested by itself and a
station can have more of them.
"""

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np
from pydrake.math import RigidTransform

from drake_disasm.common.ports import Health
from drake_disasm.devices.reading import Reading
from drake_disasm.safety.lag import Lag
from drake_disasm.safety.limits import SafetyConfig


@dataclasses.dataclass(frozen=True)
class Situation:
    """What is known when a command is about to be sent.

    Attributes:
        now: by the devices' clock [s].
        overdue: by how much a stall has made the command late [s].
        since_sent: since the last command left, one control period at most [s].
        q_wanted: (7,) what the diagram wants [rad].
        q_measured: (7,) [rad].
        q_before: (7,) what was measured at the last command; NaN before the first.
        X_GB: the bolt, as measured.
        load: (6,) [f; tau] on the bolt at Bo in the sensor's axes, zeroed; None
            while the sensor has not been zeroed.
        readings: of each device.
        lag: how far the diagram fell behind of late.
        foreign: why somebody else commands the arm; empty if nobody does.
    """

    now: float
    overdue: float
    since_sent: float
    q_wanted: np.ndarray
    q_measured: np.ndarray
    q_before: np.ndarray
    X_GB: RigidTransform
    load: np.ndarray | None
    readings: Mapping[str, Reading]
    lag: Lag = dataclasses.field(default_factory=Lag)
    foreign: str = ""


#: Returns why the robot must not go on; empty if it may.
Guard = Callable[[Situation], str]

_STOOD_STILL = "the program stood still; give it a machine of its own"
_REMEDY = {
    Health.NO_DATA: "has sent nothing yet",
    Health.STALE: "has stopped sending",
}


def guards(
    limits: SafetyConfig,
    q_low: np.ndarray,
    q_high: np.ndarray,
    allowed_lead: np.ndarray,
) -> tuple[Guard, ...]:
    """Returns the guards of a station, in the order in which they are asked.

    Args:
        limits: of the station.
        q_low, q_high: (7,) of the joints [rad].
        allowed_lead: (7,) see `SafetyConfig.allowed_lead` [rad].
    """
    margin = limits.joint_margin
    return (
        lambda s: devices_ready(s, limits),
        one_master,
        finite,
        lambda s: no_jump(s, limits.max_jump),
        lambda s: in_time(s, limits.late_command),
        lambda s: keeps_up(s, limits.max_lag),
        lambda s: within_joints(s, q_low + margin, q_high - margin),
        lambda s: near_measured(s, allowed_lead),
        lambda s: within_workspace(s, limits),
        lambda s: gentle(s, limits),
    )


def devices_ready(s: Situation, limits: SafetyConfig) -> str:
    """Every device sends, and complains of nothing."""
    for name, reading in s.readings.items():
        health = reading.health(s.now, limits.stale_after(name))
        if health is Health.ERROR:
            return f"{name}: {reading.error}"
        if health is not Health.READY:
            age = reading.age(s.now)
            since = f" for {age:.3f} s" if np.isfinite(age) else ""
            return f"{name} {_REMEDY[health]}{since}; check its power and cable"
    return ""


def one_master(s: Situation) -> str:
    """Nobody else commands the arm."""
    return s.foreign


def finite(s: Situation) -> str:
    """Nothing that is measured or wanted is NaN."""
    values = {"iiwa.position": s.q_wanted, "iiwa.position_measured": s.q_measured}
    if s.load is not None:
        values["ft_sensor.wrench"] = s.load
    bad = [name for name, value in values.items() if not np.isfinite(value).all()]
    return f"{bad[0]} is not finite; see what sends it" if bad else ""


def no_jump(s: Situation, limit: float) -> str:
    """The arm is about where it was a moment ago."""
    joint, way = _largest(s.q_measured - s.q_before)
    if not way > limit:  # NaN before the first look
        return ""
    return f"joint {joint} jumped by {way:.3f} rad; check the arm's status messages"


def in_time(s: Situation, limit: float) -> str:
    """Nothing in the diagram took too long at once."""
    if s.overdue <= limit:
        return ""
    part, took = s.lag.slowest
    who = f"{part} took {took:.3f} s" if took > s.overdue / 2 else _STOOD_STILL
    return f"the command is {s.overdue:.3f} s late: {who}"


def keeps_up(s: Situation, limit: float) -> str:
    """The diagram is not late by habit."""
    if s.lag.slipped <= limit:
        return ""
    return (
        f"the diagram lost {s.lag.slipped:.2f} s within {s.lag.window:.2f} s, it is "
        f"too slow; of its time take: {s.lag.shares_in_words}"
    )


def within_joints(s: Situation, low: np.ndarray, high: np.ndarray) -> str:
    """What is wanted is within the joints' limits, with a margin."""
    joint, way = _largest(np.maximum(low - s.q_wanted, s.q_wanted - high), signed=True)
    if way <= 0.0:
        return ""
    return f"joint {joint} is sent {way:.3f} rad into its limit's margin"


def near_measured(s: Situation, limit: np.ndarray) -> str:
    """What is wanted is near where the arm is: it follows, and nothing leaps."""
    way = np.abs(s.q_wanted - s.q_measured)
    joint, beyond = _largest(way - limit, signed=True)
    if beyond <= 0.0:
        return ""
    return (
        f"joint {joint} is sent {way[joint - 1]:.3f} rad from where it is, "
        f"{limit[joint - 1]:.3f} are allowed; it does not follow"
    )


def within_workspace(s: Situation, limits: SafetyConfig) -> str:
    """The bolt is where the task has any business, with a margin."""
    p, margin = s.X_GB.translation(), limits.workspace_margin
    low = np.array(limits.workspace_low) + margin
    high = np.array(limits.workspace_high) - margin
    axis = int(np.argmax(np.maximum(low - p, p - high)))
    if low[axis] <= p[axis] <= high[axis]:
        return ""
    where = f"{'xyz'[axis]} = {1e3 * p[axis]:.1f} mm"
    return f"the bolt leaves the workspace at {where}; see safety.workspace_*"


def gentle(s: Situation, limits: SafetyConfig) -> str:
    """The load is less than the gripper takes."""
    if s.load is None:
        return ""
    force, torque = float(np.linalg.norm(s.load[:3])), s.load[3:]
    found = [
        ("force", force, limits.max_force, "N"),
        ("torque", float(np.linalg.norm(torque[:2])), limits.max_torque_xy, "N m"),
        ("torque about z", float(abs(torque[2])), limits.max_torque_z, "N m"),
    ]
    for name, value, limit, unit in found:
        if value > limit:
            return f"{name} {value:.1f} {unit} on the gripper, {limit:g} are allowed"
    return ""


def _largest(difference: np.ndarray, signed: bool = False) -> tuple[int, float]:
    """Returns which joint, from 1, and by how much."""
    size = difference if signed else np.abs(difference)
    index = int(np.argmax(size))
    return index + 1, float(size[index])

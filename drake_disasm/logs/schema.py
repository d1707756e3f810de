"""The log format as data: the kinds of log, their quantities, columns and frames.

`docs/reference/log-format.md` says the same in prose; a test holds the two together.
Frames: W world (z up), G groove (nominal), B bolt, S sensor; Bo, So their origins.
"""

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

SCHEMA = "drake_disasm/log/1"
SI_UNITS: Mapping[str, str] = MappingProxyType(
    {"time": "s", "length": "m", "angle": "rad", "force": "N", "torque": "N·m"}
)
UNIT_SPELLINGS: Mapping[str, str] = MappingProxyType(
    {"N*m": "N·m", "Nm": "N·m", "N m": "N·m"}
)
#: The greatest magnitude of a value, by its unit: far beyond any cell, and below what
#: a damaged file gives.
GREATEST: Mapping[str, float] = MappingProxyType(
    {
        "s": 1e11,  # 3000 years, so that time may be counted from 1970
        "m": 1e4,
        "rad": 1e6,
        "rad/s": 1e6,
        "rad/s\N{SUPERSCRIPT TWO}": 1e9,  # differentiated at some kHz
        "V": 1e6,
        "A": 1e6,
        "N": 1e7,
        "N\N{MIDDLE DOT}m": 1e7,
        "1": 1e20,  # order may be nanoseconds since 1970
        "any": math.inf,
    }
)
MOST_COLUMNS = 10_000
MOST_CELLS = 2 * 10**8  # of a table: 1.6 GB

POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
QUATERNION = POSE[3:]
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
MOTION = ("dx", "dy", "dz", "du", "dv", "dw")


class Form(enum.Enum):
    """How the columns of a quantity are named."""

    SCALAR = "<name>"
    VECTOR = "<name>.<component>, components as declared"
    JOINTS = "<name>.<i>, i = 0 ... joints - 1"
    TERMS = "<name>.<anything>"


class Rule(enum.Enum):
    """Whether a key of `log.yaml` has to be there for a kind."""

    REQUIRED = "required"
    OPTIONAL = "optional"
    FORBIDDEN = "forbidden"


@dataclass(frozen=True)
class Quantity:
    """One quantity of a table: a column, or several that belong together.

    Attributes:
        name: its name; columns are `name` or `name.<component>`.
        unit: unit of every component, in the order of the components where they
            differ; "1" for pure numbers.
        meaning: what it is, on which body, at which point, at what time.
        frames: the frames in which it may be expressed; empty for none. Where
            there are several, `log.yaml` states which.
        form: how its columns are named.
        components: names of a VECTOR's components, in order.
        required: whether each table must hold it.
        boolean: whether it is true or false, rather than a float64.
        increasing: whether it must increase strictly from row to row.
        of_step: whether it belongs to the step that starts at its row, so that it
            must be 0 in an episode's last row.
    """

    name: str
    unit: str
    meaning: str
    frames: tuple[str, ...] = ()
    form: Form = Form.SCALAR
    components: tuple[str, ...] = ()
    required: bool = True
    boolean: bool = False
    increasing: bool = False
    of_step: bool = False

    def greatest(self, number: int) -> float:
        """The greatest magnitude of its column of that number, in its unit."""
        return GREATEST[self.unit_of(number)]

    def unit_of(self, number: int) -> str:
        """The unit of a column; the second of two begins with the fourth."""
        first, _, second = self.unit.partition(", ")
        return second if second and number >= 3 else first

    @property
    def is_rotation(self) -> bool:
        """Whether it holds a unit quaternion; its monogram then names its frames."""
        return "qw" in self.components

    @property
    def frame_is_stated(self) -> bool:
        """Whether `log.yaml` must state its frame under `frames`."""
        return bool(self.frames) and self.required and not self.is_rotation


@dataclass(frozen=True)
class Kind:
    """One kind of log.

    Attributes:
        name: the value of `kind` in `log.yaml`.
        quantities: what a table may hold, in the order of its columns.
        keys: rule for the keys `period`, `joints`, `urdf` and `drive` of
            `log.yaml`.
        one_of: quantities of which a table must hold at least one.
        min_rows: the least number of rows of a table.
    """

    name: str
    quantities: tuple[Quantity, ...]
    keys: Mapping[str, Rule] = field(default_factory=dict)
    one_of: tuple[str, ...] = ()
    min_rows: int = 1

    def quantity(self, name: str) -> Quantity | None:
        """The quantity of that name, or None."""
        return next((q for q in self.quantities if q.name == name), None)

    def needs(self, name: str) -> bool:
        """Whether each table must hold the quantity of that name."""
        quantity = self.quantity(name)
        return quantity is not None and quantity.required

    @property
    def boolean_columns(self) -> frozenset[str]:
        """The names of the columns that hold true or false."""
        return frozenset(q.name for q in self.quantities if q.boolean)


def _vector(
    name: str,
    components: tuple[str, ...],
    unit: str,
    frames: str,
    meaning: str,
    required: bool = True,
    of_step: bool = False,
) -> Quantity:
    return Quantity(
        name=name,
        unit=unit,
        meaning=meaning,
        frames=tuple(frames),
        form=Form.VECTOR,
        components=components,
        required=required,
        of_step=of_step,
    )


def _joints(name: str, unit: str, meaning: str, required: bool = False) -> Quantity:
    return Quantity(name, unit, meaning, form=Form.JOINTS, required=required)


def _flag(name: str, meaning: str) -> Quantity:
    return Quantity(name, "1", meaning, boolean=True)


def _time(name: str, unit: str, meaning: str, required: bool = True) -> Quantity:
    return Quantity(name, unit, meaning, required=required, increasing=True)


_POSE_UNIT = "m, 1"
_WRENCH_UNIT = "N, N·m"
_MOTION_UNIT = "m, rad"
_EXTRA = Quantity(
    "extra",
    "any",
    "anything else that was recorded (a temperature, say); read, not interpreted",
    form=Form.TERMS,
    required=False,
)

TRANSITIONS = Kind(
    name="transitions",
    quantities=(
        _time("time", "s", "when the row's observation was made"),
        _vector(
            "X_GB_measured",
            POSE,
            _POSE_UNIT,
            "G",
            "measured pose of the bolt B in the groove's nominal frame G",
        ),
        _vector(
            "X_GB_commanded",
            POSE,
            _POSE_UNIT,
            "G",
            "pose target of the bolt in force at `time`, before the row's action",
        ),
        _vector(
            "wrench",
            WRENCH,
            _WRENCH_UNIT,
            "G",
            "processed wrench that the environment exerts on the bolt, at Bo",
        ),
        _vector(
            "action",
            MOTION,
            _MOTION_UNIT,
            "G",
            "action commanded by the policy, without imprecision: translation and "
            "rotation vector",
            of_step=True,
        ),
        _vector(
            "action_executed",
            MOTION,
            _MOTION_UNIT,
            "G",
            "the action after imprecision, as it was executed",
            required=False,
            of_step=True,
        ),
        _vector(
            "ft_sensor",
            WRENCH,
            _WRENCH_UNIT,
            "S",
            "raw reading, not tared: wrench that the load exerts on the sensor, at So",
        ),
        _joints("q", "rad", "joint positions (none where there is no arm)"),
        Quantity(
            "reward",
            "1",
            "one term of the reward that the row's step earned",
            form=Form.TERMS,
            required=False,
            of_step=True,
        ),
        _EXTRA,
        _flag("terminated", "the episode ended here by success or failure"),
        _flag(
            "truncated",
            "the episode ended here by a limit, such as its steps, or was cut off",
        ),
    ),
    keys={
        "period": Rule.REQUIRED,
        "joints": Rule.OPTIONAL,
        "urdf": Rule.OPTIONAL,
        "drive": Rule.FORBIDDEN,
    },
    min_rows=2,
)

STATIC_WRENCH = Kind(
    name="static_wrench",
    quantities=(
        _time("order", "1", "order of measurement, any increasing numbers", False),
        _time("time", "s", "when the reading was made", False),
        _vector(
            "R_WS",
            QUATERNION,
            "1",
            "W",
            "orientation of the sensor S in the world W (z up), at rest",
        ),
        _vector(
            "wrench",
            WRENCH,
            _WRENCH_UNIT,
            "SW",
            "raw reading: wrench that the load exerts on the sensor, at So",
        ),
        _EXTRA,
    ),
    keys={
        "period": Rule.FORBIDDEN,
        "joints": Rule.FORBIDDEN,
        "urdf": Rule.FORBIDDEN,
        "drive": Rule.FORBIDDEN,
    },
    one_of=("order", "time"),
)

CONTACT = Kind(
    name="contact",
    quantities=(
        _time("time", "s", "when the reading was made"),
        _vector(
            "R_WS",
            QUATERNION,
            "1",
            "W",
            "orientation of the sensor S in the world W (z up)",
        ),
        _vector(
            "wrench",
            WRENCH,
            _WRENCH_UNIT,
            "SW",
            "raw reading: wrench on the sensor, at So, of its load and of the contact",
        ),
        Quantity(
            "free",
            "1",
            "1 where it is known that nothing but its load touches the sensor, else 0",
            required=False,
        ),
        _EXTRA,
    ),
    keys=STATIC_WRENCH.keys,
    min_rows=2,
)

JOINT_MOTION = Kind(
    name="joint_motion",
    quantities=(
        _time("time", "s", "when the row was sampled"),
        _joints("q", "rad", "joint positions (m for a prismatic joint)", True),
        _joints("v", "rad/s", "joint velocities (m/s for a prismatic joint)"),
        _joints("vd", "rad/s²", "joint accelerations (m/s² for a prismatic joint)"),
        _joints(
            "tau",
            "N·m",
            "joint torques, positive about the joint's axis, exerted on its child "
            "link (N for a prismatic joint)",
        ),
        _joints(
            "current",
            "A",
            "motor currents, instead of `tau` where motor constants are not known; "
            "positive as the torque is",
        ),
        _EXTRA,
    ),
    keys={
        "period": Rule.OPTIONAL,
        "joints": Rule.REQUIRED,
        "urdf": Rule.OPTIONAL,
        "drive": Rule.FORBIDDEN,
    },
)

JOINT_TORQUE_STATIC = Kind(
    name="joint_torque_static",
    quantities=(
        _time("order", "1", "order of the poses, any increasing numbers", False),
        _time("time", "s", "when the row was read", False),
        _joints("q", "rad", "joint positions at rest (m for a prismatic joint)", True),
        _joints(
            "tau",
            "N·m",
            "joint torques at rest, positive about the joint's axis, exerted on its "
            "child link (N for a prismatic joint)",
            True,
        ),
        _EXTRA,
    ),
    keys={
        "period": Rule.FORBIDDEN,
        "joints": Rule.REQUIRED,
        "urdf": Rule.OPTIONAL,
        "drive": Rule.FORBIDDEN,
    },
    one_of=("order", "time"),
)

JOINT_RESPONSE = Kind(
    name="joint_response",
    quantities=(
        _time("time", "s", "when the row was sampled"),
        _joints(
            "q_commanded",
            "rad",
            "joint positions that are commanded (m for a prismatic joint)",
            True,
        ),
        _joints("q", "rad", "measured joint positions (m for a prismatic joint)", True),
        _joints(
            "gain",
            "1",
            "gain of the position controller, as it was set: its torque is in "
            "proportion to gain times error; 1 if it is left out",
        ),
        _joints("supply", "V", "voltage of the drive's supply; 1 if it is left out"),
        _joints("enabled", "1", "1 while the drive is on, 0 while it is off"),
        _joints("v", "rad/s", "measured joint velocities; read, not needed"),
        _joints("current", "A", "of the motors; read, not needed"),
        _joints("tau", "N·m", "joint torques; read, not needed"),
        _EXTRA,
    ),
    keys={
        "period": Rule.OPTIONAL,
        "joints": Rule.REQUIRED,
        "urdf": Rule.OPTIONAL,
        "drive": Rule.OPTIONAL,
    },
    min_rows=2,
)

KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        kind.name: kind
        for kind in (
            TRANSITIONS,
            STATIC_WRENCH,
            CONTACT,
            JOINT_MOTION,
            JOINT_TORQUE_STATIC,
            JOINT_RESPONSE,
        )
    }
)
#: Kinds of readings of what gravity does: rows may be as far apart in time as any.
SLOW_KINDS = (STATIC_WRENCH.name, CONTACT.name, JOINT_TORQUE_STATIC.name)

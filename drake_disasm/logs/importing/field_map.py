"""What is what in a recording: our columns from its channels, as a small YAML file.

::

    kind: joint_motion
    task: track
    urdf: arm.urdf
    joints: [a1, a2]
    time: {from: t, unit: ms}
    columns:
      q: {from: [enc1, enc2], unit: deg}
      tau: {from: [i1, i2], scale: [2.1, -1.4]}   # motor constant, sign
      extra.temperature: {from: temp}

Where times are not recorded, or too coarsely, `time: {rate: 125}` takes the rows as
that many a second. Readings at rest may have an order instead of times: `order: {from:
n}`, or `order: {}` for that of the table.

An orientation may be a quaternion, a rotation vector, roll, pitch and yaw, a matrix row
by row, or follow from joint angles and the URDF; a pose has x, y, z before it::

    R_WS: {from: [rx, ry, rz], as: rotation_vector, unit: deg}
    R_WS: {from: [q_0, q_1], as: joints, frame: tool0}

In a bag a channel is "/topic:field", and the time is what the messages' headers carry.
A scale may be the name of a constant of the recording, with a minus before it.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from drake_disasm.common import bounded_yaml
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_text
from drake_disasm.common.quantity import closest
from drake_disasm.common.text import clipped, shown
from drake_disasm.logs.importing.orientations import FORMS, JOINTS, USUAL, unit_factors
from drake_disasm.logs.importing.units import factor
from drake_disasm.logs.schema import KINDS, QUATERNION, Form, Quantity

_MOST_BYTES = 2**20
_KEYS = (
    "kind",
    "task",
    "urdf",
    "joints",
    "drive",
    "frames",
    "time",
    "order",
    "episode",
    "columns",
)
_COLUMN_KEYS = ("from", "as", "frame", "unit", "scale", "sign", "offset")
_REMEDY = "see docs/guides/import-log.md, or let `show` guess and `save_map` write one"

Scale = float | str


@dataclasses.dataclass(frozen=True)
class Column:
    """Our quantity from channels of a recording: value = scale channel + offset.

    Attributes:
        channels: one for each component, in their order.
        unit: of the channels; "" for SI.
        scales: one for each channel, sign included; numbers, or names of constants.
        offset: added, in SI units.
        form: in which the channels give an orientation; "" of other quantities.
        frame: of the URDF, whose orientation joints give; "" of other forms.
        why: what a guess of the form rests on.
    """

    channels: tuple[str, ...]
    unit: str = ""
    scales: tuple[Scale, ...] = ()
    offset: float = 0.0
    form: str = ""
    frame: str = ""
    why: str = dataclasses.field(default="", compare=False)

    def factors(self, constants: Mapping[str, float], where: str) -> list[float]:
        """Returns what each channel is multiplied by.

        Args:
            constants: of the recording.
            where: for messages.

        Raises:
            DisasmError: a constant is not in the recording, or a unit is not known.
        """
        units = self._units(where)
        found = []
        scales = self.scales or (1.0,) * len(self.channels)
        for scale, unit in zip(scales, units, strict=True):
            if isinstance(scale, str):
                scale = _constant(scale, constants, where)
            found.append(unit * scale)
        return found

    def _units(self, where: str) -> list[float]:
        """Returns how many SI units each channel's unit is."""
        if self.form:
            return unit_factors(self.unit, self.form, len(self.channels), where)
        unit = factor(self.unit, where) if self.unit else 1.0
        return [unit] * len(self.channels)

    def to_mapping(self) -> dict[str, Any]:
        """Returns it as plain data."""
        found: dict[str, Any] = {"from": list(self.channels)}
        if self.form:
            found["as"] = self.form
        if self.frame:
            found["frame"] = self.frame
        if self.unit:
            found["unit"] = self.unit
        if self.scales:
            found["scale"] = list(self.scales)
        if self.offset:
            found["offset"] = self.offset
        return found


def _constant(name: str, constants: Mapping[str, float], where: str) -> float:
    """Returns a constant of the recording; with a minus before its name, less it."""
    known = name.removeprefix("-")
    if known not in constants:
        raise DisasmError(
            f"{where}: scale '{known}' is no constant of the recording; it has "
            f"{', '.join(constants) or 'none'}"
        )
    return -constants[known] if name.startswith("-") else constants[known]


@dataclasses.dataclass(frozen=True)
class FieldMap:
    """Everything that has to be said about a recording.

    Attributes:
        kind: of the log.
        columns: by our quantity's name; "extra.NAME" for anything else.
        time: channel of the time, or of the order; None in a bag.
        time_unit: of it; "1" of an order.
        rate: rows a second [Hz], where no channel is the time; None otherwise.
        episode: channel whose value tells episodes apart, or "".
        task: name of the task.
        urdf: of the arm, or "".
        joints: their names, in the order of the channels.
        frames: in which quantities are expressed, where the kind leaves a choice.
        drive: what is known of the joints' drives, for a `joint_response` log.
    """

    kind: str
    columns: Mapping[str, Column]
    time: str | None = None
    time_unit: str = "s"
    rate: float | None = None
    episode: str = ""
    task: str = "recorded"
    urdf: str = ""
    joints: tuple[str, ...] = ()
    frames: Mapping[str, str] = dataclasses.field(default_factory=dict)
    drive: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        """Checks columns against the kind, and fills in what they leave open.

        Torques in amperes without motor constants are `current`; rotations have their
        usual form.

        Raises:
            DisasmError: a column that the kind does not have, or of another size.
        """
        columns = _with_currents(self.kind, self.columns)
        formed = {n: _formed(self.kind, n, c) for n, c in columns.items()}
        object.__setattr__(self, "columns", formed)
        for name, column in self.columns.items():
            wanted = width_of(self.kind, name, len(self.joints), column.form)
            if wanted is not None and len(column.channels) != wanted:
                raise DisasmError(
                    f"map: {name} has {len(column.channels)} channels, not {wanted}; "
                    f"{_REMEDY}"
                )
            if column.scales and len(column.scales) != len(column.channels):
                raise DisasmError(
                    f"map: {name} has {len(column.scales)} scales for "
                    f"{len(column.channels)} channels; give one, or one for each"
                )
        factor(self.time_unit, "map: time")
        if self.rate is not None and not 0.0 < self.rate < math.inf:
            raise DisasmError(
                f"map: time.rate {self.rate:g} is not above zero; give rows a second"
            )
        if self.rate is not None and self.time is not None:
            raise DisasmError("map: time has a rate and a channel; give one of them")
        if self.is_order and not may_be_ordered(self.kind):
            raise DisasmError(
                f"map: a {self.kind} log needs times, not an order; give time: {{from: "
                "NAME} or time: {rate: HZ}"
            )

    @property
    def is_order(self) -> bool:
        """Whether `time` is an order of rows."""
        return self.time_unit == "1"

    def to_yaml(self) -> str:
        """Returns it as a file's text."""
        found: dict[str, Any] = {"kind": self.kind, "task": self.task}
        if self.urdf:
            found["urdf"] = self.urdf
        if self.joints:
            found["joints"] = list(self.joints)
        if self.drive:
            found["drive"] = dict(self.drive)
        if self.frames:
            found["frames"] = dict(self.frames)
        if self.rate is not None:
            found["time"] = {"rate": self.rate}
        elif self.is_order:
            found["order"] = {"from": self.time} if self.time else {}
        elif self.time:
            found["time"] = {"from": self.time, "unit": self.time_unit}
        if self.episode:
            found["episode"] = self.episode
        found["columns"] = {name: c.to_mapping() for name, c in self.columns.items()}
        return yaml.safe_dump(
            found, sort_keys=False, allow_unicode=True, default_flow_style=None
        )


def quantity_of(kind: str, name: str) -> Quantity:
    """Returns the quantity of a kind of log that a column's name means.

    Raises:
        DisasmError: the kind does not have it.
    """
    if kind not in KINDS:
        raise DisasmError(
            f"map: kind {shown(kind)} does not exist; known: {', '.join(KINDS)}"
        )
    known = [q.name for q in KINDS[kind].quantities]
    found = KINDS[kind].quantity(name.partition(".")[0])
    if found is None or (found.form is not Form.TERMS and "." in name):
        raise DisasmError(
            f"map: a {kind} log has no column {shown(name)}; it has {', '.join(known)}"
        )
    return found


def _with_currents(kind: str, columns: Mapping[str, Column]) -> Mapping[str, Column]:
    """Returns columns in which currents without motor constants are no torques.

    Raises:
        DisasmError: the kind of log has no currents.
    """
    tau = columns.get("tau")
    if tau is None or tau.unit != "A" or set(tau.scales) - {1.0, -1.0}:
        return columns
    if "current" in columns or KINDS[kind].quantity("current") is None:
        raise DisasmError(
            "map: tau: is a motor's current; give `scale`, the motor constants [N m/A] "
            "by joint, in the map"
        )
    return {("current" if n == "tau" else n): c for n, c in columns.items()}


def _formed(kind: str, name: str, column: Column) -> Column:
    """Returns a column whose form is known, if it is a rotation's.

    Raises:
        DisasmError: the form does not exist, or is not for this quantity.
    """
    quantity = quantity_of(kind, name)
    if not quantity.is_rotation:
        if column.form or column.frame:
            raise DisasmError(f"map: {name} is no orientation; leave `as` out")
        return column
    form = column.form or USUAL
    if form not in FORMS:
        raise DisasmError(
            f"map: {name}.as: {shown(form)} is not known; {closest(form, list(FORMS))}"
        )
    if form == JOINTS and quantity.frames != ("W",):
        raise DisasmError(
            f"map: {name} does not follow from joints, which give what is in the "
            "arm's base frame; give its own channels"
        )
    if (form == JOINTS) != bool(column.frame):
        raise DisasmError(
            f"map: {name}: `frame` names the URDF's frame whose orientation `as: "
            "joints` gives; give both, or neither"
        )
    return dataclasses.replace(column, form=form)


def width_of(kind: str, name: str, joints: int, form: str = "") -> int | None:
    """Returns how many channels a column has; None where a robot's joints decide.

    Args:
        kind: of the log.
        name: of the column.
        joints: how many there are; 0 if that is not known.
        form: of an orientation, one of FORMS.
    """
    quantity = quantity_of(kind, name)
    if form == JOINTS:
        return joints or None
    if form:
        return len(quantity.components) - len(QUATERNION) + FORMS[form].channels
    if quantity.form is Form.VECTOR:
        return len(quantity.components)
    if quantity.form is Form.JOINTS:
        return joints or None
    return 1


def read_map(path: Path) -> FieldMap:
    """Reads a map.

    Raises:
        DisasmError: it can't be read; names the key that is wrong.
    """
    try:
        raw = bounded_yaml.load(read_text(path, _REMEDY, _MOST_BYTES))
        return parse_map(raw)
    except DisasmError as error:
        raise DisasmError(f"{path}: {error}") from None


def parse_map(raw: object) -> FieldMap:
    """Returns the map that plain data describes.

    Raises:
        DisasmError: names the key that is missing or wrong.
    """
    values = _mapping(raw, "the map", _KEYS)
    for key in ("kind", "columns"):
        if key not in values:
            raise DisasmError(f"map: missing key '{key}'; {_REMEDY}")
    columns = dict(_mapping(values["columns"], "columns"))
    if "order" in columns:  # as the log has it
        values = {**values, "order": columns.pop("order")}
    time = _time(values)
    return FieldMap(
        kind=str(values["kind"]),
        columns={str(name): _column(str(name), own) for name, own in columns.items()},
        time=str(time["from"]) if "from" in time else None,
        time_unit=str(time.get("unit", "s")),
        rate=_number(time["rate"], "time.rate") if "rate" in time else None,
        episode=str(values.get("episode", "")),
        task=str(values.get("task", "recorded")),
        urdf=str(values.get("urdf", "")),
        joints=tuple(map(str, _list(values.get("joints", []), "joints"))),
        frames={
            str(k): str(v)
            for k, v in _mapping(values.get("frames", {}), "frames").items()
        },
        drive=dict(_mapping(values.get("drive", {}), "drive")),
    )


def _time(values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Returns what a map says of the time, or of the order as a time without unit."""
    if "order" not in values:
        return _mapping(values.get("time", {}), "time", ("from", "unit", "rate"))
    if "time" in values:
        raise DisasmError("map: has time and order; give one of them")
    order = values["order"]
    raw = order if isinstance(order, Mapping) else {"from": order}
    names = _list(_mapping(raw, "order", ("from",)).get("from", []), "order")
    return {"unit": "1"} | ({"from": names[0]} if names else {})


def may_be_ordered(kind: str) -> bool:
    """Whether rows of a kind of log may have an order in place of times."""
    return any(q.name == "order" for q in KINDS[kind].quantities)


def _column(name: str, raw: object) -> Column:
    if not isinstance(raw, Mapping):
        raw = {"from": raw}
    values = _mapping(raw, name, _COLUMN_KEYS)
    if "from" not in values:
        raise DisasmError(f"map: {name} has no 'from': the channels that it is made of")
    channels = tuple(map(str, _list(values["from"], f"{name}.from")))
    if not channels:
        raise DisasmError(
            f"map: {name}.from is empty; name the channels, or leave it out"
        )
    scales = [_scale(s, name) for s in _list(values.get("scale", []), name)]
    signs = [_scale(s, name) for s in _list(values.get("sign", []), name)]
    return Column(
        channels=channels,
        unit=str(values.get("unit", "")),
        scales=_combined(_spread(scales, channels), _spread(signs, channels), name),
        offset=float(_number(values.get("offset", 0.0), name)),
        form=str(values.get("as", "")),
        frame=str(values.get("frame", "")),
    )


def _combined(
    scales: Sequence[Scale], signs: Sequence[Scale], name: str
) -> tuple[Scale, ...]:
    if not signs:
        return tuple(scales)
    if any(sign not in (1.0, -1.0) for sign in signs):
        raise DisasmError(f"map: {name}.sign is 1 or -1; give a factor as scale")
    if not scales:
        return tuple(signs)
    pairs = zip(scales, signs, strict=False)
    return tuple(_signed(scale, float(sign)) for scale, sign in pairs)


def _signed(scale: Scale, sign: float) -> Scale:
    if isinstance(scale, str):
        return f"-{scale}" if sign < 0 else scale
    return scale * sign


def _spread(values: Sequence[Scale], channels: Sequence[str]) -> Sequence[Scale]:
    """Returns one value for each channel, where one is given for all."""
    return list(values) * len(channels) if len(values) == 1 else values


def _scale(value: object, name: str) -> Scale:
    return value if isinstance(value, str) else _number(value, name)


def _number(value: object, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise DisasmError(f"map: {name}: {clipped(str(value))} is no number")
    return float(value)


def _list(value: object, name: str) -> list[Any]:
    if isinstance(value, Mapping):
        raise DisasmError(f"map: {name} is a mapping; give a list")
    return list(value) if isinstance(value, list | tuple) else [value]


def _mapping(value: object, name: str, keys: Sequence[str] = ()) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise DisasmError(f"map: {name} is not a mapping; {_REMEDY}")
    for key in value:
        if keys and key not in keys:
            raise DisasmError(
                f"map: {name} has an unknown key {shown(key)}; known: {', '.join(keys)}"
            )
    return value

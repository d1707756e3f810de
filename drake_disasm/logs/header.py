"""`log.yaml`: what a log says about itself."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from drake_disasm.common import bounded_yaml
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_text, write_bytes
from drake_disasm.common.text import shown
from drake_disasm.logs.refusal import did_you_mean, quoted, refusal
from drake_disasm.logs.schema import (
    GREATEST,
    KINDS,
    SCHEMA,
    SI_UNITS,
    UNIT_SPELLINGS,
    Kind,
    Rule,
)

HEADER_NAME = "log.yaml"
_MOST_BYTES, _MOST_VALUES = 2**21, 50_000  # notes of thousands of episodes fit
_REQUIRED = ("schema", "kind", "units", "frames", "task", "provenance")
_KEYS = (*_REQUIRED, "period", "joints", "urdf", "drive", "scenario", "notes")


@dataclass(frozen=True)
class LogHeader:
    """The content of `log.yaml`; schema and units are constants of the format.

    Attributes:
        kind: "transitions", "static_wrench", "contact", "joint_motion" or
            "joint_response".
        task: name of the task, for people and for choosing logs.
        provenance: free: program, version, command, date, seed, commit, ...
        frames: the frame in which each quantity is expressed. What the kind leaves
            no choice about is filled in.
        period: nominal time between rows [s]; None for static readings, and for
            joint motion that was not sampled evenly.
        joints: names of the joints, in the order of the columns `q.0`, `q.1`, ...
        urdf: the URDF that describes the arm, as `package://` or a path.
        drive: what is known of the joints' drives: `limit`, `gravity_compensation`,
            `velocity_feedforward`.
        scenario: the scenario, as plain data, so that a log describes itself.
        notes: what is to be known of single episodes, by their numbers: `cut_off`
            says why one was ended from outside; else free.
    """

    kind: str
    task: str
    provenance: Mapping[str, Any]
    frames: Mapping[str, str] = field(default_factory=dict)
    period: float | None = None
    joints: tuple[str, ...] = ()
    urdf: str | None = None
    drive: Mapping[str, Any] | None = None
    scenario: Mapping[str, Any] | None = None
    notes: Mapping[int, Mapping[str, Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Fills in the frames that the kind leaves no choice about."""
        frames = {**_only_frames(self.kind), **self.frames}
        object.__setattr__(self, "frames", frames)

    def to_mapping(self) -> dict[str, Any]:
        """The content of `log.yaml` as plain data, in its usual order of keys."""
        values = {
            "schema": SCHEMA,
            "kind": self.kind,
            "task": self.task,
            "units": dict(SI_UNITS),
            "frames": dict(self.frames),
            "period": _plain(self.period),
            "joints": list(self.joints) or None,
            "urdf": self.urdf,
            "drive": _plain(self.drive),
            "scenario": _plain(self.scenario),
            "provenance": _plain(self.provenance),
            "notes": {n: dict(note) for n, note in self.notes.items()} or None,
        }
        optional = ("joints", "urdf", "drive", "scenario", "notes")
        return {k: v for k, v in values.items() if k not in optional or v is not None}


def parse_header(raw: object, where: str) -> LogHeader:
    """The header that plain data describes.

    Args:
        raw: the content of a `log.yaml`.
        where: the file, for messages.

    Raises:
        DisasmError: wrong schema, a missing, unknown or wrong key, a unit that is
            not SI, or a frame that the kind does not have.
    """
    values = _checked_mapping(raw, where)
    kind = _checked_kind(values, where)
    _check_units(values["units"], where)
    return LogHeader(
        kind=kind.name,
        task=_text(values, "task", where),
        provenance=_mapping(values, "provenance", where),
        frames=_checked_frames(kind, _mapping(values, "frames", where), where),
        period=_checked_period(values, where),
        joints=_checked_joints(values, where),
        urdf=_text(values, "urdf", where) if values.get("urdf") else None,
        drive=_optional_mapping(values, "drive", where),
        scenario=_optional_mapping(values, "scenario", where),
        notes=_checked_notes(values.get("notes") or {}, where),
    )


def read_header(folder: Path) -> LogHeader:
    """The header of the log in a folder; see `parse_header` for what is refused."""
    path = folder / HEADER_NAME
    remedy = (
        f"name a log's folder, or write its {HEADER_NAME}, see "
        "docs/reference/log-format.md"
    )
    text = read_text(path, remedy, _MOST_BYTES)
    return parse_header(_parsed(text, path), str(path))


def write_header(folder: Path, header: LogHeader) -> None:
    """Writes `log.yaml`, whole or not at all."""
    path = folder / HEADER_NAME
    write_bytes(path, _to_yaml(header, path))


def as_read(header: LogHeader, folder: Path) -> LogHeader:
    """The header as it comes back after being written to the folder.

    Raises:
        DisasmError: as `parse_header`, or what is not plain data.
    """
    path = folder / HEADER_NAME
    return parse_header(_parsed(_to_yaml(header, path).decode(), path), str(path))


def _parsed(text: str, path: Path) -> Any:
    """The plain data of a header's text, within the limits of reading."""
    try:
        return bounded_yaml.load(text, _MOST_VALUES)
    except DisasmError as error:
        raise DisasmError(f"{path}: {error}") from None


def _to_yaml(header: LogHeader, path: Path) -> bytes:
    try:
        text = yaml.safe_dump(header.to_mapping(), sort_keys=False, allow_unicode=True)
    except yaml.YAMLError as error:
        raise refusal(
            path,
            f"not plain data ({error})",
            "give strings, numbers, booleans, lists and mappings alone",
        ) from error
    return text.encode()


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return dict(value)
    return float(value) if isinstance(value, float) else value


def _only_frames(kind: str) -> dict[str, str]:
    quantities = KINDS[kind].quantities if kind in KINDS else ()
    return {
        q.name: q.frames[0]
        for q in quantities
        if q.frame_is_stated and len(q.frames) == 1
    }


def _checked_mapping(raw: object, where: str) -> Mapping[str, Any]:
    if not isinstance(raw, Mapping):
        raise refusal(where, "not a mapping", "write 'key: value' lines")
    if raw.get("schema") != SCHEMA:
        raise refusal(
            where,
            f"wrong schema: key 'schema' is {shown(raw.get('schema'))}",
            f"convert the log to '{SCHEMA}', the one that is read here",
        )
    missing = [key for key in _REQUIRED if key not in raw]
    if missing:
        raise refusal(where, f"missing key {quoted(missing)}", "add it")
    unknown = [str(key) for key in raw if key not in _KEYS]
    if unknown:
        raise refusal(
            where,
            f"unknown key {quoted(unknown)}",
            f"{did_you_mean(unknown[0], _KEYS)}rename it or move it to 'provenance'",
        )
    return raw


def _checked_kind(values: Mapping[str, Any], where: str) -> Kind:
    name = values["kind"]
    if not isinstance(name, str) or name not in KINDS:
        raise refusal(
            where, f"key 'kind' is {shown(name)}", f"use one of {quoted(KINDS)}"
        )
    for key, rule in KINDS[name].keys.items():
        absent = values.get(key) in (None, [])
        if rule is Rule.REQUIRED and absent:
            raise refusal(where, f"missing key '{key}'", f"a {name} log must say it")
        if rule is Rule.FORBIDDEN and not absent:
            raise refusal(where, f"key '{key}' in a {name} log", "remove it")
    return KINDS[name]


def _check_units(units: object, where: str) -> None:
    table = units if isinstance(units, Mapping) else {}
    for quantity, unit in SI_UNITS.items():
        given = table.get(quantity)
        if UNIT_SPELLINGS.get(str(given), given) != unit:
            raise refusal(
                where,
                f"key 'units.{quantity}' is {shown(given)}",
                f"convert the columns to SI and write '{quantity}: {unit}'",
            )
    unknown = [str(key) for key in table if key not in SI_UNITS]
    if unknown:
        raise refusal(
            where, f"unknown key 'units.{unknown[0]}'", f"state {quoted(SI_UNITS)} only"
        )


def _checked_frames(
    kind: Kind, frames: Mapping[str, Any], where: str
) -> Mapping[str, str]:
    stated = [q.name for q in kind.quantities if q.frame_is_stated]
    for name in [*stated, *frames]:
        quantity = kind.quantity(name)
        allowed = quantity.frames if quantity else ()
        if not allowed:
            raise refusal(
                where, f"unknown key 'frames.{name}'", f"state {quoted(stated)} only"
            )
        if frames.get(name) not in allowed:
            raise refusal(
                where,
                f"key 'frames.{name}' is {shown(frames.get(name))}",
                f"express it in {' or '.join(allowed)} and say so",
            )
    return frames


def _checked_period(values: Mapping[str, Any], where: str) -> float | None:
    period = values.get("period")
    if period is None:
        return None
    number = isinstance(period, int | float) and not isinstance(period, bool)
    if not number or not 0 < period <= GREATEST["s"]:
        raise refusal(
            where,
            f"key 'period' is {shown(period)}",
            "give seconds as a positive number, such as 0.005 or 5.0e-3",
        )
    return float(period)


def _checked_joints(values: Mapping[str, Any], where: str) -> tuple[str, ...]:
    joints = values.get("joints") or []
    names = isinstance(joints, list) and all(isinstance(j, str) for j in joints)
    if not names or len(set(joints)) != len(joints):
        raise refusal(
            where, f"key 'joints' is {shown(joints)}", "give a list of different names"
        )
    return tuple(joints)


def _checked_notes(notes: object, where: str) -> Mapping[int, Mapping[str, Any]]:
    table: Mapping[Any, Any] = notes if isinstance(notes, Mapping) else {None: None}
    for number, note in table.items():
        is_number = type(number) is int and number >= 0
        if not is_number or not isinstance(note, Mapping):
            raise refusal(
                where,
                "key 'notes' is not a mapping of episodes' numbers to mappings",
                "write lines such as '3: {cut_off: the gripper slipped}' below it",
            )
    return table


def _text(values: Mapping[str, Any], key: str, where: str) -> str:
    value = values[key]
    if not isinstance(value, str) or not value.strip():
        raise refusal(where, f"key '{key}' is {shown(value)}", "give a text")
    return value


def _mapping(values: Mapping[str, Any], key: str, where: str) -> Mapping[str, Any]:
    value = values[key]
    if not isinstance(value, Mapping):
        raise refusal(where, f"key '{key}' is {shown(value)}", "give a mapping, or {}")
    return value


def _optional_mapping(
    values: Mapping[str, Any], key: str, where: str
) -> Mapping[str, Any] | None:
    return _mapping(values, key, where) if values.get(key) is not None else None

"""Scenarios from files and command lines, and back to text."""

import copy
import dataclasses
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import yaml
from pydrake.common.yaml import yaml_dump_typed

from drake_disasm.common.bounded_yaml import MOST_BYTES
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_text
from drake_disasm.common.plain_data import check_like
from drake_disasm.common.quantity import check, closest
from drake_disasm.common.resources import models_dir
from drake_disasm.common.text import clipped
from drake_disasm.effects import files_of, find_effect
from drake_disasm.parts import find_part
from drake_disasm.scenario.migrations import upgraded
from drake_disasm.scenario.names import find_field, resolve
from drake_disasm.scenario.schema import Scenario
from drake_disasm.scenario.strict_yaml import parse
from drake_disasm.scenario.tags import tagged
from drake_disasm.scenario.validity import validate

#: Old names of shipped scenarios.
RENAMED = {"sliding": "chapter3"}


def _shipped_dir() -> Path:
    return models_dir() / "scenarios"


def shipped_scenarios() -> list[str]:
    """Returns the names of the scenarios that come with the package."""
    return sorted(path.stem for path in _shipped_dir().glob("*.yaml"))


def scenario_path(name: str) -> Path:
    """Returns the file of a shipped scenario's name, or the path as given.

    Raises:
        DisasmError: neither a shipped scenario nor a file.
    """
    shipped = RENAMED.get(name, name)
    for path in (Path(name), _shipped_dir() / f"{shipped}.yaml"):
        if os.path.isfile(path):  # pathlib's raises on a name that is too long
            return path
    name = clipped(name, 200)
    known = closest(name, shipped_scenarios())
    raise DisasmError(f"scenario {name}: no such file; {known}")


def load_scenario(name: str, overrides: Sequence[str] = ()) -> Scenario:
    """Returns the scenario of a file or shipped name, with `key=value` overrides.

    Raises:
        DisasmError: missing file, unknown key, bad value; says which and where.
    """
    path = scenario_path(name)
    text = read_text(path, "give a scenario in YAML", MOST_BYTES)
    scenario = parse(upgraded(text), Scenario(), str(path))
    _checked(check, scenario, str(path))
    _find_files(scenario, path.parent)
    for override in overrides:
        scenario = _override(scenario, override)
        _checked(check, scenario, f"`overrides` {override}")
    _checked(validate, scenario, " with `overrides` ".join([str(path), *overrides]))
    return scenario


def with_hidden_effects(
    nominal: Scenario, name: str, stated: Scenario | None = None
) -> Scenario:
    """Returns a scenario with the effects of another added, which stay undeclared.

    Args:
        nominal: what is declared.
        name: of a shipped scenario, or of a file that has `effects` and may repeat
            what the nominal scenario states.
        stated: the nominal scenario as its file states it, without overrides.

    Raises:
        DisasmError: missing file, bad value, no effect in it, or something other than
            effects that differs from the nominal scenario.
    """
    path = scenario_path(name)
    text = read_text(path, "give a scenario in YAML", MOST_BYTES)
    declared = dataclasses.replace(stated or nominal, effects=[])
    hidden = parse(upgraded(text), copy.deepcopy(declared), str(path))
    _find_files(hidden, path.parent)
    for field in dataclasses.fields(Scenario):
        differs = getattr(hidden, field.name) != getattr(declared, field.name)
        if differs and field.name not in ("name", "effects"):
            raise DisasmError(
                f"{path}: `hidden` adds effects alone, and its '{field.name}' is not "
                f"that of scenario '{nominal.name}'; take it out, or change both by "
                "`overrides`"
            )
    if not hidden.effects:
        raise DisasmError(f"{path}: `hidden` has no effects; list some under `effects`")
    real = dataclasses.replace(nominal, effects=[*nominal.effects, *hidden.effects])
    _checked(check, real, str(path))
    _checked(validate, real, str(path))
    return real


def _find_files(scenario: Scenario, folder: Path) -> None:
    """Makes the files that a scenario names those beside it."""
    part = scenario.part
    devices: list[Any] = [scenario.arm, scenario.gripper, scenario.ft_sensor]
    named = [(device, "model") for device in devices]
    for section, name in named + [(part, name) for name in part.file_fields]:
        file = getattr(section, name)
        if file and not file.startswith("package:"):
            setattr(section, name, str((folder / file).absolute()))
    for effect in scenario.effects:
        for field, file in files_of(effect).items():
            setattr(effect, field, str((folder / file).absolute()))


def dump_scenario(scenario: Scenario) -> str:
    """Returns the scenario as YAML text that `load_scenario` reads back."""
    return yaml_dump_typed(scenario, schema=tagged(Scenario))


def scenario_to_mapping(scenario: Scenario) -> dict[str, Any]:
    """Returns the scenario as plain data, for a log's header.

    An effect is a mapping of its parameters with its name under `effect`; the part
    likewise, under `part`.
    """
    mapping = dataclasses.asdict(scenario)
    mapping["part"] = {"part": type(scenario.part).__name__, **mapping["part"]}
    mapping["effects"] = [
        {"effect": type(effect).__name__, **dataclasses.asdict(effect)}
        for effect in scenario.effects
    ]
    return mapping


def scenario_from_mapping(mapping: dict[str, Any]) -> Scenario:
    """Returns the scenario of what `scenario_to_mapping` gave.

    Raises:
        DisasmError: unknown key or effect, bad value.
    """
    source = "scenario of the log"
    tagged_keys = ("effects", "part")
    plain = {k: value for k, value in mapping.items() if k not in tagged_keys}
    lines = [upgraded(yaml.safe_dump(plain)) if plain else ""]
    for part in _named([mapping["part"]] if "part" in mapping else [], "part", source):
        lines.append(f"part: {_with_tag(part, 'part')}")
    effects = _named(mapping.get("effects") or [], "effect", source)
    lines.append("effects:" if effects else "effects: []")
    lines += [f"- {_with_tag(effect, 'effect')}" for effect in effects]
    scenario = parse("\n".join(lines), Scenario(), source, line_numbers=False)
    _checked(validate, scenario, source)
    return scenario


def _named(items: Any, key: str, source: str) -> list[dict[str, Any]]:
    """Returns effects or parts as plain data, each with its name under a key."""
    try:
        check_like(items, [{key: ""}], f"{key}s")
    except DisasmError as error:
        raise DisasmError(f"{source}: {error}; record it again") from None
    find = find_effect if key == "effect" else find_part
    for item in items:
        if not item[key].isidentifier():
            find(clipped(item[key]))
    return list(items)


def _with_tag(item: dict[str, Any], key: str) -> str:
    """Returns plain data as YAML, its name as the tag."""
    values = {name: value for name, value in item.items() if name != key}
    flow = yaml.safe_dump(values, default_flow_style=True, width=10**6).strip()
    return f"!{item[key]} {flow}"


def _checked(
    checker: Callable[[Scenario], None], scenario: Scenario, source: str
) -> None:
    try:
        checker(scenario)
    except DisasmError as error:
        raise DisasmError(f"{source}: {error}") from None


def _override(scenario: Scenario, override: str) -> Scenario:
    key, separator, value = override.partition("=")
    if not separator or not key:
        raise DisasmError(f"`overrides` {override}: write it as key=value")
    source = f"`overrides` {override}"
    try:
        scenario, path = resolve(copy.deepcopy(scenario), key.strip())
        find_field(scenario, path, key.strip())
    except DisasmError as error:
        raise DisasmError(f"{source}: {error}") from None
    _set_text(scenario, path, value, source)
    return scenario


def _set_text(scenario: Scenario, path: str, text: str, source: str) -> None:
    """Changes what a path of a scenario has to what YAML text says."""
    parent, _, word = path.rpartition(".")
    field = find_field(scenario, path)
    if isinstance(field.key, int) and dataclasses.is_dataclass(field.value):
        found = parse(text, field.value, source, path=path, line_numbers=False)
        field.set(found)
    elif isinstance(field.key, int):
        words = [repr(value) for value in field.owner]
        words[field.key] = text
        _set_text(scenario, parent, f"[{', '.join(words)}]", source)
    else:
        found = parse(
            f"{{{word}: {text}}}",
            field.owner,
            source,
            path=parent,
            line_numbers=False,
        )
        field.set(getattr(found, word))

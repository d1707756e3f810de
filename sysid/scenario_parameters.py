"""Which numbers of a scenario can be identified, and how users name them."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from drake_disasm.common import bounded_yaml
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_text
from drake_disasm.common.quantity import closest
from drake_disasm.common.text import clipped, shown
from drake_disasm.scenario import Scenario
from drake_disasm.scenario.names import find_number, resolve
from sysid.parameters import Parameter

_KEYS = ("low", "high", "nominal", "scale")
_SCALES = ("linear", "log")


@dataclasses.dataclass(frozen=True)
class ParameterRequest:
    """What a user asks of one parameter; None leaves the scenario's own.

    Attributes:
        name: as `drake_disasm.scenario.names` says; `Effect.field` adds the effect at
            null if the scenario has none.
        low, high: bounds.
        nominal: where the search starts.
        scale: "linear" or "log".
    """

    name: str
    low: float | None = None
    high: float | None = None
    nominal: float | None = None
    scale: str | None = None


def read_requests(words: Sequence[str]) -> list[ParameterRequest]:
    """Returns what a command line's names and files ask for.

    Args:
        words: names, or YAML files with a mapping of names to `{low, high, nominal,
            scale}`, each of which may be left out.

    Raises:
        DisasmError: an unreadable file, an unknown key, a value that is not a number,
            a name given twice.
    """
    requests = [
        request
        for word in words
        for request in (
            _read_file(Path(word))
            if word.endswith((".yaml", ".yml"))
            else [ParameterRequest(word)]
        )
    ]
    names = [request.name for request in requests]
    for name in names:
        if names.count(name) > 1:
            raise DisasmError(f"parameter {name}: is given twice; keep one")
    if not requests:
        raise DisasmError(
            "no parameter is named; give `parameters`, for example "
            "contact.friction GroovePose.ry"
        )
    return requests


def scenario_parameters(
    scenario: Scenario, requests: Sequence[ParameterRequest]
) -> tuple[Scenario, tuple[Parameter, ...]]:
    """Returns the requested parameters, and the scenario that has them all.

    The scenario has one more effect for each that was named and not there, at its
    null value.

    Raises:
        DisasmError: there is no such number, or its bounds are impossible.
    """
    found = []
    for request in requests:
        try:
            scenario, path = resolve(scenario, request.name)
            field = find_number(scenario, path, request.name)
        except DisasmError as error:
            raise DisasmError(f"parameter {error}") from None
        found.append(_parameter(path, field.value, field.metadata, request))
    return scenario, tuple(found)


def _parameter(
    path: str, value: float, metadata: Mapping[str, Any], request: ParameterRequest
) -> Parameter:
    low = metadata["low"] if request.low is None else request.low
    high = metadata["high"] if request.high is None else request.high
    _refuse_beyond(path, low, high, metadata)
    nominal = value if request.nominal is None else request.nominal
    bounded = {**metadata, "low": low, "high": high}
    log_scale = None if request.scale is None else request.scale == "log"
    return Parameter.of_field(request.name, path, nominal, bounded, log_scale)


def _refuse_beyond(
    path: str, low: float, high: float, metadata: Mapping[str, Any]
) -> None:
    """Refuses a search where the scenario's own check would refuse the result."""
    own_low, own_high = metadata["low"], metadata["high"]
    if low < own_low or high > own_high:
        if not (math.isfinite(low) and math.isfinite(high)):
            return  # Parameter says it better
        raise DisasmError(
            f"parameter {path}: bounds {low:g} to {high:g} go beyond {own_low:g} to "
            f"{own_high:g} {metadata['unit']}, which a scenario may have; narrow them"
        )


def _read_file(path: Path) -> list[ParameterRequest]:
    text = read_text(path, "name a YAML file", bounded_yaml.MOST_BYTES)
    try:
        raw = bounded_yaml.load(text)
    except DisasmError as error:
        raise DisasmError(f"{path}: {error}") from None
    if not isinstance(raw, dict) or not raw:
        raise DisasmError(
            f"{path}: is not a mapping; write lines of `contact.friction: "
            "{low: 0.0, high: 1.0}`"
        )
    return [_request(clipped(str(name)), entry, path) for name, entry in raw.items()]


def _request(name: str, entry: Any, path: Path) -> ParameterRequest:
    entry = entry or {}
    if not isinstance(entry, dict):
        raise DisasmError(
            f"{path}: {name}: is not a mapping; write {{low: ..., high: ...}}"
        )
    for key, value in entry.items():
        if key not in _KEYS:
            raise DisasmError(
                f"{path}: {name}: unknown key '{clipped(str(key))}'; "
                f"{closest(clipped(str(key)), list(_KEYS))}"
            )
        if key == "scale" and value not in _SCALES:
            raise DisasmError(
                f"{path}: {name}: scale {shown(value)}; use linear or log"
            )
        if key != "scale" and (isinstance(value, bool) or not _is_number(value)):
            raise DisasmError(
                f"{path}: {name}: {key} is {shown(value)}; give a number (YAML reads "
                "1e-3 as a text, 1.0e-3 as a number)"
            )
    numbers = {k: float(v) for k, v in entry.items() if k != "scale"}
    return ParameterRequest(name, **numbers, scale=entry.get("scale"))


def _is_number(value: Any) -> bool:
    return isinstance(value, float) or (isinstance(value, int) and abs(value) < 2**63)

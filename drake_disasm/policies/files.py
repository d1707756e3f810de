"""Policy files.

One .npz holds

    weight_0, bias_0, ...   float32, (out, in) and (out,) of each layer
    observation_scale       float64, (12,) [m, rad, N, N m]
    action_scale            float64, (6,) [m, rad]
    text                    JSON in UTF-8: format, description, base policy, axes
    sha256                  of all of these, with their names, types and shapes
"""

import dataclasses
import hashlib
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.common.archive import (
    ArchiveKind,
    Arrays,
    ArraySpec,
    check_arrays,
    load_archive,
    save_archive,
)
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.plain_data import check_like
from drake_disasm.common.quantity import closest
from drake_disasm.common.resources import models_dir
from drake_disasm.common.text import clipped, shown
from drake_disasm.mdp import ACTION_NAMES, STATE_NAMES
from drake_disasm.parts import WAYS
from drake_disasm.policies.network import (
    LearnedPolicy,
    Network,
    PolicyDescription,
)
from drake_disasm.policies.scripted import SCRIPTED, Admittance, Straight, name_of
from drake_disasm.policies.task_view import StageAxes, TaskView
from drake_disasm.scenario import Scenario, scenario_to_mapping

FORMAT = "drake_disasm/policy/1"

AGAIN = "copy it again, or train it again (drake-disasm train)"
#: Two hundred layers, and 64 MiB: a hundred times what the shipped ones have.
POLICY = ArchiveKind(
    "policy", "give one that drake-disasm train wrote", AGAIN, 2**26, most_members=400
)

_PARTS = ("weight_", "bias_")  # of each layer
#: What the format calls fields of PolicyDescription that have another name.
_ENTRIES = {"station": "model"}


def scenario_hash(scenario: Scenario) -> str:
    """Returns the SHA-256 of everything that a scenario says."""
    text = json.dumps(scenario_to_mapping(scenario), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def save_policy(path: Path, policy: LearnedPolicy) -> None:
    """Writes a policy; the same policy gives the same bytes.

    Args:
        path: of the file, ending in .npz.
        policy: its description holds plain data alone.

    Raises:
        DisasmError: `load_policy` would refuse it (NaN in its weights), or the
            system refuses to write.
    """
    arrays, view = _arrays(policy), policy.view
    description = _entries(policy.description)
    try:
        _check(arrays)
        _description(description)
        text = {
            "format": FORMAT,
            "description": description,
            "base": view.base and _base_to_mapping(view.base),
        }
        if view.axes is not None:  # what has none is written as it always was
            text["axes"] = dataclasses.asdict(view.axes)
    except DisasmError as error:
        raise DisasmError(f"policy {path}: is not written, it {error}") from None
    save_archive(path, arrays, text)


def load_policy(path: Path) -> LearnedPolicy:
    """Returns the policy of a file.

    Raises:
        DisasmError: no such file, or it is damaged, or not such a policy.
    """
    try:
        arrays, text = load_archive(path, POLICY)
    except DisasmError as error:
        raise DisasmError(f"policy {error}") from None
    try:
        return _policy(arrays, text)
    except DisasmError as error:
        raise DisasmError(f"policy {path}: {error}") from None


def find_policy(name: str) -> Path | None:
    """Returns the file of a shipped policy's name, or of a path to an .npz."""
    if name.endswith(".npz"):
        return Path(name)
    if name in shipped_policies():
        return models_dir() / "policies" / f"{name}.npz"
    return None


def shipped_policies() -> list[str]:
    """Returns the names of the policies that come with the package."""
    return sorted(path.stem for path in (models_dir() / "policies").glob("*.npz"))


def _arrays(policy: LearnedPolicy) -> Arrays:
    network = policy.network
    arrays = {f"weight_{i}": w for i, w in enumerate(network.weights)}
    arrays |= {f"bias_{i}": b for i, b in enumerate(network.biases)}
    arrays["observation_scale"] = policy.view.observation_scale.astype(float)
    arrays["action_scale"] = policy.view.action_scale.astype(float)
    return arrays


def _policy(arrays: Arrays, text: dict[str, Any]) -> LearnedPolicy:
    if text.get("format") != FORMAT:
        raise DisasmError(
            f"has format {shown(text.get('format'))}, this program reads '{FORMAT}'; "
            "use the version of drake_disasm that wrote it, or train anew"
        )
    layers = _check(arrays)
    network = Network(
        tuple(arrays[f"weight_{i}"] for i in range(layers)),
        tuple(arrays[f"bias_{i}"] for i in range(layers)),
    )
    return LearnedPolicy(
        network,
        TaskView(
            arrays["observation_scale"],
            arrays["action_scale"],
            _base_from_mapping(text.get("base")),
            _axes_from_mapping(text.get("axes")),
        ),
        _description(text.get("description")),
    )


def _check(arrays: Arrays) -> int:
    """Refuses arrays that are no policy's; returns how many layers there are."""
    layers = max(1, *(sum(n.startswith(part) for n in arrays) for part in _PARTS))
    check_arrays(arrays, _wanted(arrays, layers), AGAIN)
    if arrays["observation_scale"].min() <= 0.0 or arrays["action_scale"].min() < 0.0:
        raise DisasmError("has a scale that is zero or negative; train anew")
    return layers


def _wanted(arrays: Arrays, layers: int) -> dict[str, ArraySpec]:
    """Returns what the arrays must be: layers that lead from states to actions."""
    states, actions = len(STATE_NAMES), len(ACTION_NAMES)
    hidden = (arrays.get(f"bias_{i}") for i in range(layers - 1))
    widths = [states, *(0 if b is None else b.size for b in hidden), actions]
    wanted = {
        "observation_scale": ArraySpec("float64", (states,)),
        "action_scale": ArraySpec("float64", (actions,)),
    }
    for i in range(layers):
        wanted[f"weight_{i}"] = ArraySpec("float32", (widths[i + 1], widths[i]))
        wanted[f"bias_{i}"] = ArraySpec("float32", (widths[i + 1],))
    return wanted


def _entries(description: PolicyDescription) -> dict[str, Any]:
    """Returns a description as the format has it."""
    return {
        _ENTRIES.get(name, name): value
        for name, value in dataclasses.asdict(description).items()
    }


def _description(values: Any) -> PolicyDescription:
    default = _entries(PolicyDescription())
    if isinstance(values, dict):  # a door chain was the only part once
        values = {"way": default["way"]} | values
    if not isinstance(values, dict) or values.keys() != default.keys():
        raise DisasmError(f"has a description with other entries; {AGAIN}")
    read = {name: _like(default[name], values[name], name) for name in default}
    for name, entry in _ENTRIES.items():
        read[name] = read.pop(entry)
    return PolicyDescription(**read)


def _like(example: Any, value: Any, name: str) -> Any:
    """Returns a value of the example's type; JSON has lists alone, and 1 for 1.0."""
    kind = type(example)
    if (kind, type(value)) in ((tuple, list), (float, int)):
        return kind(value)
    if not isinstance(value, kind):
        raise DisasmError(
            f"has a description whose {name} is no {kind.__name__}; {AGAIN}"
        )
    return value


def _base_to_mapping(base: Straight | Admittance) -> dict[str, Any]:
    return {"name": name_of(base), "parameters": dataclasses.asdict(base)}


def _base_from_mapping(mapping: Any) -> Straight | Admittance | None:
    if mapping is None:
        return None
    if not isinstance(mapping, dict) or not isinstance(mapping.get("parameters"), dict):
        raise DisasmError(f"has a base policy without parameters; {AGAIN}")
    name, parameters = str(mapping.get("name")), mapping["parameters"]
    if name not in SCRIPTED:
        raise DisasmError(
            f"has base policy '{clipped(name)}'; {closest(name, list(SCRIPTED))}"
        )
    known = [field.name for field in dataclasses.fields(SCRIPTED[name])]
    for key, value in parameters.items():
        if key not in known:
            raise DisasmError(
                f"sets '{clipped(key)}' of '{name}'; {closest(key, known)}"
            )
        is_way = key == "way" and value in WAYS
        if not is_way and (
            type(value) not in (int, float) or not abs(value) < math.inf
        ):
            raise DisasmError(f"sets {key} of '{name}' to {shown(value)}; train anew")
    return SCRIPTED[name](**parameters)


def _axes_from_mapping(mapping: Any) -> StageAxes | None:
    if mapping is None:
        return None
    example = {"way": "", "ends": [0.0], "switch": 0.0}
    try:
        check_like(mapping, example)
    except DisasmError as error:
        raise DisasmError(f"has axes that are damaged ({error}); {AGAIN}") from None
    axes = StageAxes(mapping["way"], tuple(mapping["ends"]), mapping["switch"])
    numbers = np.array([*axes.ends, axes.switch])
    if axes.way not in WAYS or len(axes.way) != len(axes.ends):
        raise DisasmError(f"has the way {shown(axes.way)} in its axes; {AGAIN}")
    if not np.isfinite(numbers).all():
        raise DisasmError(f"has axes that don't end; {AGAIN}")
    return axes

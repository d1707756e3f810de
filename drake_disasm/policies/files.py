"""Policy files: one .npz, no pickle, nothing damaged goes unnoticed."""

import dataclasses
import hashlib
import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.errors import DisasmError
from drake_disasm.mdp import ACTION_NAMES, STATE_NAMES
from drake_disasm.policies.network import (
    ActionMap,
    LearnedPolicy,
    Network,
    PolicyDescription,
)
from drake_disasm.policies.scripted import SCRIPTED, Admittance, Straight
from drake_disasm.quantity import closest
from drake_disasm.resources import models_dir
from drake_disasm.scenario import Scenario, scenario_to_mapping
from drake_disasm.writing import write_atomically

FORMAT = "drake_disasm/policy/1"
_DAMAGED = "copy it again, or train anew (tools/train.py)"


def scenario_hash(scenario: Scenario) -> str:
    """Returns the SHA-256 of everything that a scenario says."""
    text = json.dumps(scenario_to_mapping(scenario), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def save_policy(path: Path, policy: LearnedPolicy) -> None:
    """Writes a policy; the same policy gives the same bytes.

    Raises:
        DisasmError: the system refuses to write.
    """
    arrays = _arrays(policy)
    base = policy.action_map.base
    text = {
        "format": FORMAT,
        "description": dataclasses.asdict(policy.description),
        "base": _base_to_mapping(base) if base else None,
    }
    arrays["text"] = np.frombuffer(
        json.dumps(text, sort_keys=True).encode(), dtype=np.uint8
    )
    arrays["sha256"] = np.frombuffer(_checksum(arrays), dtype=np.uint8)
    write_atomically(path, lambda stream: stream.write(_zipped(arrays)))


def load_policy(path: Path) -> LearnedPolicy:
    """Returns the policy of a file.

    Raises:
        DisasmError: no such file, or it is damaged, or not such a policy.
    """
    arrays = _read(path)
    try:
        text = _checked_text(arrays)
        policy = _assembled(arrays, text)
        _check_shapes(policy)
    except (DisasmError, KeyError, TypeError, ValueError) as error:
        what = f"lacks {error}" if isinstance(error, KeyError) else str(error)
        raise DisasmError(f"{path}: {what}; {_DAMAGED}") from None
    return policy


def find_policy(name: str) -> Path | None:
    """Returns the file of a shipped policy's name, or of a path to an .npz."""
    if name.endswith(".npz"):
        return Path(name)
    shipped = models_dir() / "policies" / f"{name}.npz"
    return shipped if shipped.is_file() else None


def shipped_policies() -> list[str]:
    """Returns the names of the policies that come with the package."""
    return sorted(path.stem for path in (models_dir() / "policies").glob("*.npz"))


def _arrays(policy: LearnedPolicy) -> dict[str, np.ndarray]:
    network = policy.network
    arrays = {f"weight_{i}": w for i, w in enumerate(network.weights)}
    arrays |= {f"bias_{i}": b for i, b in enumerate(network.biases)}
    arrays["observation_scale"] = policy.observation_scale
    arrays["action_scale"] = policy.action_map.action_scale
    return arrays


def _checksum(arrays: dict[str, np.ndarray]) -> bytes:
    digest = hashlib.sha256()
    for name in sorted(arrays):
        values = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {values.dtype.str} {values.shape} ".encode())
        digest.update(values.tobytes())
    return digest.digest()


def _zipped(arrays: dict[str, np.ndarray]) -> bytes:
    """Returns what np.savez writes, without the time of day."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name in sorted(arrays):
            content = io.BytesIO()
            np.lib.format.write_array(content, arrays[name], allow_pickle=False)
            entry = zipfile.ZipInfo(f"{name}.npy", (1980, 1, 1, 0, 0, 0))
            archive.writestr(entry, content.getvalue())
    return buffer.getvalue()


def _read(path: Path) -> dict[str, np.ndarray]:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise DisasmError(
            f"policy {path}: can't be read ({error.strerror}); "
            f"shipped ones: {', '.join(shipped_policies()) or 'none'}"
        ) from None
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except Exception as error:  # a damaged archive can fail in any way
        raise DisasmError(
            f"{path}: is no policy file, or damaged ({error}); {_DAMAGED}"
        ) from None


def _checked_text(arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    found = arrays.pop("sha256").tobytes()
    if found != _checksum(arrays):
        raise DisasmError("is damaged: its checksum does not match")
    text = json.loads(arrays.pop("text").tobytes())
    if text["format"] != FORMAT:
        raise DisasmError(f"has format '{text['format']}', this program reads {FORMAT}")
    return text


def _assembled(arrays: dict[str, np.ndarray], text: dict[str, Any]) -> LearnedPolicy:
    count = sum(name.startswith("weight_") for name in arrays)
    network = Network(
        tuple(arrays[f"weight_{i}"].astype(np.float32) for i in range(count)),
        tuple(arrays[f"bias_{i}"].astype(np.float32) for i in range(count)),
    )
    values = text["description"]
    for name in ("state_names", "action_names"):
        values[name] = tuple(values[name])
    base = _base_from_mapping(text["base"]) if text["base"] else None
    return LearnedPolicy(
        network,
        arrays["observation_scale"],
        ActionMap(arrays["action_scale"], base),
        PolicyDescription(**values),
    )


def _check_shapes(policy: LearnedPolicy) -> None:
    """Refuses a network whose layers do not chain from states to actions."""
    inputs = len(STATE_NAMES)
    for weight, bias in zip(policy.network.weights, policy.network.biases, strict=True):
        if (
            weight.ndim != 2
            or weight.shape[1] != inputs
            or bias.shape != weight[:, 0].shape
        ):
            raise DisasmError(
                f"has a layer of shape {weight.shape}, {inputs} numbers go into it"
            )
        inputs = len(weight)
    shapes = (policy.observation_scale.shape, policy.action_map.action_scale.shape)
    if inputs != len(ACTION_NAMES) or shapes != ((12,), (6,)):
        raise DisasmError(
            f"maps {shapes[0]} to {inputs} numbers, the task needs 12 to 6"
        )
    for name, values in _arrays(policy).items():
        if not np.isfinite(values).all():
            raise DisasmError(f"has NaN or infinity in {name}")


def _base_to_mapping(base: Straight | Admittance) -> dict[str, Any]:
    name = next(name for name, kind in SCRIPTED.items() if isinstance(base, kind))
    return {"name": name, "parameters": dataclasses.asdict(base)}


def _base_from_mapping(mapping: dict[str, Any]) -> Straight | Admittance:
    name = mapping["name"]
    if name not in SCRIPTED:
        raise DisasmError(
            f"needs the base policy '{name}'; {closest(name, list(SCRIPTED))}"
        )
    return SCRIPTED[name](**mapping["parameters"])

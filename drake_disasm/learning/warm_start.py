"""Starting a training from another one: from twin to cell, from ψ to ψ.

A training that starts from another takes over its agent (networks, targets, Adam's
moments), seed by seed. Its own replay memory is empty, its exploration starts anew.
The other's transitions can be rehearsed: with the hyper-parameter `demonstrations`
that share of each batch comes from them (half and half: Ball et al., 2023, RLPD). The
networks' inputs and outputs must mean the same in both.
"""

import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_bytes
from drake_disasm.learning.checkpoint import CHECKPOINT
from drake_disasm.learning.experiment import Experiment, read_training, seed_folder

_NETWORKS = ("algorithm", "hidden", "layer_norm", "critics")
_SCALES = ("position_scale", "rotation_scale", "force_scale", "torque_scale")
_ACTIONS = ("base", "residual")
_TASK = ("period", "max_translation", "max_rotation")
#: What must be known of the other training; None is any value.
_NEEDED = {
    "config": dict.fromkeys((*_NETWORKS, *_SCALES, *_ACTIONS)),
    "scenario": {"task": dict.fromkeys(_TASK), "observation": {"variant": None}},
}


def start_checkpoint(folder: Path | str, seed: int) -> Path:
    """Returns the path of the checkpoint of one seed of a training."""
    return seed_folder(Path(folder), seed) / "checkpoint.npz"


def start_hash(folder: Path | str, seed: int) -> str:
    """Returns the SHA-256 of that file."""
    path = start_checkpoint(folder, seed)
    data = read_bytes(path, "train it there first", CHECKPOINT.most_bytes)
    return hashlib.sha256(data).hexdigest()


def check_start(experiment: Experiment, seeds: Sequence[int]) -> None:
    """Refuses an experiment that can't start from the training that it names.

    Raises:
        DisasmError: the start lacks a seed or has not finished it, or its networks
            have other inputs or outputs; names the first difference.
    """
    for seed in seeds:
        if (
            not start_checkpoint(experiment.start, seed)
            .with_name("result.json")
            .exists()
        ):
            raise DisasmError(
                f"{experiment.start}: has not finished seed {seed}; train it there "
                "first (drake-disasm train), or give another folder"
            )
    before = read_training(Path(experiment.start), _NEEDED)
    for name, then, now in _compared(before, experiment.to_mapping()):
        if then != now:
            raise DisasmError(
                f"{experiment.start}: was trained with {name} {then}, not {now}; use "
                "the same"
            )


def _compared(
    before: dict[str, Any], after: dict[str, Any]
) -> Iterator[tuple[str, Any, Any]]:
    """Yields what an agent's networks depend on: name, value then, value now."""
    for name in (*_NETWORKS, *_ACTIONS, *_SCALES):
        yield name, before["config"][name], after["config"][name]
    then = before["config"].get("axes", "groove")  # older ones don't say
    yield "axes", then, after["config"]["axes"]
    old, new = before["scenario"], after["scenario"]
    for name in _TASK:
        yield f"task.{name}", old["task"][name], new["task"][name]
    name = "observation.variant"
    yield name, old["observation"]["variant"], new["observation"]["variant"]

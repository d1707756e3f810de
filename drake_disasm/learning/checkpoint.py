"""A training's state on disk, written atomically after every episode."""

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch.utils._pytree import tree_flatten, tree_unflatten

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import write_npz
from drake_disasm.learning.agent import Agent
from drake_disasm.learning.replay import Replay


def save_checkpoint(
    path: Path, agent: Agent, replay: Replay, notes: dict[str, Any]
) -> None:
    """Writes an agent, its memory and notes (plain data) whole or not at all.

    Raises:
        DisasmError: the system refuses to write.
    """
    leaves, _ = tree_flatten(agent.state)
    rows, following = replay.contents()
    arrays = {f"state_{i:03d}": leaf.numpy() for i, leaf in enumerate(leaves)}
    own = {"updates": agent.updates, "following": following, "notes": notes}
    text = np.frombuffer(json.dumps(own).encode(), dtype=np.uint8)
    write_npz(path, text=text, replay=rows, **arrays)


def load_checkpoint(path: Path, agent: Agent, replay: Replay) -> dict[str, Any]:
    """Restores an agent and its memory, and returns the notes.

    Raises:
        DisasmError: the file is damaged, or of another kind of agent.
    """
    arrays, own = _read(path)
    _restore_state(path, agent, arrays)
    replay.restore(arrays["replay"], own["following"])
    agent.updates = own["updates"]
    return own["notes"]


def load_agent(path: Path, agent: Agent) -> None:
    """Gives an agent the state of another: networks, targets, Adam's moments.

    Raises:
        DisasmError: the file is damaged, or of another kind of agent.
    """
    arrays, _ = _read(path)
    _restore_state(path, agent, arrays)


def load_memory(path: Path) -> Replay:
    """Returns the replay memory of a training.

    Raises:
        DisasmError: the file is damaged.
    """
    arrays, own = _read(path)
    replay = Replay(max(1, len(arrays["replay"])))
    replay.restore(arrays["replay"], own["following"])
    return replay


def _read(path: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Returns the arrays of a checkpoint and the text among them."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        return arrays, json.loads(arrays["text"].tobytes())
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise DisasmError(
            f"{path}: is not a complete checkpoint ({error}); delete it to start anew"
        ) from None


def _restore_state(path: Path, agent: Agent, arrays: dict[str, np.ndarray]) -> None:
    leaves, structure = tree_flatten(agent.state)
    found = [arrays.get(f"state_{i:03d}") for i in range(len(leaves))]
    if any(
        new is None or new.shape != tuple(old.shape)
        for new, old in zip(found, leaves, strict=True)
    ):
        raise DisasmError(
            f"{path}: is of an agent with other networks; resume with the "
            "hyper-parameters that the training was started with"
        )
    agent.state = tree_unflatten([torch.from_numpy(a) for a in found], structure)

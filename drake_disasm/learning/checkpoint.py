"""A training's state on disk, written atomically after every episode."""

import contextlib
from collections.abc import Iterator
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
from drake_disasm.learning.agent import Agent
from drake_disasm.learning.replay import WIDTH, Replay

AGAIN = "delete it to start anew"
#: A memory of ten million transitions has 1.3 GB. Older versions wrote no checksum; a
#: training that they began goes on.
CHECKPOINT = ArchiveKind(
    "checkpoint",
    AGAIN,
    AGAIN,
    most_bytes=2**31,
    most_members=5000,
    checksum=False,
)
_OTHER = (
    "is of an agent with other networks ({}); resume with the hyper-parameters that "
    "the training was started with"
)


def save_checkpoint(
    path: Path, agent: Agent, replay: Replay, notes: dict[str, Any]
) -> None:
    """Writes an agent, its memory and notes (plain data) whole or not at all.

    Raises:
        DisasmError: the system refuses to write.
    """
    rows, following = replay.contents()
    own = {"updates": agent.updates, "following": following, "notes": notes}
    save_archive(path, agent.arrays() | {"replay": rows}, own)


def load_checkpoint(
    path: Path, agent: Agent, replay: Replay, example: dict[str, Any]
) -> dict[str, Any]:
    """Restores an agent and its memory, and returns the notes.

    Args:
        path: of the file.
        agent: of the same hyper-parameters.
        replay: large enough.
        example: what the notes must be like (`plain_data.check_like`).

    Raises:
        DisasmError: the file is damaged, or of another kind of agent. Neither has
            changed then.
    """
    arrays, own = load_archive(path, CHECKPOINT)
    with _named(path):
        check_like(own, {"updates": 0, "following": 0, "notes": example})
        rows = _rows(arrays, replay.width)
        _check_state(agent, arrays)
        replay.restore(rows, own["following"])
    agent.restore(arrays)
    agent.updates = own["updates"]
    return own["notes"]


def load_agent(path: Path, agent: Agent) -> None:
    """Gives an agent the state of another: networks, targets, Adam's moments.

    Raises:
        DisasmError: the file is damaged, or of another kind of agent.
    """
    arrays, _ = load_archive(path, CHECKPOINT)
    with _named(path):
        _rows(arrays)
        _check_state(agent, arrays)
    agent.restore(arrays)


def load_memory(path: Path, device: str = "numpy") -> Replay:
    """Returns the replay memory of a training, to draw from, on a device.

    Raises:
        DisasmError: the file is damaged.
    """
    arrays, _ = load_archive(path, CHECKPOINT)
    with _named(path):
        rows = _rows(arrays)
        replay = Replay(max(1, len(rows)), device=device)
        replay.restore(rows, 0)
    return replay


@contextlib.contextmanager
def _named(path: Path) -> Iterator[None]:
    """Puts a file's name before what is wrong with it."""
    try:
        yield
    except DisasmError as error:
        raise DisasmError(f"{path}: {error}") from None


def _rows(arrays: Arrays, width: int = WIDTH) -> np.ndarray:
    """Takes the memory's rows out of the arrays, and returns them."""
    wanted = {"replay": ArraySpec("float32", (None, width))}
    found = {"replay": arrays.pop("replay")} if "replay" in arrays else {}
    check_arrays(found, wanted, AGAIN)
    return found["replay"]


def _check_state(agent: Agent, arrays: Arrays) -> None:
    """Refuses arrays that are not the state of an agent like this one."""
    leaves = agent.arrays()
    for name, leaf in leaves.items():
        if name in arrays and arrays[name].shape != leaf.shape:
            raise DisasmError(_OTHER.format(f"{name} of {arrays[name].shape}"))
    if len(arrays) != len(leaves):
        raise DisasmError(_OTHER.format(f"{len(arrays)} arrays, not {len(leaves)}"))
    wanted = {n: ArraySpec(str(leaf.dtype)) for n, leaf in leaves.items()}
    check_arrays(arrays, wanted, AGAIN)

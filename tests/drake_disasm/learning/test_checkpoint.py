"""Checkpoints: whole, of this agent, finite; and those of older versions go on."""

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from torch.utils._pytree import tree_leaves

from drake_disasm.common.archive import Arrays, pack, unpack
from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.actor_critic import ActorCritic
from drake_disasm.learning.checkpoint import (
    CHECKPOINT,
    load_agent,
    load_checkpoint,
    load_memory,
    save_checkpoint,
)
from drake_disasm.learning.hyperparameters import Hyperparameters
from drake_disasm.learning.replay import WIDTH, Replay

CONFIG = Hyperparameters(hidden=[4], replay=20)
NOTES = {"episodes": [1, 2]}


def _agent(seed: int = 0) -> ActorCritic:
    return ActorCritic(CONFIG, seed, compiled=False)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    replay = Replay(20)
    ones = np.ones((9, 12))
    replay.add(ones, np.zeros((9, 6)), 1.0, ones, False)
    save_checkpoint(tmp_path / "c.npz", _agent(), replay, NOTES)
    return tmp_path / "c.npz"


def _load(path: Path) -> tuple[ActorCritic, Replay]:
    agent, replay = _agent(seed=1), Replay(20)
    assert load_checkpoint(path, agent, replay, {"episodes": [0]}) == NOTES
    return agent, replay


def test_all_of_it_comes_back(path: Path) -> None:
    agent, replay = _load(path)
    for a, b in zip(tree_leaves(agent.state), tree_leaves(_agent().state), strict=True):
        assert a.dtype == b.dtype and a.numpy().tobytes() == b.numpy().tobytes()
    assert replay.size == 9 and replay.contents()[1] == 9
    assert load_memory(path).size == 9


def test_one_without_a_checksum_as_older_versions_wrote_it_is_read(path: Path) -> None:
    with np.load(path) as file:
        arrays = dict(file)
    del arrays["sha256"]
    np.savez(path, **arrays)  # type: ignore[arg-type]
    assert _load(path)[1].size == 9


Change = Callable[[Arrays, dict[str, Any]], Any]
NAN = float("nan")


def _put(name: str, array: Any) -> Change:
    return lambda a, t: a.update({name: array})


def _say(**words: Any) -> Change:
    return lambda a, t: t.update(words)


def _singles(arrays: Arrays, text: dict[str, Any]) -> None:
    singles = {k: v.astype("f4") for k, v in arrays.items() if v.dtype == "f8"}
    arrays.update(singles)


_NARROW = np.ones((9, 3), np.float32)
_LARGE = np.ones((21, WIDTH), np.float32)
#: What is done to a checkpoint before its checksum is made, and what is said about it.
BROKEN: dict[str, tuple[Change, str]] = {
    "NaN": (lambda a, t: a["state_000"].__setitem__(0, NAN), "NaN or inf.* state_000"),
    "doubles": (_put("state_000", np.ones((4, 12))), "state_000 of float64"),
    "singles": (_singles, "of float32, not float64"),
    "shape": (_put("state_000", np.ones((3, 3), np.float32)), "other networks"),
    "missing": (lambda a, t: a.pop("state_001"), "other networks"),
    "stranger": (lambda a, t: a.update(spam=a.pop("state_001")), "lacks|unknown"),
    "no memory": (lambda a, t: a.pop("replay"), "lacks array 'replay'"),
    "NaN in memory": (lambda a, t: a["replay"].__setitem__((0, 0), NAN), "NaN"),
    "double memory": (_put("replay", np.ones((9, WIDTH))), "replay of float64"),
    "narrow memory": (_put("replay", _NARROW), "replay of shape"),
    "large memory": (_put("replay", _LARGE), "does not fit one of"),
    "next row": (_say(following=20), "next row is 20"),
    "next row is a word": (_say(following="9"), "for following"),
    "no updates": (lambda a, t: t.pop("updates"), "lacks 'updates'"),
    "notes": (_say(notes={"episodes": ["a"]}), "notes.episodes.0"),
    "other notes": (_say(notes={}), "lacks 'notes.episodes'"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_content_is_one_line_and_changes_nothing(name: str, path: Path) -> None:
    change, words = BROKEN[name]
    arrays, text = unpack(path.read_bytes(), CHECKPOINT)
    change(arrays, text)
    path.write_bytes(pack(arrays, text))
    agent, replay = _agent(), Replay(20)
    before = copy.deepcopy(agent.state)
    with pytest.raises(DisasmError, match=words) as caught:
        load_checkpoint(path, agent, replay, {"episodes": [0]})
    message = str(caught.value)
    assert message.startswith(f"{path}: ") and "\n" not in message
    assert replay.size == 0 and agent.updates == 0
    for a, b in zip(tree_leaves(before), tree_leaves(agent.state), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("load", [load_memory, lambda p: load_agent(p, _agent())])
@pytest.mark.parametrize("name", ["no memory", "narrow memory"])
def test_a_start_from_another_training_is_checked_too(name, load, path):
    arrays, text = unpack(path.read_bytes(), CHECKPOINT)
    BROKEN[name][0](arrays, text)
    path.write_bytes(pack(arrays, text))
    with pytest.raises(DisasmError, match=BROKEN[name][1]):
        load(path)

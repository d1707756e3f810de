"""The selection as it stood at one commit, asked in a process of its own.

Its files are unpacked from git into build/frozen-selection when they are not there.
The process there runs `frozen_worker.py`, which reads cases and writes answers, line by
line, so that Drake is loaded once.
"""

import atexit
import json
import os
import subprocess
import sys
import tarfile
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

from drake_disasm.common.errors import DisasmError
from selection.answer import Answer, Case

COMMIT = "afdf342"

_ROOT = Path(__file__).parents[2]
_FOLDER = _ROOT / "build" / "frozen-selection"
_WORKER = Path(__file__).parent / "frozen_worker.py"


def select(case: Case) -> Answer:
    """Returns what the frozen selection says of a case."""
    return asked(case, {})


def asked(case: Case, settings: dict[str, Any]) -> Answer:
    """Returns what it says of a case with some settings changed."""
    return Answer.of_plain(_reply({"case": vars(case), "settings": settings}))


def settings_read(case: Case) -> set[str]:
    """Returns the names of the settings that it reads for a case."""
    return set(_reply({"case": vars(case), "settings": None}))


def defaults() -> dict[str, Any]:
    """Returns the default settings."""
    found: dict[str, Any] = _reply({})
    return found


def _reply(request: dict[str, Any]) -> Any:
    """Returns the worker's reply to a request, as plain data."""
    process = _worker()
    assert process.stdin is not None and process.stdout is not None
    print(json.dumps(request), file=process.stdin, flush=True)
    line = process.stdout.readline()
    if not line:
        _worker.cache_clear()
        raise DisasmError(f"{_WORKER.name}: the process ended")
    return json.loads(line)


@cache
def _worker() -> "subprocess.Popen[str]":
    _unpack()
    path = os.pathsep.join(str(p) for p in (_FOLDER, _ROOT / "benchmarks"))
    process = subprocess.Popen(
        [sys.executable, str(_WORKER)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": path},
    )
    atexit.register(process.kill)
    return process


def _unpack() -> None:
    """Writes the commit's files into the folder.

    Raises:
        DisasmError: git does not have the commit.
    """
    if (_FOLDER / "sysid").is_dir():
        return
    command = ["git", "-C", str(_ROOT), "archive", COMMIT]
    done = subprocess.run(command, capture_output=True)
    if done.returncode:
        raise DisasmError(
            f"`selector` frozen: git has no commit {COMMIT} here; fetch the whole "
            "history"
        )
    _FOLDER.mkdir(parents=True, exist_ok=True)
    with tarfile.open(fileobj=BytesIO(done.stdout)) as archive:
        archive.extractall(_FOLDER, filter="data")

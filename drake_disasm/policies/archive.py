"""Named arrays and a text in one .npz: no pickle, and damage is always detected."""

import hashlib
import io
import json
import zipfile
from typing import Any

import numpy as np

from drake_disasm.common.errors import DisasmError

Arrays = dict[str, np.ndarray]

AGAIN = "copy it again, or train it again (tools/train.py)"
_OURS = "give one that tools/train.py wrote"
_STAMP = (1980, 1, 1, 0, 0, 0)  # the earliest that a zip can say


def pack(arrays: Arrays, text: dict[str, Any]) -> bytes:
    """Returns an .npz of arrays and plain data; equal input gives equal bytes."""
    plain = json.dumps(text, sort_keys=True).encode()
    content = arrays | {"text": np.frombuffer(plain, dtype=np.uint8)}
    digest = np.frombuffer(_checksum(content), dtype=np.uint8)
    return _zipped(content | {"sha256": digest})


def unpack(data: bytes) -> tuple[Arrays, dict[str, Any]]:
    """Returns the arrays and the text that were packed.

    Raises:
        DisasmError: not such a file, or its content has changed.
    """
    if not data.startswith(b"PK"):
        raise DisasmError(f"is no .npz file; {_OURS}")
    arrays = _unzipped(data)
    for name in ("sha256", "text"):
        if name not in arrays:
            raise DisasmError(f"is no policy, it lacks '{name}'; {_OURS}")
    if arrays.pop("sha256").tobytes() != _checksum(arrays):
        raise DisasmError(f"is damaged, its checksum does not match; {AGAIN}")
    try:
        text = json.loads(arrays.pop("text").tobytes())
    except ValueError as error:
        raise DisasmError(f"has a text that is no JSON ({error}); {AGAIN}") from None
    if not isinstance(text, dict):
        raise DisasmError(f"has a text that is no mapping; {AGAIN}")
    return arrays, text


def _zipped(arrays: Arrays) -> bytes:
    """Returns what np.savez writes, without the time of day."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name in sorted(arrays):
            content = io.BytesIO()
            np.lib.format.write_array(content, arrays[name], allow_pickle=False)
            entry = zipfile.ZipInfo(f"{name}.npy", _STAMP)
            archive.writestr(entry, content.getvalue())
    return buffer.getvalue()


def _unzipped(data: bytes) -> Arrays:
    """Returns the arrays; parsed only after the zip's own checksum of each is right."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return {
                name.removesuffix(".npy"): np.lib.format.read_array(
                    io.BytesIO(archive.read(name)), allow_pickle=False
                )
                for name in archive.namelist()
            }
    except Exception as error:  # zipfile and NumPy promise no kind of their own
        why = (str(error) or type(error).__name__).splitlines()[0]
        raise DisasmError(f"is damaged ({why}); {AGAIN}") from None


def _checksum(arrays: Arrays) -> bytes:
    digest = hashlib.sha256()
    for name in sorted(arrays):
        values = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {values.dtype.str} {values.shape} ".encode())
        digest.update(values.tobytes())
    return digest.digest()

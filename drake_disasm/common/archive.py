"""Named arrays and a text in one .npz: no pickle, and damage is always detected.

Members are stored uncompressed, as NumPy does: what is unpacked is never larger than
the file, whatever its directory says.
"""

import hashlib
import io
import json
import math
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_bytes, write_atomically
from drake_disasm.common.text import clipped

Arrays = dict[str, np.ndarray]

_STAMP = (1980, 1, 1, 0, 0, 0)  # the earliest that a zip can say
_KINDS = "biufSU"  # plain numbers and text
_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


@dataclass(frozen=True)
class ArchiveKind:
    """One kind of archive: what may be in it, and what messages say.

    Attributes:
        name: for messages, such as "policy".
        origin: remedy for a file that is something else, such as "give one that
            drake-disasm train wrote".
        remedy: what to do about a damaged one.
        most_bytes: of the file, and of all its members unpacked.
        most_members: arrays, at most.
        checksum: whether it must hold one; no for kinds that older versions wrote
            without.
    """

    name: str
    origin: str
    remedy: str
    most_bytes: int
    most_members: int
    checksum: bool = True


@dataclass(frozen=True)
class ArraySpec:
    """What an array must be.

    Attributes:
        dtype: its type, such as "float32".
        shape: its shape; None for an axis of any length, or for any shape.
    """

    dtype: str
    shape: tuple[int | None, ...] | None = None

    def fits(self, shape: tuple[int, ...]) -> bool:
        """Returns whether an array may have this shape."""
        if self.shape is None:
            return True
        return len(shape) == len(self.shape) and all(
            wanted in (None, n) for wanted, n in zip(self.shape, shape, strict=True)
        )


def write_archive(stream: IO[bytes], arrays: Arrays, text: dict[str, Any]) -> None:
    """Writes an .npz of arrays and plain data; equal input gives equal bytes."""
    plain = json.dumps(text, sort_keys=True).encode()
    content = arrays | {"text": np.frombuffer(plain, dtype=np.uint8)}
    content["sha256"] = np.frombuffer(_checksum(content), dtype=np.uint8)
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as archive:
        for name in sorted(content):
            entry = zipfile.ZipInfo(f"{name}.npy", _STAMP)
            entry.file_size = content[name].nbytes  # beyond 2 GiB a zip is another
            with archive.open(entry, "w") as member:
                np.lib.format.write_array(member, content[name], allow_pickle=False)


def save_archive(path: Path, arrays: Arrays, text: dict[str, Any]) -> None:
    """Writes a file whole or not at all; see `write_archive`."""
    write_atomically(path, lambda stream: write_archive(stream, arrays, text))


def load_archive(path: Path, kind: ArchiveKind) -> tuple[Arrays, dict[str, Any]]:
    """Returns the arrays and the text of a file; see `unpack`.

    Raises:
        DisasmError: begins with the path.
    """
    data = read_bytes(path, kind.origin, kind.most_bytes)
    try:
        return unpack(data, kind)
    except DisasmError as error:
        raise DisasmError(f"{path}: {error}") from None


def pack(arrays: Arrays, text: dict[str, Any]) -> bytes:
    """Returns what `write_archive` writes."""
    buffer = io.BytesIO()
    write_archive(buffer, arrays, text)
    return buffer.getvalue()


def unpack(data: bytes, kind: ArchiveKind) -> tuple[Arrays, dict[str, Any]]:
    """Returns the arrays and the text that were packed.

    Raises:
        DisasmError: not such a file, too large, or its content has changed.
    """
    if not data.startswith(b"PK"):
        raise DisasmError(f"is no .npz file; {kind.origin}")
    arrays = _unzipped(data, kind)
    for name in ("sha256", "text") if kind.checksum else ("text",):
        if name not in arrays:
            raise DisasmError(f"is no {kind.name}, it lacks '{name}'; {kind.origin}")
    digest = arrays.pop("sha256", None)
    if digest is not None and digest.tobytes() != _checksum(arrays):
        raise DisasmError(f"is damaged, its checksum does not match; {kind.remedy}")
    return arrays, _parsed(arrays.pop("text"), kind)


def check_arrays(
    arrays: Arrays, wanted: Mapping[str, ArraySpec], remedy: str, finite: bool = True
) -> None:
    """Refuses arrays that are not the wanted ones.

    Args:
        arrays: by name.
        wanted: all that there must be, and nothing else.
        remedy: for messages.
        finite: whether NaN and infinity are refused.

    Raises:
        DisasmError: one is missing, unknown, of another type or shape, or not finite.
    """
    for name in sorted(wanted.keys() ^ arrays.keys()):
        verb = "lacks" if name in wanted else "has an unknown"
        raise DisasmError(f"{verb} array '{clipped(name)}'; {remedy}")
    for name, spec in wanted.items():
        values = arrays[name]
        if values.dtype != np.dtype(spec.dtype):
            raise DisasmError(
                f"has {name} of {values.dtype}, not {spec.dtype}; {remedy}"
            )
        if not spec.fits(values.shape):
            raise DisasmError(
                f"has {name} of shape {clipped(str(values.shape))}, not {spec.shape}; "
                f"{remedy}"
            )
        if finite and values.dtype.kind == "f" and not np.isfinite(values).all():
            raise DisasmError(f"has NaN or infinity in {name}; {remedy}")


def _unzipped(data: bytes, kind: ArchiveKind) -> Arrays:
    """Returns the arrays; parsed only after the zip's own checksum of each is right."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            entries = archive.infolist()
            _check_directory(entries, len(data), kind)
            return {
                entry.filename.removesuffix(".npy"): _array(archive, entry)
                for entry in entries
            }
    except DisasmError:
        raise
    except Exception as error:  # zipfile and NumPy promise no kind of their own
        why = clipped(str(error) or type(error).__name__)
        raise DisasmError(f"is damaged ({why}); {kind.remedy}") from None


def _check_directory(
    entries: list[zipfile.ZipInfo], size: int, kind: ArchiveKind
) -> None:
    """Refuses a zip by what its directory says, before anything is unpacked."""
    if len(entries) > kind.most_members:
        raise DisasmError(
            f"has {len(entries)} members, a {kind.name} has {kind.most_members} at "
            f"most; {kind.origin}"
        )
    if any(entry.compress_type != zipfile.ZIP_STORED for entry in entries):
        raise DisasmError(f"is compressed, a {kind.name} never is; {kind.origin}")
    if sum(entry.file_size for entry in entries) > min(size, kind.most_bytes):
        raise DisasmError(f"is damaged (members larger than itself); {kind.remedy}")
    names = {entry.filename for entry in entries}
    if len(names) < len(entries):
        raise DisasmError(f"is damaged (a member is there twice); {kind.remedy}")


def _array(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> np.ndarray:
    """Returns a member's array, whose size must be the one that its header says."""
    with archive.open(entry) as member:
        stream = io.BytesIO(member.read(entry.file_size + 1))
    version = np.lib.format.read_magic(stream)
    if version not in _HEADERS:
        raise ValueError(f"array format {version}")
    shape, in_columns, dtype = _HEADERS[version](stream)
    if dtype.hasobject:
        raise ValueError("Object arrays are pickled")
    if dtype.kind not in _KINDS:
        raise ValueError(f"array of {dtype}")
    content = stream.read()
    if min(shape, default=1) < 0 or math.prod(shape) * dtype.itemsize != len(content):
        raise ValueError(f"{entry.filename} is cut or too long")
    values = np.frombuffer(bytearray(content), dtype)  # which may be written to
    return values.reshape(shape, order="F" if in_columns else "C")


def _parsed(text: np.ndarray, kind: ArchiveKind) -> dict[str, Any]:
    try:
        plain = json.loads(text.tobytes())
    except (ValueError, RecursionError) as error:
        raise DisasmError(
            f"has a text that is no JSON ({clipped(str(error))}); {kind.remedy}"
        ) from None
    if not isinstance(plain, dict):
        raise DisasmError(f"has a text that is no mapping; {kind.remedy}")
    return plain


def _checksum(arrays: Arrays) -> bytes:
    digest = hashlib.sha256()
    for name in sorted(arrays):
        values = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {values.dtype.str} {values.shape} ".encode())
        digest.update(values.tobytes())
    return digest.digest()

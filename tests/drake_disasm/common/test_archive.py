"""Archives: damage and bombs are refused in one line, before they are unpacked."""

import io
import struct
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.common.archive import (
    ArchiveKind,
    Arrays,
    ArraySpec,
    check_arrays,
    load_archive,
    pack,
    save_archive,
    unpack,
)
from drake_disasm.common.errors import DisasmError

KIND = ArchiveKind("box", "give a box", "pack it again", 2**20, most_members=5)
ARRAYS: Arrays = {
    "a": np.arange(6.0).reshape(2, 3),
    "b": np.asfortranarray(np.arange(6, dtype=np.float32).reshape(2, 3)),
    "c": np.array(3),
}


def _refusal(call: Callable[[], object]) -> str:
    with pytest.raises(DisasmError) as caught:
        call()
    message = str(caught.value)
    assert "\n" not in message and "; " in message and len(message) < 400
    return message


def _zipped(members: dict[str, bytes], method: int = zipfile.ZIP_STORED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def _member(header: str, content: bytes = b"", version: int = 1) -> bytes:
    """Returns an .npy whose header says whatever it is told to."""
    text = header.encode() + b"\n"
    length = struct.pack("<H" if version == 1 else "<I", len(text))
    return b"\x93NUMPY" + bytes([version, 0]) + length + text + content


def test_arrays_come_back_bit_for_bit_and_may_be_changed(tmp_path: Path) -> None:
    save_archive(tmp_path / "a.npz", ARRAYS, {"x": [1, 0.1]})
    arrays, text = load_archive(tmp_path / "a.npz", KIND)
    assert text == {"x": [1, 0.1]} and arrays.keys() == ARRAYS.keys()
    for name, values in arrays.items():
        np.testing.assert_array_equal(values, ARRAYS[name])
        assert values.dtype == ARRAYS[name].dtype
        values += 1  # not a view of read-only bytes
    assert (tmp_path / "a.npz").read_bytes() == pack(ARRAYS, {"x": [1, 0.1]})


def test_bombs_are_refused_at_once(tmp_path: Path) -> None:
    """6 GiB of zeros are 6 MB of zip; each is refused by its directory alone."""
    buffer, zeros = io.BytesIO(), bytes(2**24)
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        with archive.open("a.npy", "w", force_zip64=True) as member:
            for _ in range(4):  # the directory is made to say 6 GiB below
                member.write(zeros)
        archive.infolist()[0].file_size = 6 * 2**30
    begun = time.process_time()
    assert "is compressed" in _refusal(lambda: unpack(buffer.getvalue(), KIND))
    assert time.process_time() - begun < 0.5


def test_members_beyond_the_file_are_refused() -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("a.npy", b"few")
        archive.infolist()[0].file_size = 2**30
    assert "larger than itself" in _refusal(lambda: unpack(buffer.getvalue(), KIND))


def test_many_members_are_refused() -> None:
    data = _zipped({f"{i}.npy": b"" for i in range(6)})
    assert "6 members" in _refusal(lambda: unpack(data, KIND))


def test_large_files_are_refused(tmp_path: Path) -> None:
    save_archive(tmp_path / "a.npz", {"a": np.zeros(2**18)}, {})
    assert "1 MiB" in _refusal(lambda: load_archive(tmp_path / "a.npz", KIND))


HEADERS = {
    "too long": "{'descr': '<f8', 'fortran_order': False, 'shape': (10**15,), }",
    "huge": "{'descr': '<f8', 'fortran_order': False, 'shape': (999999999999999,), }",
    "negative": "{'descr': '<f8', 'fortran_order': False, 'shape': (-1, -8), }",
    "object": "{'descr': '|O', 'fortran_order': False, 'shape': (1,), }",
    "void": "{'descr': '|V8', 'fortran_order': False, 'shape': (1,), }",
    "fields": "{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (1,), }",
    "times": "{'descr': '<M8[s]', 'fortran_order': False, 'shape': (1,), }",
    "no Python": "{'descr'",
    "nested": "(" * 3000 + ")" * 3000,
    "no header": "7",
    "unknown type": "{'descr': '<q9', 'fortran_order': False, 'shape': (1,), }",
}


@pytest.mark.parametrize("name", HEADERS)
@pytest.mark.parametrize("version", [1, 2, 3, 9])
def test_odd_array_headers_are_refused(name: str, version: int) -> None:
    member = _member(HEADERS[name], bytes(8), version)
    data = _zipped({"a.npy": member, "text.npy": b""})
    assert "is damaged" in _refusal(lambda: unpack(data, KIND))


def test_without_a_checksum_only_where_it_is_allowed(tmp_path: Path) -> None:
    """As NumPy writes it, and older versions did."""
    text = np.frombuffer(b"{}", dtype=np.uint8)
    np.savez(tmp_path / "a.npz", a=np.ones(2), text=text)
    data = (tmp_path / "a.npz").read_bytes()
    assert "lacks 'sha256'" in _refusal(lambda: unpack(data, KIND))
    old = ArchiveKind("box", "give a box", "pack it again", 2**20, 5, checksum=False)
    assert unpack(data, old)[0]["a"].tolist() == [1.0, 1.0]
    changed = {**ARRAYS, "a": ARRAYS["a"] + 1, "sha256": np.zeros(32, np.uint8)}
    np.savez(tmp_path / "a.npz", text=text, **changed)  # type: ignore[arg-type]
    data = (tmp_path / "a.npz").read_bytes()
    assert "checksum" in _refusal(lambda: unpack(data, old))


@pytest.mark.parametrize("text", ["", "[]", "{", "[" * 10**5, "9" * 5000])
def test_odd_texts_are_refused(text: str, tmp_path: Path) -> None:
    content = np.frombuffer(text.encode(), dtype=np.uint8)
    np.savez(tmp_path / "a.npz", text=content)
    old = ArchiveKind("box", "give a box", "pack it again", 2**20, 5, checksum=False)
    data = (tmp_path / "a.npz").read_bytes()
    assert "a text that is no" in _refusal(lambda: unpack(data, old))


WANTED = {"a": ArraySpec("float64", (2, None)), "b": ArraySpec("float32")}
UNLIKE: dict[str, tuple[Arrays, str]] = {
    "missing": ({"a": np.ones((2, 3))}, "lacks array 'b'"),
    "unknown": ({"z": np.ones(1)}, "lacks array 'a'|has an unknown array 'z'"),
    "type": ({"a": np.ones((2, 3), np.float32)}, "a of float32, not float64"),
    "axes": ({"a": np.ones(2)}, r"a of shape \(2,\), not \(2, None\)"),
    "length": ({"a": np.ones((3, 3))}, r"a of shape \(3, 3\)"),
    "NaN": ({"a": np.full((2, 1), np.nan)}, "NaN or infinity in a"),
}


@pytest.mark.parametrize("name", UNLIKE)
def test_arrays_that_are_not_the_wanted_ones_are_refused(name: str) -> None:
    change, words = UNLIKE[name]
    arrays: Arrays = {"b": np.ones(1, np.float32)} if name != "missing" else {}
    with pytest.raises(DisasmError, match=words):
        check_arrays(arrays | change, WANTED, "pack it again")


def test_arrays_that_fit_are_taken() -> None:
    arrays: Arrays = {"a": np.ones((2, 9)), "b": np.ones(1, np.float32)}
    check_arrays(arrays, WANTED, "pack it again")
    arrays["a"][0] = np.inf
    check_arrays(arrays, WANTED, "pack it again", finite=False)

"""Archives: damage and bombs are refused in one line, before they are unpacked."""

import dataclasses
import io
import struct
import zipfile
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
from tests.refusals import refusal

KIND = ArchiveKind("box", "give a box", "pack it again", 2**20, most_members=5)
OLD = dataclasses.replace(KIND, checksum=False)
ARRAYS: Arrays = {
    "a": np.arange(6.0).reshape(2, 3),
    "b": np.asfortranarray(np.arange(6, dtype=np.float32).reshape(2, 3)),
    "c": np.array(3),
}


def _zipped(members: dict[str, bytes], said: int = 0, **options: int) -> bytes:
    """Returns a zip; its directory may say another size of the first member."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", **options) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
        if said:
            archive.infolist()[0].file_size = said
    return buffer.getvalue()


def _member(header: str, content: bytes = b"", version: int = 1) -> bytes:
    """Returns an .npy whose header says whatever it is told to."""
    text = header.encode() + b"\n"
    length = struct.pack("<H" if version == 1 else "<I", len(text))
    return b"\x93NUMPY" + bytes([version, 0]) + length + text + content


def _saved(**arrays: np.ndarray) -> bytes:
    """Returns an archive as NumPy writes it, without a checksum."""
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def _text(content: str) -> np.ndarray:
    return np.frombuffer(content.encode(), dtype=np.uint8)


def test_arrays_come_back_bit_for_bit_and_may_be_changed(tmp_path: Path) -> None:
    save_archive(tmp_path / "a.npz", ARRAYS, {"x": [1, 0.1]})
    arrays, text = load_archive(tmp_path / "a.npz", KIND)
    assert text == {"x": [1, 0.1]} and arrays.keys() == ARRAYS.keys()
    for name, values in arrays.items():
        np.testing.assert_array_equal(values, ARRAYS[name])
        assert values.dtype == ARRAYS[name].dtype
        values += 1  # not a view of read-only bytes
    assert (tmp_path / "a.npz").read_bytes() == pack(ARRAYS, {"x": [1, 0.1]})


def test_bombs_are_refused_by_their_directory(tmp_path: Path) -> None:
    bomb = _zipped({"a.npy": bytes(100)}, 6 * 2**30, compression=zipfile.ZIP_DEFLATED)
    assert "is compressed" in refusal(unpack, bomb, KIND)
    larger = _zipped({"a.npy": b"few"}, 2**30)
    assert "larger than itself" in refusal(unpack, larger, KIND)
    many = _zipped({f"{i}.npy": b"" for i in range(6)})
    assert "6 members" in refusal(unpack, many, KIND)
    save_archive(tmp_path / "a.npz", {"a": np.zeros(2**18)}, {})
    assert "1 MiB" in refusal(load_archive, tmp_path / "a.npz", KIND)


HEADERS = {
    "too long": "{'descr': '<f8', 'fortran_order': False, 'shape': (10**15,), }",
    "huge": "{'descr': '<f8', 'fortran_order': False, 'shape': (999999999999999,), }",
    "negative": "{'descr': '<f8', 'fortran_order': False, 'shape': (-1, -8), }",
    "object": "{'descr': '|O', 'fortran_order': False, 'shape': (1,), }",
    "void": "{'descr': '|V8', 'fortran_order': False, 'shape': (1,), }",
    "times": "{'descr': '<M8[s]', 'fortran_order': False, 'shape': (1,), }",
    "nested": "(" * 3000 + ")" * 3000,
}
WELL = "{'descr': '<f8', 'fortran_order': False, 'shape': (1,), }"


@pytest.mark.parametrize("name", HEADERS)
def test_odd_array_headers_are_refused(name: str) -> None:
    for version in (1, 2):
        member = _member(HEADERS[name], bytes(8), version)
        data = _zipped({"a.npy": member, "text.npy": b""})
        assert "is damaged" in refusal(unpack, data, KIND)


def test_the_third_version_of_arrays_is_refused() -> None:
    members = [_member(WELL, bytes(8), version) for version in (1, 2, 3)]
    text = _member("{'descr': '|u1', 'fortran_order': False, 'shape': (2,), }", b"{}")
    *read, refused = (_zipped({"a.npy": m, "text.npy": text}) for m in members)
    for data in read:
        assert unpack(data, OLD)[0]["a"].tolist() == [0.0]
    assert "array format (3, 0)" in refusal(unpack, refused, OLD)


def test_without_a_checksum_only_where_it_is_allowed() -> None:
    """As NumPy writes it, and older versions did."""
    data = _saved(a=np.ones(2), text=_text("{}"))
    assert "lacks 'sha256'" in refusal(unpack, data, KIND)
    assert unpack(data, OLD)[0]["a"].tolist() == [1.0, 1.0]
    changed = ARRAYS | {"a": ARRAYS["a"] + 1, "sha256": np.zeros(32, np.uint8)}
    data = _saved(text=_text("{}"), **changed)
    assert "checksum" in refusal(unpack, data, OLD)
    assert "no .npz file" in refusal(unpack, b"text", OLD)


@pytest.mark.parametrize("text", ["[]", "{", "[" * 10**5, "9" * 5000])
def test_odd_texts_are_refused(text: str) -> None:
    assert "a text that is no" in refusal(unpack, _saved(text=_text(text)), OLD)


WANTED = {"a": ArraySpec("float64", (2, None)), "b": ArraySpec("float32")}
FITTING: Arrays = {"a": np.ones((2, 9)), "b": np.ones(1, np.float32)}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"z": np.ones(1)}, "has an unknown array 'z'"),
        ({"a": np.ones((2, 3), np.float32)}, "a of float32, not float64"),
        ({"a": np.ones(2)}, "a of shape (2,), not (2, None)"),
        ({"a": np.ones((3, 3))}, "a of shape (3, 3)"),
        ({"a": np.full((2, 1), np.nan)}, "NaN or infinity in a"),
    ],
)
def test_arrays_that_are_not_the_wanted_ones_are_refused(change, words) -> None:
    assert words in refusal(check_arrays, FITTING | change, WANTED, "pack it again")


def test_arrays_that_fit_are_taken() -> None:
    check_arrays(FITTING, WANTED, "pack it again")
    lacking = {"b": FITTING["b"]}
    assert "lacks array 'a'" in refusal(check_arrays, lacking, WANTED, "pack it again")
    infinite = FITTING | {"a": np.full((2, 9), np.inf)}
    check_arrays(infinite, WANTED, "pack it again", finite=False)

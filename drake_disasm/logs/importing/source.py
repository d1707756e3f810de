"""What a recording holds: streams of channels, each with a clock of its own."""

import dataclasses
import hashlib
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.text import clipped
from drake_disasm.logs.importing import bags, sheets, tables
from drake_disasm.logs.importing.stream import Stream

_MOST_BYTES = 2**33
_CHUNK = 2**20

#: What reads a file, by the ending of its name.
_READERS: Mapping[str, Callable[[Path], list[Stream]]] = {
    ".csv": tables.read_csv,
    ".txt": tables.read_csv,
    ".xlsx": sheets.read_xlsx,
    ".npz": tables.read_npz,
    ".npy": tables.read_npy,
    ".mat": tables.read_mat,
    ".parquet": tables.read_parquet,
    ".mcap": bags.read_bag,
    ".db3": bags.read_bag,
    ".bag": bags.read_bag,
}


@dataclasses.dataclass(frozen=True)
class Source:
    """One recording.

    Attributes:
        path: of the file or folder.
        streams: of a table one, of a bag one for each topic.
        sha256: of the file's bytes, or of those of all files in the folder.
        parts: paths and sums of the files that it is joined of, or ().
    """

    path: Path
    streams: tuple[Stream, ...]
    sha256: str
    parts: tuple[tuple[str, str], ...] = ()

    @property
    def label(self) -> str:
        """What to call it by: its sheet, or its file without the ending."""
        return sheets.parted(self.path)[1] or self.path.stem

    @property
    def notes(self) -> list[str]:
        """What its reader took for granted, or could not read, after its name."""
        return [f"{self.path.name}: {n}" for s in self.streams for n in s.notes]

    @property
    def files(self) -> dict[str, str]:
        """The sums of its files, by their paths."""
        return dict(self.parts or ((str(self.path), self.sha256),))

    def stream_of(self, channel: str) -> Stream:
        """Returns the stream that has a channel.

        Args:
            channel: "name", or "topic:name" in a bag.

        Raises:
            DisasmError: there is none of that name; names those that come near.
        """
        for stream in self.streams:
            if channel in stream.names:
                return stream
        for stream in self.streams:
            for name, why in stream.left_out.items():
                if channel == name or channel.rpartition(".")[0] == name:
                    raise DisasmError(f"{self.path}: '{clipped(name)}' {why}")
        known = [name for stream in self.streams for name in stream.names]
        raise DisasmError(
            f"{self.path}: has no channel '{clipped(channel)}'; "
            f"{_nearest(channel, known)}"
        )

    def channel(self, name: str) -> NDArray[np.float64]:
        """Returns the values (n,) of a channel, as recorded."""
        return self.stream_of(name).channels[name]


def _nearest(name: str, known: list[str]) -> str:
    import difflib

    near = difflib.get_close_matches(name, known, 3, 0.5) or known[:8]
    return f"it has {', '.join(near)}{' ...' if len(near) < len(known) else ''}"


def read_source(path: Path) -> Source:
    """Reads a recording: CSV, XLSX, NPZ, NPY, MAT, Parquet, LeRobot, ROS bag or MCAP.

    Args:
        path: of a file, FILE.xlsx:SHEET, or of the folder of a ROS 2 bag or a LeRobot
            dataset.

    Raises:
        DisasmError: it is not there, of no known format, or can't be read.
    """
    file, sheet = sheets.parted(path)
    if not file.exists():
        raise DisasmError(f"{file}: does not exist")
    files = (
        [file] if file.is_file() else sorted(p for p in file.rglob("*") if p.is_file())
    )
    if sum(file.stat().st_size for file in files) > _MOST_BYTES:
        raise DisasmError(f"{path}: is larger than {_MOST_BYTES / 2**30:g} GiB; cut it")
    streams = sheets.read_xlsx(file, sheet) if sheet else _read(file, files)
    return Source(path, tuple(streams), _hash(files))


def _read(path: Path, files: list[Path]) -> list[Stream]:
    if path.is_file():
        reader = _READERS.get(path.suffix.lower())
        if reader is None:
            raise DisasmError(
                f"{path}: is of no known format; known: {', '.join(_READERS)}, and "
                "folders of ROS 2 bags and LeRobot datasets"
            )
        return reader(path)
    if (path / "metadata.yaml").exists():
        return bags.read_bag(path)
    parquet = [file for file in files if file.suffix == ".parquet"]
    if (path / "meta/info.json").exists() and parquet:
        return tables.read_lerobot(path)
    raise DisasmError(
        f"{path}: is a folder, but neither a ROS 2 bag (metadata.yaml) nor a LeRobot "
        "dataset (meta/info.json); name a file"
    )


def _hash(files: list[Path]) -> str:
    found = hashlib.sha256()
    for file in files:
        with file.open("rb") as stream:
            while chunk := stream.read(_CHUNK):
                found.update(chunk)
    return found.hexdigest()

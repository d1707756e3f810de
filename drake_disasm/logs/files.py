"""The files of a log: names of episodes, and what a killed writer leaves."""

import re
from pathlib import Path

from drake_disasm.logs.refusal import refusal

_EPISODE = re.compile(r"episode_(\d{4,})\.(parquet|csv)")
_UNFINISHED = re.compile(r"\.episode_(\d{4,})\.unfinished\.csv")
_TEMPORARY = re.compile(r"\..*\.tmp")


def episode_path(folder: Path, number: int, file_format: str) -> Path:
    """The file of an episode, such as `folder/episode_0007.parquet`."""
    return folder / f"episode_{number:04d}.{file_format}"


def episode_files(folder: Path) -> dict[int, Path]:
    """The episodes of a log by number, in order; gaps are allowed.

    Raises:
        DisasmError: a file's name starts as an episode's and is none, or two files
            have the same number.
    """
    found: dict[int, Path] = {}
    for path in sorted(folder.glob("episode_*")):
        number = _episode_number(path)
        if number in found:
            raise refusal(
                path, f"same episode as '{found[number].name}'", "remove one of them"
            )
        found[number] = path
    return dict(sorted(found.items()))


def _episode_number(path: Path) -> int:
    match = _EPISODE.fullmatch(path.name)
    if not match:
        raise refusal(
            path,
            "not an episode's file name",
            "rename it to the pattern episode_0000.csv or episode_0000.parquet",
        )
    return int(match[1])


def unfinished_path(folder: Path, number: int) -> Path:
    """The file that an episode's rows go to while it is recorded."""
    return folder / f".episode_{number:04d}.unfinished.csv"


def unfinished_files(folder: Path) -> dict[int, Path]:
    """The episodes that are being recorded, or were when their program was killed."""
    matches = ((_UNFINISHED.fullmatch(p.name), p) for p in sorted(folder.iterdir()))
    return {int(match[1]): path for match, path in matches if match}


def is_empty(folder: Path) -> bool:
    """Whether a folder holds nothing but what a killed writer may leave behind."""
    return all(_TEMPORARY.fullmatch(path.name) for path in folder.iterdir())

"""The list of cases; each is written to a folder when it is first asked for."""

import fnmatch
import hashlib
import re
import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path

from drake_disasm.common.errors import DisasmError
from selection.answer import Case
from selection.cell import cell_plans, write_cell_case
from selection.readings import sensor_plans, write_sensor_case
from selection.real import RECORDED, SLOW, write_half, write_whole
from selection.simulated import arm_plans, write_arm_case

#: Patterns that stand for several: what takes seconds, and what takes minutes.
SETS = {
    "fast": ("joint/*", "filter/*", "unmodelled/*", "static*", "real/[!s]*"),
    "all": ("joint/*", "filter/*", "unmodelled/*", "static*", "real/*", "cell/*"),
}
_SEEDS, _MORE = (0,), (1, 2, 3, 4)

#: Writes a case: its folder, and the folder of logs that cases share.
Writer = Callable[[Path, Path], Case]


def known_cases() -> dict[str, Writer]:
    """Returns what writes each case, by its name.

    Those under "more/" are more of the same with other seeds.
    """
    found: dict[str, Writer] = {}
    for seeds, prefix in ((_SEEDS, ""), (_MORE, "more/")):
        for arm in arm_plans(seeds, prefix):
            found[arm.name] = partial(_without_cache, partial(write_arm_case, arm))
        for sensor in sensor_plans(seeds, prefix):
            found[sensor.name] = partial(
                _without_cache, partial(write_sensor_case, sensor)
            )
        for cell in cell_plans(seeds, prefix):
            found[cell.name] = partial(_without_cache, partial(write_cell_case, cell))
    for name in (*RECORDED, *SLOW):
        found[f"real/{name}/whole"] = partial(write_whole, name)
        for half in ("first", "second"):
            found[f"real/{name}/{half}"] = partial(write_half, name, half)
    return found


def chosen(patterns: list[str]) -> list[str]:
    """Returns the names of the cases that patterns or names of SETS stand for.

    In an order by their hashes, so that the first ones stand for all, and that more
    cases do not change.

    Raises:
        DisasmError: a pattern stands for none.
    """
    names = list(known_cases())
    kept: set[str] = set()
    for pattern in patterns:
        wanted = SETS.get(pattern, (pattern,))
        own = {n for n in names for w in wanted if fnmatch.fnmatchcase(n, w)}
        if not own:
            raise DisasmError(
                f"`cases` {pattern}: no case has such a name; --list prints all names"
            )
        kept |= own
    return sorted(kept, key=lambda name: hashlib.sha256(name.encode()).digest())


def case_of(name: str, cache: Path) -> Case:
    """Returns a case; its logs are written if they are not there.

    Args:
        name: of the case.
        cache: folder of all cases.

    Raises:
        DisasmError: there is no such case, or data are missing.
    """
    folder = cache / re.sub(r"[^\w.]+", "_", name)
    path = folder / "case.json"
    if not path.exists():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        known_cases()[name](folder, cache).write(path)
    return Case.read(path)


def _without_cache(write: Callable[[Path], Case], folder: Path, _: Path) -> Case:
    return write(folder)

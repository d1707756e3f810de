"""Whether a change of the code has changed its numbers: the same commands on two trees.

    python benchmarks/same_numbers.py --out out/before        in one checkout
    python benchmarks/same_numbers.py --out out/after --before out/before     in another

Runs trainings, simulations, an identification and verdicts by `drake-disasm`, keeps
what they write, and compares it number by number. Both read the same logs, those of the
earlier run. A case whose folder is there is not run again.
"""

import argparse
import contextlib
import csv
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.common.errors import DisasmError

_ROOT = Path(__file__).parent.parent
#: Commands by name; {out} is the case's folder, {name} that of another case.
CASES: dict[str, str] = {
    "cell": "simulate --no-meshcat --policy admittance --scenario removal_turned "
    "--episodes 2 --explore 0.3 --record {out}",
    "twin": "simulate --no-meshcat --station twin --policy admittance "
    "--scenario removal_turned --episodes 2 --explore 0.3 --record {out}",
    "twin_impact": "simulate --no-meshcat --station twin --policy admittance "
    "--scenario removal_turned --set contact.model=impact --episodes 6 --explore 0.3 "
    "--hidden {hidden} --record {out}",
    "train_twin": "train --episodes 3 --validation 2 --out {out}",
    "train_impact": "train --set contact.model=impact --agent ddpg --preset chapter3 "
    "--scenario chapter3 --episodes 6 --validation 2 --out {out}",
    "train_cell": "train --station cell --episodes 2 --validation 1 --out {out}",
    "train_envs": "train --set contact.model=impact --envs 8 --episodes 16 "
    "--validation 2 --out {out}",
    "train_lockstep": "train --agent td3 --preset chapter3 --scenario chapter3 "
    "--set contact.model=impact --lockstep --seeds 3 --episodes 5 --validation 2 "
    "--workers 1 --out {out}",
    "train_offline": "train --log {twin_impact} --set contact.model=impact "
    "--updates 200 --episodes 4 --validation 2 --out {out}",
    "identify": "identify --log {twin_impact} --parameters contact.friction "
    "GroovePose.rz --budget 60 --cycles 3 --workers 1 --out {out}",
    "loop_twin": "close-loop --log {twin_impact} --workers 1 --out {out}",
}
#: What differs from run to run, or says where files are.
_IGNORED = {
    *("seconds", "date", "created", "versions", "commit", "command", "provenance"),
    *("time", "evaluations_per_second", "path", "wall", "duration", "code", "logs"),
}
_HIDDEN = "effects:\n  - !GroovePose {rz: 0.01}\n"


def main() -> None:
    """Runs the cases, and compares them with an earlier run."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--before", type=Path, help="folder of an earlier run")
    parser.add_argument(
        "--log", nargs="+", default=[], metavar="NAME=DIR", help="verdicts on these too"
    )
    parser.add_argument("--only", nargs="+", default=[], help="cases to run")
    options = parser.parse_args()
    cases = dict(CASES)
    for given in options.log:
        name, _, folder = given.partition("=")
        cases[f"loop_{name}"] = f"close-loop --log {folder} --workers 1 --out {{out}}"
    options.out.mkdir(parents=True, exist_ok=True)
    for name, command in cases.items():
        if not options.only or name in options.only:
            _run(name, command, options.out.absolute(), options.before or options.out)
    if options.before:
        rows = [_compared(options.before, options.out, name) for name in cases]
        print(f"{'case':16} {'numbers':>8}  largest relative change, how many differ")
        for row in rows:
            print(f"{row[0]:16} {row[1]:>8}  {row[3]:>8}  {row[2]}")


def _run(name: str, command: str, out: Path, logs: Path) -> None:
    folder, hidden = out / name, out / "hidden.yaml"
    if folder.exists():
        return
    hidden.write_text(_HIDDEN, "utf-8")
    places = {case: str(logs.absolute() / case) for case in CASES}
    places["hidden"] = str(hidden)
    words = command.format(**(places | {"out": str(folder)})).split()
    paths = os.pathsep.join((str(_ROOT), str(_ROOT / "tools")))
    print(f"{name}: drake-disasm {' '.join(words)}", flush=True)
    done = subprocess.run(
        [sys.executable, "-m", "drake_disasm_cli", *words],
        env=os.environ | {"PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise DisasmError(f"{name}: failed\n{done.stdout[-2000:]}{done.stderr[-2000:]}")


def _compared(before: Path, after: Path, name: str) -> list[str]:
    """Returns a row: how many numbers of a case differ, and by how much."""
    one, other = (dict(_numbers(folder / name)) for folder in (before, after))
    missing = sorted(set(one) ^ set(other))
    differing, most = 0, 0.0
    for key in set(one) & set(other):
        change = _change(one[key], other[key])
        differing += change > 0.0
        most = max(most, change)
    note = f", {len(missing)} not in both ({missing[0]})" if missing else ""
    return [name, str(len(one)), f"{differing}{note}", f"{most:.1e}"]


def _change(one: Any, other: Any) -> float:
    """Returns the largest relative change of arrays or of a text; 0: the same bits."""
    if isinstance(one, str) or isinstance(other, str):
        return 0.0 if one == other else np.inf
    a, b = np.asarray(one, float), np.asarray(other, float)
    if a.shape != b.shape:
        return np.inf
    if np.array_equal(a, b, equal_nan=True):
        return 0.0
    scale = np.nanmax(np.abs(a)) or 1.0
    return float(np.nanmax(np.abs(a - b)) / scale) or np.inf


def _numbers(folder: Path) -> Iterator[tuple[str, Any]]:
    """Yields what the files of a case hold, by file and place."""
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.suffix == ".npz":
            with np.load(path, allow_pickle=False) as arrays:
                yield from (
                    (f"{name}:{key}", arrays[key])
                    for key in arrays.files
                    if arrays[key].dtype.kind in "fiub" and arrays[key].dtype != "u1"
                )
        elif path.suffix == ".csv":
            rows = list(csv.reader(path.read_text("utf-8").splitlines()))
            yield from (
                (f"{name}:{i}:{j}", _number(cell))
                for i, row in enumerate(rows)
                for j, cell in enumerate(row)
            )
        elif path.suffix == ".json":
            yield from _leaves(name, json.loads(path.read_text("utf-8")))
        elif path.suffix == ".parquet":
            import pyarrow.parquet as pq  # type: ignore[import-untyped]

            table = pq.read_table(path)
            for column in table.column_names:
                yield f"{name}:{column}", table[column].to_numpy()


def _number(text: str) -> float | str:
    with contextlib.suppress(ValueError):
        return float(text)
    return text


def _leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        for key, own in value.items():
            if key not in _IGNORED:
                yield from _leaves(f"{name}:{key}", own)
    elif isinstance(value, list):
        for i, own in enumerate(value):
            yield from _leaves(f"{name}:{i}", own)
    elif isinstance(value, (int, float)):
        yield name, float(value)
    elif isinstance(value, str):
        yield name, value


if __name__ == "__main__":
    main()

"""Tables: CSV, NPZ, NPY, MATLAB, Parquet and LeRobot datasets."""

import csv
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow  # type: ignore[import-untyped]
import pyarrow.parquet  # type: ignore[import-untyped]

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.text import clipped
from drake_disasm.importing.stream import Stream, flat

_COMMENTS = ("#", "%")
_DELIMITERS = ",;\t "


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """Turns what libraries raise of a damaged file into one line."""
    try:
        yield
    except (
        OSError,
        ValueError,
        TypeError,
        KeyError,
        EOFError,
        zipfile.BadZipFile,
        csv.Error,
        pyarrow.ArrowException,
    ) as error:
        raise DisasmError(f"{path}: can't be read: {clipped(str(error))}") from None


def read_csv(path: Path) -> list[Stream]:
    """Reads a table of numbers with a line of names above it.

    Lines that begin with # or % are comments. Columns are separated by commas,
    semicolons, tabs or blanks; without names they are column_0, column_1, ... A column
    that is not of numbers is left out; an empty cell is no number.
    """
    with _readable(path), path.open(newline="", encoding="utf-8-sig") as file:
        lines = (line for line in file if line.strip())
        text = [line for line in lines if not line.lstrip().startswith(_COMMENTS)]
        if not text:
            raise DisasmError(f"{path}: has no rows")
        dialect = _delimiter(text[0])
        rows = list(csv.reader(text, delimiter=dialect, skipinitialspace=True))
        names = [cell.strip() for cell in rows[0]]
        if all(_is_number(cell) for cell in names):
            names = [f"column_{i}" for i in range(len(names))]
        else:
            rows = rows[1:]
        rows = [_without_last_empty(row, len(names)) for row in rows]
        for number, row in enumerate(rows, 1):
            if len(row) != len(names):
                raise DisasmError(
                    f"{path}: row {number} has {len(row)} cells, the first line "
                    f"{len(names)}; correct it"
                )
        columns = zip(names, zip(*rows, strict=True), strict=True) if rows else ()
        arrays = {
            name: found for name, c in columns if (found := _numbers(c)) is not None
        }
    return [_table(path, arrays)]


def _delimiter(line: str) -> str:
    return max(_DELIMITERS, key=line.strip().count)


def _without_last_empty(row: list[str], count: int) -> list[str]:
    return row[:-1] if len(row) == count + 1 and not row[-1].strip() else row


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _numbers(cells: tuple[str, ...]) -> np.ndarray | None:
    flags = {"true": "1", "false": "0", "": "nan"}
    try:
        return np.array([float(flags.get(c.strip().lower(), c)) for c in cells])
    except ValueError:
        return None


def read_npz(path: Path) -> list[Stream]:
    """Reads NumPy's archive of arrays."""
    with _readable(path), np.load(path, allow_pickle=False) as file:
        return [_table(path, _numeric({name: file[name] for name in file.files}))]


def read_npy(path: Path) -> list[Stream]:
    """Reads one array (n, k): columns column.0, column.1, ... or a record array's."""
    with _readable(path):
        array = np.load(path, allow_pickle=False)
        names = array.dtype.names
        found = {n: array[n] for n in names} if names else {"column": array}
        return [_table(path, _numeric(found))]


def read_mat(path: Path) -> list[Stream]:
    """Reads a MATLAB file of version 7 or older; a struct's members are struct.name."""
    from scipy.io import loadmat

    with _readable(path):
        try:
            found = loadmat(path, simplify_cells=True)
        except NotImplementedError:
            raise DisasmError(
                f"{path}: is of MATLAB 7.3; save it with -v7, or as CSV"
            ) from None
        return [_table(path, _numeric(_members(found)))]


def _members(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    found = dict[str, Any]()
    for name, value in values.items():
        if name.startswith("__"):
            continue
        if isinstance(value, dict):
            found |= _members(value, f"{prefix}{name}.")
        else:
            found[prefix + name] = value
    return found


def read_parquet(path: Path) -> list[Stream]:
    """Reads a Parquet table; columns of lists are name.0, name.1, ..."""
    with _readable(path):
        return [_table(path, _columns(pyarrow.parquet.read_table(path)))]


def read_lerobot(path: Path) -> list[Stream]:
    """Reads the Parquet files of a LeRobot dataset, episodes one after the other."""
    with _readable(path):
        files = sorted((path / "data").rglob("*.parquet"))
        if not files:
            raise DisasmError(f"{path}: has no data/**/*.parquet")
        tables = [pyarrow.parquet.read_table(file) for file in files]
        joined = pyarrow.concat_tables(tables, promote_options="default")
        return [_table(path, _columns(joined))]


def _columns(table: pyarrow.Table) -> dict[str, np.ndarray]:
    found = dict[str, np.ndarray]()
    for name in table.column_names:
        kind = table.schema.field(name).type
        if pyarrow.types.is_list(kind) or pyarrow.types.is_fixed_size_list(kind):
            rows = table[name].to_pylist()
            if len({len(row) for row in rows}) == 1:
                found[name] = np.array(rows)
        elif pyarrow.types.is_timestamp(kind):
            unit = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}[kind.unit]
            found[name] = unit * table[name].cast("int64").to_numpy()
        else:
            found[name] = table[name].to_numpy()
    return _numeric(found)


def _numeric(arrays: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Returns those that hold real numbers."""
    found = {name: np.asarray(array) for name, array in arrays.items()}
    return {n: a for n, a in found.items() if a.dtype.kind in "fiub"}


def _table(path: Path, arrays: Mapping[str, np.ndarray]) -> Stream:
    """Returns the arrays that are as long as most; single numbers as constants."""
    constants = {n: float(a.ravel()[0]) for n, a in arrays.items() if a.size == 1}
    rest = {n: a for n, a in arrays.items() if n not in constants}
    sizes = [max(a.shape) for a in rest.values()]
    if not sizes:
        raise DisasmError(f"{path}: has no columns of numbers")
    rows = max(set(sizes), key=sizes.count)
    # MATLAB may hold rows where we have columns.
    kept = {n: a if len(a) == rows else a.T for n, a in rest.items() if rows in a.shape}
    return Stream("", flat(kept), constants=constants)

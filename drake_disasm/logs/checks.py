"""The checks of a table's values, the same for writing and for reading."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_disasm.logs.columns import Columns, columns_of
from drake_disasm.logs.header import LogHeader
from drake_disasm.logs.refusal import refusal
from drake_disasm.logs.schema import KINDS, Kind, Quantity

# Four decimals of each component keep the norm within this of 1.
QUATERNION_TOLERANCE = 1e-4
# The median time between rows may be off the stated period by this factor.
PERIOD_FACTOR = 2.0


def check_values(
    header: LogHeader, columns: Mapping[str, ArrayLike], where: str
) -> dict[str, NDArray[Any]]:
    """The columns as float64 or bool, after all checks of their values.

    Args:
        header: the header of the log that the table belongs to.
        columns: its columns, all of them known (`arrange_names`).
        where: the file, for messages.

    Raises:
        DisasmError: a wrong type, mixed lengths, too few rows, NaN or infinity, a
            magnitude that nothing has, a quaternion that is not unit, time that does
            not increase or does not fit the period, a flag or an action where there
            can't be one.
    """
    kind = KINDS[header.kind]
    typed = {
        name: _typed(name, values, name in kind.boolean_columns, where)
        for name, values in columns.items()
    }
    _check_lengths(kind, typed, where)
    _check_finite(typed, where)
    for quantity, names in _present(kind, typed):
        _check_quantity(quantity, {name: typed[name] for name in names}, where)
    _check_period(header, typed, where)
    return typed


def _present(kind: Kind, columns: Columns) -> list[tuple[Quantity, tuple[str, ...]]]:
    groups = [(q, columns_of(q, columns)) for q in kind.quantities]
    return [(q, names) for q, names in groups if names and names[0] in columns]


def _typed(name: str, values: ArrayLike, boolean: bool, where: str) -> NDArray[Any]:
    array = np.asarray(values)
    if array.ndim != 1:
        raise refusal(
            where, f"column '{name}' has shape {array.shape}", "give one value per row"
        )
    if array.dtype.kind not in ("b" if boolean else "fiu"):
        raise refusal(
            where,
            f"column '{name}' is of type {array.dtype}",
            "write true or false in every row"
            if boolean
            else "write a number in every row",
        )
    return array.astype(bool if boolean else np.float64, copy=False)


def _check_lengths(kind: Kind, columns: Columns, where: str) -> None:
    first, rows = next((name, len(values)) for name, values in columns.items())
    for name, values in columns.items():
        if len(values) != rows:
            raise refusal(
                where,
                f"mixed lengths: column '{name}' has {len(values)} rows, '{first}' "
                f"has {rows}",
                "give all columns the same number of rows",
            )
    if rows < kind.min_rows:
        raise refusal(
            where,
            f"column '{first}' has {rows} rows",
            f"a {kind.name} table needs at least {kind.min_rows}",
        )


def _check_finite(columns: Columns, where: str) -> None:
    names = [name for name, values in columns.items() if values.dtype.kind == "f"]
    bad = ~np.isfinite(np.column_stack([columns[name] for name in names]))
    if bad.any():
        row, column = np.argwhere(bad)[0]
        raise refusal(
            where,
            f"column '{names[column]}' is NaN, infinite or empty in {_row(row)}",
            "leave out rows that were not measured whole",
        )


def _check_magnitudes(quantity: Quantity, columns: Columns, where: str) -> None:
    for number, (name, values) in enumerate(columns.items()):
        most = quantity.greatest(number)
        bad = np.abs(values) > most
        if bad.any():
            row = int(np.argmax(bad))
            raise refusal(
                where,
                f"column '{name}' is {values[row]:.6g} in {_row(row)}, beyond "
                f"{most:g} {quantity.unit_of(number)}",
                "convert it to SI, or leave out rows that are damaged",
            )


def _check_quantity(quantity: Quantity, columns: Columns, where: str) -> None:
    if not quantity.boolean:
        _check_magnitudes(quantity, columns, where)
    if quantity.is_rotation:
        _check_quaternions(quantity.name, columns, where)
    if quantity.increasing:
        _check_increasing(quantity.name, columns[quantity.name], where)
    if quantity.boolean:
        _check_flag(quantity.name, columns[quantity.name], where)
    if quantity.of_step:
        _check_last_row(columns, where)


def _check_quaternions(name: str, columns: Columns, where: str) -> None:
    parts = [columns[f"{name}.{part}"] for part in ("qw", "qx", "qy", "qz")]
    norms = np.linalg.norm(np.column_stack(parts), axis=1)
    bad = np.abs(norms - 1.0) > QUATERNION_TOLERANCE
    if bad.any():
        row = int(np.argmax(bad))
        raise refusal(
            where,
            f"column '{name}.qw' to '{name}.qz': non-unit quaternion, of norm "
            f"{norms[row]:.6g}, in {_row(row)}",
            "divide it by its norm",
        )


def _check_increasing(name: str, values: NDArray[Any], where: str) -> None:
    bad = np.diff(values) <= 0.0
    if bad.any():
        row = int(np.argmax(bad)) + 1
        raise refusal(
            where,
            f"column '{name}' is non-monotone: {values[row]:.9g} follows "
            f"{values[row - 1]:.9g} in {_row(row)}",
            "sort the rows and remove repeated ones, or split into episodes",
        )


def _check_flag(name: str, values: NDArray[Any], where: str) -> None:
    if values[:-1].any():
        raise refusal(
            where,
            f"column '{name}' is true in {_row(int(np.argmax(values)))}, before the "
            "last row",
            "end the table there and start another episode",
        )


def _check_last_row(columns: Columns, where: str) -> None:
    for name, values in columns.items():
        if values[-1] != 0.0:
            raise refusal(
                where,
                f"column '{name}' is {values[-1]:.6g} in the last row",
                "write 0: the last row is the final observation, no step follows",
            )


def _check_period(header: LogHeader, columns: Columns, where: str) -> None:
    if header.period is None or len(columns["time"]) < 2:
        return
    step = float(np.median(np.diff(columns["time"])))
    if not header.period / PERIOD_FACTOR <= step <= header.period * PERIOD_FACTOR:
        raise refusal(
            where,
            f"column 'time' has steps of {step:.6g} s, log.yaml has the period "
            f"{header.period:.6g} s",
            "give time in seconds and the period between rows",
        )


def _row(index: int) -> str:
    return f"row {index} (the first is 0)"

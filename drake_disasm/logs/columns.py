"""Which columns a table must and may have, and vectors as columns."""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_disasm.logs.header import LogHeader
from drake_disasm.logs.refusal import did_you_mean, quoted, refusal
from drake_disasm.logs.schema import KINDS, MOST_COLUMNS, Form, Kind, Quantity

Columns = Mapping[str, NDArray[Any]]


def flat_columns(kind: str, vectors: Mapping[str, ArrayLike]) -> dict[str, Any]:
    """Columns of a table, from scalars and vectors over its rows.

    Args:
        kind: a name in `KINDS`.
        vectors: for a quantity of the kind, `(rows,)` if it is a scalar, else
            `(rows, components)` in the declared order. A key that is a column's
            name already (`reward.distance`) passes through.

    Raises:
        DisasmError: an array does not have the declared number of components.
    """
    columns: dict[str, Any] = {}
    for name, values in vectors.items():
        columns |= _flatten(kind, name, np.asarray(values))
    return columns


def _flatten(kind: str, name: str, values: NDArray[Any]) -> dict[str, Any]:
    quantity = KINDS[kind].quantity(name)
    if quantity is None or quantity.form in (Form.SCALAR, Form.TERMS):
        return {name: values}
    size = len(quantity.components)
    if values.ndim != 2 or (size and values.shape[1] != size):
        raise refusal(
            f"{kind}.{name}",
            f"array of shape {values.shape}",
            f"give (rows, {size or 'joints'})",
        )
    suffixes = quantity.components or range(values.shape[1])
    return {f"{name}.{s}": values[:, i] for i, s in enumerate(suffixes)}


def columns_of(quantity: Quantity, names: Collection[str]) -> tuple[str, ...]:
    """The columns that a quantity should have in a table with these column names.

    For joints as many as there are columns with its prefix, numbered from 0.
    """
    if quantity.form is Form.SCALAR:
        return (quantity.name,)
    present = tuple(n for n in names if n.startswith(f"{quantity.name}."))
    if quantity.form is Form.TERMS:
        return present
    joints = range(max(len(present), int(quantity.required)))
    return tuple(f"{quantity.name}.{s}" for s in quantity.components or joints)


def arrange_names(
    header: LogHeader, names: Collection[str], where: str
) -> tuple[str, ...]:
    """A table's column names in the declared order, all of them accounted for.

    Args:
        header: the header of the log that the table belongs to.
        names: the names of its columns, in any order.
        where: the file, for messages.

    Raises:
        DisasmError: a column is missing, unknown or there twice, or the quantities
            of the joints have different numbers of columns.
    """
    kind = KINDS[header.kind]
    _check_count(names, where)
    _check_unique(names, where)
    names = dict.fromkeys(names).keys()  # looked up in, once for each column
    present = {name: _present(q, names, where) for name, q in _by_name(kind)}
    _check_one_of(kind, present, where)
    ordered = tuple(name for group in present.values() for name in group)
    _check_known(ordered, names, where)
    _check_joints(header, kind, present, where)
    return ordered


def _by_name(kind: Kind) -> Iterable[tuple[str, Quantity]]:
    return ((quantity.name, quantity) for quantity in kind.quantities)


def _check_count(names: Collection[str], where: str) -> None:
    if len(names) > MOST_COLUMNS:
        raise refusal(
            where,
            f"{len(names)} columns",
            f"give {MOST_COLUMNS} at most, one for each quantity and component",
        )


def _check_unique(names: Collection[str], where: str) -> None:
    twice = sorted(name for name, count in Counter(names).items() if count > 1)
    if twice:
        raise refusal(where, f"column {quoted(twice)} is there twice", "remove one")


def _present(quantity: Quantity, names: Collection[str], where: str) -> tuple[str, ...]:
    wanted = columns_of(quantity, names)
    missing = [name for name in wanted if name not in names]
    if missing and (quantity.required or len(missing) < len(wanted)):
        raise refusal(
            where,
            f"missing column {quoted(missing)}",
            f"add it: {quantity.meaning} [{quantity.unit}]",
        )
    return () if missing else wanted


def _check_one_of(
    kind: Kind, present: Mapping[str, tuple[str, ...]], where: str
) -> None:
    if kind.one_of and not any(present[name] for name in kind.one_of):
        wanted = " or ".join(f"'{name}'" for name in kind.one_of)
        raise refusal(
            where, f"missing column {wanted}", "add one of them: the rows' order"
        )


def _check_known(known: Collection[str], names: Collection[str], where: str) -> None:
    unknown = sorted(set(names) - set(known))
    if unknown:
        raise refusal(
            where,
            f"unknown column {quoted(unknown)}",
            f"{did_you_mean(unknown[0], known)}"
            f"rename it, remove it, or keep it as 'extra.{unknown[0]}'",
        )


def _check_joints(
    header: LogHeader,
    kind: Kind,
    present: Mapping[str, tuple[str, ...]],
    where: str,
) -> None:
    sizes = {
        q.name: len(present[q.name])
        for q in kind.quantities
        if q.form is Form.JOINTS and (q.name == "q" or present[q.name])
    }
    if not header.joints:
        header_size, reason = sizes.get("q", 0), "'q' has"
    else:
        header_size, reason = len(header.joints), "log.yaml names"
    for name, size in sizes.items():
        if size != header_size:
            raise refusal(
                where,
                f"mixed lengths: column '{name}.*' has {size} joints, {reason} "
                f"{header_size}",
                f"give one column '{name}.<i>' per joint, numbered from 0",
            )

"""Array operations for both NumPy and torch, by the Python array API standard.

A function that is given arrays asks for their `namespace` and computes with that: one
equation serves one state in NumPy and thousands in torch, on a GPU if that holds them.
This module has what the standard lacks, and what its own functions are slow at.
"""

from collections.abc import Sequence
from typing import Any

import array_api_compat
import array_api_compat.numpy
import numpy as np

#: An array of NumPy or a tensor of torch.
Array = Any


def namespace(*arrays: Array) -> Any:
    """Returns the array API namespace of arrays; numbers among them don't matter.

    Raises:
        TypeError: they are of different libraries, or none is an array.
    """
    for array in arrays:
        if type(array) is np.ndarray:  # the standard's way takes 20 us
            return array_api_compat.numpy
    return array_api_compat.array_namespace(*arrays)


def array_like(values: Any, like: Array) -> Array:
    """Returns numbers, or an array of NumPy, as an array of the same kind as another.

    Args:
        values: to be converted; what is of that kind already is returned as it is.
        like: whose library, type of numbers and device it gets.
    """
    if isinstance(like, np.ndarray | np.generic):
        return np.asarray(values, dtype=like.dtype)
    xp = namespace(like)
    if isinstance(values, np.ndarray):
        values = np.array(values)  # of its own: torch takes no view of Drake's memory
    device = array_api_compat.device(like)
    return xp.asarray(values, dtype=like.dtype, device=device)


def to_numpy(array: float | Array) -> np.ndarray:
    """Returns an array, or a number, as an array of NumPy; it may share memory."""
    if isinstance(array, np.ndarray | np.generic | float | int):
        return np.asarray(array)
    return np.asarray(array_api_compat.to_device(array, "cpu"))


def last_axis(parts: Sequence[Any], like: Array) -> Array:
    """Returns numbers or arrays (...) side by side along a new last axis.

    Args:
        parts: each a number, or an array whose shape fits the others' by broadcasting.
        like: whose library, type of numbers and device the result has.
    """
    if all(isinstance(part, float | int) for part in parts):
        return array_like(list(parts), like)
    xp = namespace(like)
    arrays = [array_like(part, like) for part in parts]
    return xp.stack(xp.broadcast_arrays(*arrays), axis=-1)


def side_by_side(parts: Sequence[Array]) -> Array:
    """Returns arrays of one shape (...) side by side (..., k); faster than `stack`."""
    if not isinstance(parts[0], np.ndarray | np.generic):
        return namespace(parts[0]).stack(parts, axis=-1)
    joined = np.empty((*parts[0].shape, len(parts)), parts[0].dtype)
    for i, part in enumerate(parts):
        joined[..., i] = part
    return joined


def cross(a: Array, b: Array) -> Array:
    """Returns the cross product of vectors (..., 3); faster than `np.cross`."""
    a1, a2, a3 = a[..., 0], a[..., 1], a[..., 2]
    b1, b2, b3 = b[..., 0], b[..., 1], b[..., 2]
    parts = (a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1)
    return side_by_side(parts)


def apply_matrix(matrices: Array, vectors: Array) -> Array:
    """Returns matrices (..., n, m), or one for all, times vectors (..., m).

    One by one: what a row of `vectors @ matrix.T` comes to depends on its company, on
    some processors.
    """
    xp = namespace(matrices, vectors)
    return xp.matmul(matrices, vectors[..., None])[..., 0]


def at_least(low: float | Array, values: float | Array) -> float | Array:
    """Returns values, or a bound where they are below; faster than `clip`.

    A number stays a number.
    """
    if isinstance(values, float | int):
        return max(low, values)
    return namespace(values).where(values < low, low, values)


def at_most(high: float | Array, values: float | Array) -> float | Array:
    """Returns values, or a bound where they are above; a number stays a number."""
    if isinstance(values, float | int):
        return min(high, values)
    return namespace(values).where(values > high, high, values)


def limited(values: Array, low: Array, high: Array) -> Array:
    """Returns values within bounds, arrays that fit by broadcasting."""
    xp = namespace(values)
    return xp.minimum(xp.maximum(values, low), high)


def exponential(values: float | Array) -> float | Array:
    """Returns e to the power of values; a number stays a number."""
    if isinstance(values, float | int):
        return float(np.exp(values))
    return namespace(values).exp(values)


def as_number(value: float | Array) -> float | Array:
    """Returns a number as Python has it, if it is one; arrays stay arrays."""
    return value if getattr(value, "ndim", 0) else float(value)


def transposed(matrices: Array) -> Array:
    """Returns matrices (..., n, m) transposed."""
    return namespace(matrices).matrix_transpose(matrices)


def matrix_of(rows: Sequence[Sequence[Array]]) -> Array:
    """Returns matrices (..., n, m) of their elements (...) by rows."""
    elements = side_by_side([element for row in rows for element in row])
    xp = namespace(elements)
    return xp.reshape(elements, (*elements.shape[:-1], len(rows), len(rows[0])))

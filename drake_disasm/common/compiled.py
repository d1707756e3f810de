"""Numba's compiler, for loops that would keep Python busy.

A function is compiled when it is first called, for a few seconds; the result is kept
beside its source (or in the user's cache, where that can't be written) and found again
by every later process, until its file changes: all that compiled functions call and use
stands in the same file.
"""

from collections.abc import Callable
from typing import TypeVar, cast

import numba

_Function = TypeVar("_Function", bound=Callable[..., object])


def compiled(function: _Function) -> _Function:
    """Returns a function on numbers and arrays of NumPy, compiled.

    A division by zero gives infinity, as in NumPy; the order of sums is as written.
    """
    compile_when_called = numba.njit(cache=True, error_model="numpy", nogil=True)
    return cast(_Function, compile_when_called(function))

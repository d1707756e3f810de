"""Numba's compiler, for loops that would keep Python busy.

Functions are compiled when the first of them is called, for half a minute, which is
said on a terminal; the result is kept beside its source (or in the user's cache, where
that can't be written) and found again by every later process, until its file changes:
all that compiled functions call and use stands in the same file.
"""

import functools
import multiprocessing
import sys
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from numba.core import event

_Function = TypeVar("_Function", bound=Callable[..., object])


def compiled(function: _Function) -> _Function:
    """Returns a function on numbers and arrays of NumPy, compiled.

    A division by zero gives infinity, as in NumPy; the order of sums is as written.
    A function whose name begins with an underscore can be called by compiled ones
    alone.
    """
    options: dict[str, Any] = {"cache": True}
    if function.__name__.startswith("_"):
        options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    compile_when_called = numba.njit(error_model="numpy", nogil=True, **options)
    return cast(_Function, compile_when_called(function))


class _Notice(event.Listener):
    """Says once, on a terminal, why a program is silent."""

    def on_start(self, event: Any) -> None:
        """Tells of the first function that is compiled."""
        _tell()

    def on_end(self, event: Any) -> None:
        """Says nothing."""


@functools.cache
def _tell() -> None:
    if sys.stderr.isatty() and multiprocessing.parent_process() is None:
        print("compiling the twin, once: half a minute", file=sys.stderr)


event.register("numba:compile", _Notice())

"""The plant's steps on a GPU, a thread for each plant.

The kernel calls the very functions of `equations`, which Numba compiles for CUDA, too.
"""

import warnings
from collections.abc import Sequence

import numpy as np
from numba import cuda

from drake_disasm.common.arrays import Array, namespace
from drake_disasm.twin.equations import SIZE, advance_row

_THREADS = 64  # of a block


def advance(
    constants: Sequence[Array], h: float, steps: int, rate: Array, state: Array
) -> tuple[Array, Array, Array]:
    """Returns what `equations.advance_rows` sets, of all plants at once.

    Tensors are torch's, on one GPU; they are neither copied nor moved.

    Args:
        constants, h, steps, rate: see there.
        state: (n, 30), which is changed in place.
    """
    xp, count = namespace(rate), len(rate)
    newest = xp.empty_like(state)
    is_solved = xp.zeros(count, dtype=xp.bool, device=rate.device)
    tables = tuple(cuda.as_cuda_array(each.contiguous()) for each in constants)
    arrays = (rate.contiguous(), state, newest, is_solved)
    with cuda.gpus[rate.device.index], warnings.catch_warnings():
        # Batches may be small: a step's other kernels are, too.
        warnings.filterwarnings("ignore", message=".*low occupancy")
        kernel[-(-count // _THREADS), _THREADS](
            tables, h, steps, *(cuda.as_cuda_array(each) for each in arrays)
        )
    return state, newest, is_solved


@cuda.jit
def kernel(constants, h, steps, rate, state, newest, is_solved):  # type: ignore[no-untyped-def]
    """Advances one plant in each thread; see `equations.advance_rows`."""
    i = cuda.grid(1)
    w = cuda.local.array(SIZE, np.float64)
    if i < len(rate):
        is_solved[i] = advance_row(constants, h, steps, rate, state, newest, i, w)

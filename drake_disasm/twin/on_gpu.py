"""The contact's equations on a GPU, a thread for each state.

The kernel calls the very functions of `contact`, which Numba compiles for CUDA, too.
"""

import warnings

import numpy as np
from numba import cuda

from drake_disasm.common.arrays import Array, namespace
from drake_disasm.twin.contact import SHAPES, arranged, solve_row

_THREADS = 64  # of a block
_PLACES, _ARM, _ROTATIONS, _MAPS, _VECTORS, _POINTS, _BY_TWIST = SHAPES


def solve_rows(
    table: Array, h: float, states: tuple[Array, ...]
) -> tuple[Array, Array, Array]:
    """Returns what `ImpactStep` has, of all states at once.

    Args:
        table: (m, 83) of `ImpactConditions`.
        h: the step [s].
        states: of n, see `contact.State`.

    Tensors are torch's, on one GPU; they are neither copied nor moved.
    """
    xp, q = namespace(table), states[0]
    after, wrench = xp.empty_like(q), xp.empty_like(q)
    is_solved = xp.zeros(len(q), dtype=xp.bool, device=q.device)
    results = tuple(cuda.as_cuda_array(each) for each in (after, wrench, is_solved))
    rows = tuple(cuda.as_cuda_array(each.contiguous()) for each in states)
    blocks = -(-len(q) // _THREADS)
    with cuda.gpus[q.device.index], warnings.catch_warnings():
        # Batches may be small: a step's other kernels are, too.
        warnings.filterwarnings("ignore", message=".*low occupancy")
        kernel[blocks, _THREADS](
            cuda.as_cuda_array(table.contiguous()), h, rows, *results
        )
    return after, wrench, is_solved


@cuda.jit
def kernel(table, h, states, after, wrench, is_solved):  # type: ignore[no-untyped-def]
    """Solves one state in each thread; see `contact.solve_rows`."""
    i = cuda.grid(1)
    space = arranged(
        cuda.local.array(_PLACES, np.float64),
        cuda.local.array(_ARM, np.float64),
        cuda.local.array(_ROTATIONS, np.float64),
        cuda.local.array(_MAPS, np.float64),
        cuda.local.array(_VECTORS, np.float64),
        cuda.local.array(_POINTS, np.float64),
        cuda.local.array(_BY_TWIST, np.float64),
    )
    if i < len(after):
        solve_row(table, h, states, i, after, wrench, is_solved, space)

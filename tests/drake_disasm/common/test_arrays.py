"""Array operations in NumPy and torch, each against NumPy's own."""

import numpy as np
import pytest
import torch

from drake_disasm.common import arrays

RANDOM = np.random.default_rng(0)
KINDS = [np.zeros(0), torch.zeros(0, dtype=torch.float64)]
both = pytest.mark.parametrize("like", KINDS, ids=["numpy", "torch"])


@both
def test_products_are_numpys(like):
    A, a, b = RANDOM.normal(size=(5, 3, 3)), *RANDOM.normal(size=(2, 5, 3))
    given = [arrays.array_like(x, like) for x in (A, a, b)]
    assert all(type(x) is type(like) for x in given)
    np.testing.assert_allclose(arrays.cross(*given[1:]), np.cross(a, b))
    expected = np.einsum("nij,nj->ni", A, a)
    np.testing.assert_allclose(arrays.apply_matrix(*given[:2]), expected)


@both
def test_numbers_and_arrays_stand_side_by_side(like):
    assert arrays.last_axis([1.0, 2.0], like).shape == (2,)
    found = arrays.last_axis([1.0, arrays.array_like(np.arange(3.0), like)], like)
    np.testing.assert_array_equal(arrays.to_numpy(found), [[1, 0], [1, 1], [1, 2]])


@both
def test_bounds_keep_numbers_numbers(like):
    assert arrays.at_least(0.0, -1.0) == 0.0 and arrays.at_most(1.0, 2.0) == 1.0
    assert isinstance(arrays.at_least(0.0, -1.0), float)
    values = arrays.array_like(np.array([-1.0, 0.5, 2.0]), like)
    np.testing.assert_array_equal(
        arrays.to_numpy(arrays.at_least(0.0, values)), [0, 0.5, 2]
    )
    np.testing.assert_array_equal(
        arrays.to_numpy(arrays.at_most(1.0, values)), [-1, 0.5, 1]
    )
    np.testing.assert_allclose(
        arrays.to_numpy(arrays.exponential(values)), np.exp([-1, 0.5, 2])
    )


def test_what_is_converted_has_memory_of_its_own():
    fixed = np.arange(3.0)
    fixed.setflags(write=False)
    arrays.array_like(fixed, KINDS[1])[0] = 5.0
    assert fixed[0] == 0.0
    assert isinstance(arrays.as_number(np.array(2.0)), float)
    assert arrays.as_number(fixed) is fixed

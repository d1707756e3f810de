"""Single rows that are far from their neighbours, and what is none."""

import numpy as np
import pytest

from sysid.data_checks.spikes import _alone

PIECE = np.repeat(np.arange(4), 50)


def drifting():
    """A residual that grows over each piece, and begins anew."""
    s = np.tile(np.linspace(0.0, 1.0, 50), 4)
    return s**2


def test_a_residual_that_grows_over_a_piece_has_no_spikes():
    assert np.abs(_alone(drifting(), PIECE)).max() < 2e-3


@pytest.mark.parametrize("row", [0, 1, 20, 49])
def test_a_spike_is_found_wherever_it_is(row):
    r = drifting()
    r[row] += 0.3
    found = np.abs(_alone(r, PIECE))
    assert np.argmax(found) == row and found[row] > 0.14

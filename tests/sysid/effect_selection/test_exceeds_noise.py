"""Whether noise, and the model's own error, can be all that an effect explains."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from sysid.effect_selection.exceeds_noise import exceeds_noise_p
from sysid.fitting.fit import Fit
from sysid.fitting.settings import DEFAULT_SETTINGS

ROWS = 400


def fit(residual: np.ndarray, share: np.ndarray) -> Fit:
    measured = SimpleNamespace(model_error_share=np.broadcast_to(share, residual.shape))
    return cast(
        Fit,
        SimpleNamespace(
            bounded_residual=residual,
            blocks=np.repeat(np.arange(10), ROWS // 10),
            settings=DEFAULT_SETTINGS,
            model=SimpleNamespace(measurements=measured),
        ),
    )


def p_value(change: np.ndarray, noise: np.ndarray, share: list[float]) -> float:
    shares = np.array(share)
    return exceeds_noise_p(fit(noise + change, shares), fit(noise, shares), 1)


def test_what_an_effect_changes_of_one_channel_is_not_hidden_by_another() -> None:
    """A force that is off by 0.8 of its noise, and poses by less than theirs."""
    noise = np.random.default_rng(3).standard_normal((ROWS, 4))
    force = np.zeros((ROWS, 4))
    force[:, 0] = 0.8
    poses = np.zeros((ROWS, 4))
    poses[:, 1:] = 0.5
    share = [0.2, 1.0, 1.0, 1.0]
    assert p_value(poses, noise, share) == 1.0
    assert p_value(force, noise, share) < 1e-9
    assert p_value(force + poses, noise, share) < 1e-9


@pytest.mark.parametrize("parameters", [1, 3])
def test_noise_exceeds_itself_no_more_often_than_is_stated(parameters: int) -> None:
    random = np.random.default_rng(5)
    columns, _ = np.linalg.qr(random.standard_normal((2 * ROWS, parameters)))
    found = []
    for _ in range(400):
        noise = random.standard_normal(2 * ROWS)
        left = noise - columns @ (columns.T @ noise)
        pair = (fit(each.reshape(ROWS, 2), np.zeros(2)) for each in (noise, left))
        found.append(exceeds_noise_p(*pair, parameters))
    assert np.mean(np.array(found) < 0.05) <= 0.08

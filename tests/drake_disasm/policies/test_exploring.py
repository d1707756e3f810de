import numpy as np
import pytest

from drake_disasm.policies import Admittance, Exploring, Straight


def noise(policy: Exploring, steps: int = 2000) -> np.ndarray:
    policy.reset()
    straight = Straight()(np.zeros(12))
    return np.array([policy(np.zeros(12)) - straight for _ in range(steps)])


def test_adds_noise_of_the_given_size():
    drawn = noise(Exploring(Straight(), 2e-4, seed=3))
    np.testing.assert_allclose(drawn[:, :3].std(axis=0), 2e-4, rtol=0.1)
    np.testing.assert_allclose(drawn[:, 3:].std(axis=0), np.deg2rad(0.02), rtol=0.1)
    assert np.abs(drawn.mean(axis=0)).max() < 4e-5


def test_an_episodes_noise_depends_on_its_seed_alone():
    """So a recording that was interrupted goes on as if it had not been."""
    whole = Exploring(Straight(), 1e-4, seed=3)
    first, second = noise(whole, 5), noise(whole, 5)
    again = noise(Exploring(Straight(), 1e-4, seed=4), 5)
    assert second.tobytes() == again.tobytes() != first.tobytes()


def test_resets_the_policy_inside():
    calls = []

    class Resettable(Admittance):
        def reset(self) -> None:
            calls.append(1)

    Exploring(Resettable(), 1e-4, 0).reset()
    assert calls == [1]
    assert Exploring(Straight(), 0.0, 0)(np.zeros(12)) == pytest.approx(
        Straight()(np.zeros(12))
    )

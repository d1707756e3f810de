"""A policy with noise on its actions, so that logs excite the contact more."""

from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import System

from drake_disasm.common.errors import DisasmError

_STREAM = 0x4558504C  # separates it from sensor noise and imprecision
_TURN = np.deg2rad(0.1) / 1e-3  # rad of rotation noise per m of translation noise
#: Standard deviations (6,) of an action's noise, by that of a translation.
AXIS_SHARES = np.array([1.0, 1.0, 1.0, _TURN, _TURN, _TURN])


class Exploring:
    """Adds Gaussian noise to every action, drawn anew in each episode.

    Args:
        policy: from observation (12,) to action (6,).
        deviation: standard deviation on translations [m]; rotations get 0.1 degrees
            per mm.
        seed: of the first episode; the next ones count on, so that an interrupted
            recording continues with the same noise.

    Raises:
        DisasmError: the policy is a System, whose actions are not its caller's.
    """

    def __init__(
        self,
        policy: Callable[[np.ndarray], np.ndarray],
        deviation: float,
        seed: int,
    ) -> None:
        kind = policy if isinstance(policy, type) else type(policy)
        if issubclass(kind, System):
            raise DisasmError(
                f"policy {kind.__name__}: is a System, to whose actions no "
                "noise is added; leave `explore` out, or give a callable"
            )
        self._policy, self._seed = policy, seed
        self._deviation = deviation * AXIS_SHARES
        self._generator = np.random.default_rng([seed, _STREAM])

    def reset(self) -> None:
        """Begins an episode."""
        if hasattr(self._policy, "reset"):
            self._policy.reset()
        self._generator = np.random.default_rng([self._seed, _STREAM])
        self._seed += 1

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """Returns the policy's action (6,) with noise on it."""
        noise = self._deviation * self._generator.normal(size=6)
        return self._policy(observation) + noise

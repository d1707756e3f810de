"""A robot made less precise on purpose (thesis, algorithm 3.2)."""

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem


def clamped(values: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Returns values within [-bounds, bounds]; a third of the time of `np.clip`."""
    return np.minimum(np.maximum(values, -bounds), bounds)


class ImprecisionNoise(LeafSystem):
    """Adds psi times unit noise to the translations of the action, and clips.

    a_psi = clip(a + N(0, psi), a_low - psi, a_high + psi), steps 6 and 7 of
    algorithm 3.2; rotations pass. The noise is an input so that its generator
    (Drake's RandomSource) keeps its seed in the Context.

    @system
    name: ImprecisionNoise
    input_ports:
    - action
    - noise
    output_ports:
    - action_executed
    @endsystem

    Args:
        psi: standard deviation of the noise [m].
        bounds: (6,) largest action [m, rad].
    """

    def __init__(self, psi: float, bounds: np.ndarray) -> None:
        super().__init__()
        self._psi = psi * np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
        self._bounds = bounds + self._psi
        self._action = self.DeclareVectorInputPort("action", 6)
        self._noise = self.DeclareVectorInputPort("noise", 6)
        self.DeclareVectorOutputPort(
            "action_executed",
            6,
            self._calc,
            prerequisites_of_calc={self._action.ticket(), self._noise.ticket()},
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        noisy = self._action.Eval(context) + self._psi * self._noise.Eval(context)
        output.SetFromVector(clamped(noisy, self._bounds))

"""A robot made less precise on purpose (thesis, algorithm 3.2)."""

import dataclasses
from typing import Self

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_disasm.common.arrays import Array, limited


def clamped(values: Array, bounds: Array) -> Array:
    """Returns values within [-bounds, bounds]; a third of the time of `np.clip`."""
    return limited(values, -bounds, bounds)


@dataclasses.dataclass(frozen=True)
class Imprecise:
    """Algorithm 3.2, steps 6 and 7: a_psi = clip(a + N(0, psi), low - psi, high + psi).

    Attributes:
        psi: (..., 6) standard deviation of each part of the action [m].
        bounds: (..., 6) largest imprecise action [m, rad].
    """

    psi: Array
    bounds: Array

    @classmethod
    def of(cls, psi: float, bounds: np.ndarray) -> Self:
        """Returns that of the translations alone.

        Args:
            psi: [m].
            bounds: (6,) largest action [m, rad].
        """
        along = psi * np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
        return cls(along, bounds + along)

    def action(self, action: Array, noise: Array) -> Array:
        """Returns actions (..., 6) that are imprecise, by unit noise (..., 6)."""
        return clamped(action + self.psi * noise, self.bounds)


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
        self._imprecise = Imprecise.of(psi, bounds)
        self._action = self.DeclareVectorInputPort("action", 6)
        self._noise = self.DeclareVectorInputPort("noise", 6)
        self.DeclareVectorOutputPort(
            "action_executed",
            6,
            self._calc,
            prerequisites_of_calc={self._action.ticket(), self._noise.ticket()},
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        action, noise = self._action.Eval(context), self._noise.Eval(context)
        output.SetFromVector(self._imprecise.action(action, noise))

"""Measured steps of the task, each from its own start, and where they lead."""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.cell.grip import JOINT_OF_AXIS
from drake_disasm.common.arrays import Array, apply_matrix, cross
from drake_disasm.effects import BoltMotion
from drake_disasm.scenario import Scenario


@dataclasses.dataclass(frozen=True)
class Steps:
    """Steps of the MDP in the twin's coordinates (see `TwinReplay`); a row is a step.

    Attributes:
        index: (n,) periods since the episode began.
        q, v: (n, 6) measured coordinates at the step's start, and their rates as
            estimated.
        qd, qd_rate: (n, 6) commanded coordinates then, and their rate in the step.
        wrench: (n, 6) that the grip's springs carried then, on the bolt at Bo in Gn.
        give_rate: (n, 6) rates of the bolt against the arm.
    """

    index: np.ndarray
    q: np.ndarray
    v: np.ndarray
    qd: np.ndarray
    qd_rate: np.ndarray
    wrench: np.ndarray
    give_rate: np.ndarray

    def __len__(self) -> int:
        return len(self.index)

    @classmethod
    def concatenated(cls, parts: "Sequence[Steps]") -> Self:
        """Returns all steps of some parts, in their order."""
        names = [field.name for field in dataclasses.fields(cls)]
        return cls(*(np.concatenate([getattr(p, n) for p in parts]) for n in names))

    def select(self, which: np.ndarray | slice) -> Self:
        """Returns some of the steps, by a mask (n,) or a slice."""
        return dataclasses.replace(
            self,
            **{f.name: getattr(self, f.name)[which] for f in dataclasses.fields(self)},
        )


class Ends(NamedTuple):
    """Where steps lead; a row is a step.

    Attributes:
        states: (n, 12) of the task.
        give: (n, 6) by how much the grip has given way then, in coordinates.
    """

    states: np.ndarray
    give: np.ndarray


def bolt_motion(
    coordinates: BoltCoordinates,
    p_BoTo_B: Array,
    q_bolt: Array,
    qd_rate: Array,
    time: float | Array,
) -> BoltMotion:
    """Returns the bolt's motion in a step, on which local effects depend.

    Args:
        coordinates: the twin's.
        p_BoTo_B: (3,) see `BoltCoordinates`.
        q_bolt: (..., 6) coordinates of the bolt.
        qd_rate: (..., 6) rate of the commanded coordinates.
        time: (...,) of the step's beginning [s].
    """
    X_GB = coordinates.poses(q_bolt)
    p_BoTo = apply_matrix(X_GB.R, p_BoTo_B)
    rate_of_turn = qd_rate[..., list(JOINT_OF_AXIS[3:])]  # while small
    v = qd_rate[..., :3] - cross(rate_of_turn, p_BoTo)
    return BoltMotion(X_GB.p, v, time)


def noise_free(scenario: Scenario) -> Scenario:
    """Returns the scenario with a sensor without noise and quantisation."""
    silent = dataclasses.replace(scenario.ft_sensor, noise=[0.0] * 6, quantum=[0.0] * 6)
    return dataclasses.replace(scenario, ft_sensor=silent, randomisation=[])

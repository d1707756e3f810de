"""What the cell's arm does a little differently from the twin's."""

import dataclasses
from typing import Self

import numpy as np
from pydrake.math import RigidTransform

from drake_disasm.cell.grip import AXIS_ORDER
from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.common.spatial import velocity_shift
from drake_disasm.scenario import Scenario
from sysid.models.base import Array

_FAR = 0.06  # m along x, where the bolt runs into stop B

#: What the cell's sensor reads of free motion, and the twin's does not: force along
#: x, y and z by the commanded rate, and by its change since the step before [N s/m].
#: The twin has no palm behind the sensor, and no command that comes in pieces. Measured
#: with the shipped gripper under position control (`tests/physics/free_motion.py`).
_STEADY, _CHANGE = np.array([1.6, 2.0, 4.0]), np.array([3.5, 3.9, 3.3])
_PALM = np.array([0.0, 0.0, 0.1])  # m, where that force acts, in S


@dataclasses.dataclass(frozen=True)
class Sway:
    """What moving by itself loads the cell's sensor with, beyond what the twin says.

    Attributes:
        steady, change: (3,) forces by commanded rate and by its change [N s/m].
    """

    steady: Array
    change: Array

    @classmethod
    def of(cls, scenario: Scenario, station: str) -> Self:
        """Returns it for a log of a station; zero where it was not measured."""
        known = scenario.arm.control == "position" and station == "cell"
        known &= scenario.gripper.compliance == "adaptive"
        return cls(_STEADY * known, _CHANGE * known)

    def wrenches(self, rates: Array, R_SB: Array) -> Array:
        """Returns the load (n, 6) at the end of each step, [f; tau] at So in S.

        Args:
            rates: (n, 3) of an episode, commanded along x, y and z of G [m/s].
            R_SB: (3, 3) the bolt's axes in S.
        """
        change = np.diff(rates, axis=0, prepend=np.zeros((1, 3)))
        f_S = (rates * self.steady + change * self.change) @ R_SB.T
        return np.hstack([f_S, np.cross(_PALM, f_S)])


@dataclasses.dataclass(frozen=True)
class CellArm:
    """By how much the arm's command is off, seen from the twin.

    The cell's arm is commanded for each control period to where it should be at the
    end; the plant takes that at the end of each of its own steps: on average the
    command is ahead. (The twin's is even.) And an arm's compliance depends on its
    posture, the twin has that of A: under a load the arm stands elsewhere, as if it
    had been commanded there.

    Attributes:
        lead: of the command [s].
        softer: (6, 6) growth of the compliance with the travel along x, at the pads in
            Gn [1/N, ...].
        to_grip: (6, 6) wrench at the pads by that on the bolt at Bo, in Gn.
    """

    lead: float
    softer: Array
    to_grip: Array

    @classmethod
    def of(cls, scenario: Scenario, station: str) -> Self:
        """Returns what is different in a log of a station.

        How a real arm interpolates its commands is not known; a twin has no posture.

        Args:
            scenario: of the log.
            station: "cell", "hardware", "twin", or whatever the log says.
        """
        here, held = twin_of(scenario), scenario.arm.control_period
        lead, softer = 0.0, np.zeros((6, 6))
        if station == "cell":
            lead = max(held - scenario.simulation.cell_time_step, 0.0) / 2.0
        if station in ("cell", "hardware"):
            there = twin_of(scenario, RigidTransform([_FAR, 0.0, 0.0]))
            softer = np.linalg.inv(there.arm.K) - np.linalg.inv(here.arm.K)
        return cls(lead, softer / _FAR, velocity_shift(here.p_BoTo_B).T)

    def shifts(self, q: Array, wrench: Array) -> Array:
        """Returns by how much (n, 6) the command is shifted, in coordinates.

        Args:
            q: (n, 6) coordinates of the arm.
            wrench: (n, 6) measured on the bolt at Bo in Gn.
        """
        moved = (wrench @ self.to_grip.T) @ self.softer.T
        return np.asarray(q[:, :1] * moved[:, list(AXIS_ORDER)])

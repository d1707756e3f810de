"""What the cell's arm does a little differently from the twin's."""

import dataclasses
from typing import Self

import numpy as np

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.cell.grip import AXIS_ORDER
from drake_disasm.cell.twin_parameters import TwinParameters, twin_of
from drake_disasm.common.arrays import apply_matrix
from drake_disasm.common.spatial import velocity_shift
from drake_disasm.scenario import Scenario
from drake_disasm.twin.arm_step import ArmStep
from sysid.models.base import Array

#: How far from A compliance is compared, in coordinates [m, rad]: along x that is where
#: the bolt runs into stop B.
_FAR = np.array([0.06, 0.01, 0.01, 0.05, 0.05, 0.05])

#: What the cell's sensor reads of free motion, and the twin's does not: force along
#: x, y and z by the commanded rate, and by its change since the step before [N s/m].
#: The twin has no palm behind the sensor, and no command that comes in pieces. Measured
#: with the shipped gripper under position control (`benchmarks/sensor_in_motion.py`).
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
    command is ahead. (The twin's is even.) The commanded rate comes a control period
    late, since it is the difference of commands that the plant already has: where it
    changes by a, the arm misses the momentum D a h of its damper. And an arm's
    compliance depends on its posture, the twin has that of A; and it carries the moment
    of a load that the grip's springs have moved: under a load the arm stands elsewhere,
    as if it had been commanded there.

    Attributes:
        lead: of the command [s].
        late: (6, 6) by how much the command is elsewhere for a change of its rate, so
            that the arm ends a step where the late rate has it; in coordinates [s].
        yields: (6, 3) how far the arm yields at A to a moment at the pads, in Gn.
        softer: (6, 6, 6) growth of its compliance with each coordinate, there.
        to_grip: (6, 6) wrench at the pads by that on the bolt at Bo, in Gn.
    """

    lead: float
    late: Array
    yields: Array
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
        lead, late = 0.0, np.zeros((6, 6))
        at_A = np.linalg.inv(here.arm.K)
        softer = np.zeros((6, 6, 6))
        if station == "cell":
            lead = max(held - scenario.simulation.cell_time_step, 0.0) / 2.0
            late = _late(here, held, scenario.task.period)
        if station in ("cell", "hardware"):
            softer = _softer(scenario, here.p_BoTo_B, at_A)
        return cls(lead, late, at_A[:, 3:], softer, velocity_shift(here.p_BoTo_B).T)

    def ahead(self, rates: Array) -> Array:
        """Returns by how much (n, 6) the command is ahead, in coordinates.

        Args:
            rates: (n, 6) commanded in an episode's steps, which begins at rest.
        """
        change = np.diff(rates, axis=0, prepend=np.zeros((1, 6)))
        return np.asarray(self.lead * rates + change @ self.late.T)

    def shifts(self, q: Array, wrench: Array, moment: Array) -> Array:
        """Returns by how much (n, 6) the command is shifted, in coordinates.

        Args:
            q: (n, 6) coordinates of the arm.
            wrench: (n, 6) measured on the bolt at Bo in Gn.
            moment: (n, 3) of what the springs have moved, see `GripOffset`.
        """
        softer = np.einsum("ni,ijk->njk", q, self.softer)
        moved = apply_matrix(softer, wrench @ self.to_grip.T) + moment @ self.yields.T
        return np.asarray(moved[:, list(AXIS_ORDER)])


def _softer(scenario: Scenario, p_BoTo_B: Array, at_A: Array) -> Array:
    """Returns `CellArm.softer` of a scenario's arm.

    Args:
        scenario: of the log.
        p_BoTo_B: (3,) of the twin's coordinates [m].
        at_A: (6, 6) its compliance there.
    """
    coordinates = BoltCoordinates(p_BoTo_B)
    found = np.empty((6, 6, 6))
    for i, far in enumerate(_FAR):
        there = twin_of(scenario, coordinates.pose(far * np.eye(6)[i]))
        found[i] = (np.linalg.inv(there.arm.K) - at_A) / far
    return found


def _late(twin: TwinParameters, delay: float, period: float) -> Array:
    """Returns `CellArm.late` of an arm whose commanded rate is late by a delay [s]."""
    order = np.ix_(AXIS_ORDER, AXIS_ORDER)
    step = ArmStep.of(twin.arm, twin.grip, period)
    by_place, by_rate = step.F[:6, :6], step.F[:6, 6:]
    kick = -delay * np.linalg.solve(twin.arm.M, twin.arm.D)[order]
    return np.asarray(np.linalg.solve(np.eye(6) - by_place, by_rate @ kick))

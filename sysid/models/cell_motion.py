"""What motion does in the cell and not in the twin."""

import numpy as np

from drake_disasm.scenario import Scenario
from sysid.models.base import Array

#: What the cell's sensor reads of free motion, and the twin's does not: force along
#: x, y and z by the commanded rate, and by its change since the step before [N s/m].
#: The twin has no palm behind the sensor, and no command that comes in pieces. Measured
#: with the shipped gripper under position control (`benchmarks/sensor_in_motion.py`).
_STEADY, _CHANGE = np.array([1.6, 2.0, 4.0]), np.array([3.5, 3.9, 3.3])
_PALM = np.array([0.0, 0.0, 0.1])  # m, where that force acts, in S


def sway(scenario: Scenario, station: str, rates: Array, R_SB: Array) -> Array:
    """Returns what moving loads the sensor with (n, 6), beyond what the twin says.

    At the end of each step, [f; tau] at So in S; zero where it was not measured, or
    the sensor does not move.

    Args:
        scenario: of the log.
        station: "cell", "hardware", "twin", or whatever the log says.
        rates: (n, 3) of an episode, commanded along x, y and z of G [m/s].
        R_SB: (3, 3) the bolt's axes in S.
    """
    known = scenario.arm.control == "position" and station == "cell"
    known &= scenario.gripper.compliance == "adaptive"
    known &= scenario.ft_sensor.place != "part"
    change = np.diff(rates, axis=0, prepend=np.zeros((1, 3)))
    f_S = known * (rates * _STEADY + change * _CHANGE) @ R_SB.T
    return np.hstack([f_S, np.cross(_PALM, f_S)])


def lead(scenario: Scenario, station: str) -> float:
    """Returns by how much the arm's command is ahead, on average [s].

    The cell's arm is commanded for each control period to where it should be at the
    end; the plant takes that at the end of each of its own steps. (The twin's command
    is even.) How a real arm interpolates its commands is not known.

    Args:
        scenario, station: see `sway`.
    """
    held, step = scenario.arm.control_period, scenario.simulation.cell_time_step
    return max(held - step, 0.0) / 2.0 if station == "cell" else 0.0

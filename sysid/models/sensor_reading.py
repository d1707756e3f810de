"""The wrench at the sensor: where its channels' noise is independent, and errs."""

from collections.abc import Sequence
from typing import Self

import numpy as np
from pydrake.multibody.tree import UniformGravityFieldElement
from scipy.spatial.transform import Rotation

from drake_disasm.cell.placement import nominal_groove_pose
from drake_disasm.cell.sensor import sensor_under_part
from drake_disasm.cell.tool import Tool
from drake_disasm.common.rotations import Pose
from drake_disasm.common.spatial import shifted_wrench
from drake_disasm.devices.sensor_chain import (
    sensed_along,
    sensed_at_zeroing,
)
from drake_disasm.effects import Sensing, SensorEffect
from drake_disasm.logs import Log
from drake_disasm.logs.refusal import refusal
from drake_disasm.scenario import Scenario
from drake_disasm.systems.observation import Mounting
from sysid.models.base import Array


def station_of(log: Log) -> str:
    """Returns where a log was recorded, as it says."""
    return str(log.header.provenance.get("station", ""))


def at_sensor(states: Array, mounting: Mounting) -> Array:
    """Returns states with the load at So in S in place of the wrench at Bo in G.

    The inverse of the last step of observation processing.

    Args:
        states: (n, 12), position, rotation vector and wrench [f; tau] at Bo, in G.
        mounting: of the sensor.
    """
    there = _from_bolt(states, mounting).inverse()
    load = mounting.sign * shifted_wrench(states[:, 6:], there.R, there.p)
    return np.hstack([states[:, :6], load])


def at_bolt(states: Array, mounting: Mounting) -> Array:
    """Returns states (n, 12) with the wrench at Bo in G again: undoes `at_sensor`."""
    there = _from_bolt(states, mounting)
    wrench = mounting.sign * shifted_wrench(states[:, 6:], there.R, there.p)
    return np.hstack([states[:, :6], wrench])


def _from_bolt(states: Array, mounting: Mounting) -> Pose:
    """Returns where the sensor is (n,) from Bo, along the axes of G."""
    R_GB = Rotation.from_rotvec(states[:, 3:6]).as_matrix()
    return mounting.from_bolt(Pose(R_GB, states[:, :3]))


class SensorReading:
    """How the sensor's effects change processed wrenches, many at once.

    Attributes:
        mounting: of the sensor, with what hangs on the log's: the gripper and the bolt,
            or bolt and fingers alone if it is the twin's; or the fixed part on it.
        payload: the same load.
        station: where the log was recorded.

    Processing takes the reading at zeroing off, and the change of the known weight
    since then (`contact_wrench`); so what effects add to readings, and to the
    one at zeroing, is added to what is processed.
    """

    def __init__(self, scenario: Scenario, tool: Tool, station: str = "twin") -> None:
        """Takes what hangs on the sensor.

        Args:
            scenario: of the log.
            tool: on the flange.
            station: where the log was recorded: "cell", "hardware", or the twin.
        """
        self.station = station
        carried = tool.M_gripped_B
        of_twin = carried.get_mass(), tool.X_SB @ carried.get_com()
        of_log = of_twin
        if station in ("cell", "hardware"):
            of_log = tool.mass, tool.p_SoScm_S
        X_GS = None
        if scenario.ft_sensor.place == "part":
            X_GS, M_S = sensor_under_part(scenario)
            of_log = of_twin = M_S.get_mass(), M_S.get_com()
        R_WG = nominal_groove_pose(scenario.placement).rotation().matrix()
        g_W = UniformGravityFieldElement().gravity_vector()
        self.mounting = Mounting(tool.X_SB, R_WG, *of_log, g_W, X_GS)
        self.payload = self.mounting.payload
        self._of_twin = Mounting(tool.X_SB, R_WG, *of_twin, g_W, X_GS).weight_at_start

    @classmethod
    def of(cls, logs: Sequence[Log], scenario: Scenario) -> Self:
        """Returns what the sensor of some logs reads.

        Raises:
            DisasmError: not the same hangs on all their sensors.
        """
        tool = Tool.from_models(scenario)
        found = [cls(scenario, tool, station_of(log)) for log in logs]
        for log, other in zip(logs, found, strict=True):
            if other.payload.mass != found[0].payload.mass:
                raise refusal(
                    log.folder / "log.yaml",
                    f"of the station '{station_of(log)}', the first log is of "
                    f"'{station_of(logs[0])}': other loads hang on their sensors",
                    "give logs of the twin and logs of a cell apart",
                )
        return found[0]

    def zeroed(self, reading: Array) -> Array:
        """Returns the log's reading (6,) at zeroing, of the twin's."""
        return np.asarray(reading + self.at_rest - self._of_twin)

    @property
    def p_SoBo_S(self) -> Array:
        """The bolt at A (3,) from the sensor, in S [m]."""
        return _from_bolt(np.zeros((1, 12)), self.mounting).inverse().p[0]

    @property
    def at_rest(self) -> Array:
        """The reading (6,) at A under the known weight alone, without effects."""
        return self.mounting.weight_at_start

    def raw(self, states: Array, zero: Array) -> Array:
        """Returns the raw readings (n, 6) in S of states (n, 12), wrench at So in S.

        Args:
            states: of the task.
            zero: (6,) the reading at zeroing.
        """
        weight = self.payload.weight(self.orientations(states))
        return states[:, 6:] + zero - self.at_rest + weight

    def sensing(self, states: Array, times: Array) -> Sensing:
        """Returns the circumstances of readings, of states (n, 12) at times (n,)."""
        return self.payload.sensing(times, self.orientations(states))

    def read(
        self,
        effects: Sequence[SensorEffect],
        states: Array,
        zero: Array,
        times: Array,
        between: Array | None = None,
    ) -> Array:
        """Returns states (n, 12) whose wrench is read through effects.

        Args:
            effects: in the order of the chain.
            states: without them, the wrench at So in S.
            zero: (6,) the reading at zeroing, without them.
            times: (n,) since the episode began [s]; they start anew in each episode.
            between: see `sensed_along`.
        """
        raw = self.raw(states, zero)
        sensing = self.sensing(states, times)
        [R_WS] = self.orientations(np.zeros((1, 6)))
        rest = self.payload.sensing(np.array(0.0), R_WS)
        load = sensed_along(raw, effects, sensing, zero, rest, between)
        seen = sensed_at_zeroing(zero, effects, rest)
        change = (load - raw) - (seen - zero)
        return np.hstack([states[:, :6], states[:, 6:] + change])

    def reported(self, states: Array, poses: Array) -> Array:
        """Returns states (n, 12) as they are processed with other poses (n, 6).

        Processing takes off the payload's weight at the pose that is reported.
        """
        reported = np.hstack([poses, states[:, 6:]])
        there, seen = (
            self.payload.weight(self.orientations(s)) for s in (states, reported)
        )
        reported[:, 6:] += there - seen
        return reported

    def orientations(self, states: Array) -> Array:
        """Returns the orientations (n, 3, 3) of the sensor in W, of states (n, 12)."""
        return np.asarray(self.mounting.R_WS(_from_bolt(states, self.mounting).R))

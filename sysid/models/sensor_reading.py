"""The wrench at the sensor: where its channels' noise is independent, and errs."""

from collections.abc import Sequence
from typing import Self

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.tree import UniformGravityFieldElement
from scipy.spatial.transform import Rotation

from drake_disasm.cell.placement import nominal_groove_pose
from drake_disasm.cell.tool import Tool
from drake_disasm.common.errors import DisasmError
from drake_disasm.devices.sensor_chain import (
    Payload,
    sensed_along,
    sensed_at_zeroing,
)
from drake_disasm.effects import Sensing, SensorEffect
from drake_disasm.logs import Log
from drake_disasm.logs.refusal import refusal
from drake_disasm.scenario import Scenario
from sysid.models.base import Array


def station_of(log: Log) -> str:
    """Returns where a log was recorded, as it says."""
    return str(log.header.provenance.get("station", ""))


def at_sensor(states: Array, X_SB: RigidTransform) -> Array:
    """Returns states with the wrench at So in S in place of that at Bo in G.

    The inverse of the last step of observation processing.

    Args:
        states: (n, 12), position, rotation vector and wrench [f; tau] at Bo, in G.
        X_SB: the bolt in the sensor's frame.
    """
    X_BS = X_SB.inverse()
    R_GB = Rotation.from_rotvec(states[:, 3:6]).as_matrix()
    p_BoSo_G = R_GB @ X_BS.translation()
    f_G, t_Bo_G = states[:, 6:9], states[:, 9:12]
    t_So_G = t_Bo_G - np.cross(p_BoSo_G, f_G)
    R_GS = R_GB @ X_BS.rotation().matrix()
    in_S = [np.einsum("nij,ni->nj", R_GS, vector) for vector in (f_G, t_So_G)]
    return np.hstack([states[:, :6], *in_S])


def at_bolt(states: Array, X_SB: RigidTransform) -> Array:
    """Returns states (n, 12) with the wrench at Bo in G again: undoes `at_sensor`."""
    X_BS = X_SB.inverse()
    R_GB = Rotation.from_rotvec(states[:, 3:6]).as_matrix()
    R_GS = R_GB @ X_BS.rotation().matrix()
    f_G, t_So_G = (
        np.einsum("nij,nj->ni", R_GS, part) for part in (states[:, 6:9], states[:, 9:])
    )
    t_Bo_G = t_So_G + np.cross(R_GB @ X_BS.translation(), f_G)
    return np.hstack([states[:, :6], f_G, t_Bo_G])


def refuse_sensor_under_part(scenario: Scenario) -> None:
    """Refuses a scenario whose sensor does not move with the bolt.

    Raises:
        DisasmError: says which places are identified.
    """
    if scenario.ft_sensor.place == "part":
        raise DisasmError(
            "ft_sensor.place: 'part' can't be identified or checked; record with the "
            "sensor in the wrist, or with none"
        )


class SensorReading:
    """How the sensor's effects change processed wrenches, many at once.

    Attributes:
        X_SB: the bolt in the sensor's frame.
        payload: what hangs on the log's sensor: the gripper and the bolt, or bolt and
            fingers alone if it is the twin's.

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

        Raises:
            DisasmError: the sensor does not move with the bolt.
        """
        refuse_sensor_under_part(scenario)
        self.X_SB = tool.X_SB
        self._R_WG = nominal_groove_pose(scenario.placement).rotation().matrix()
        self._R_BS = tool.X_SB.inverse().rotation().matrix()
        g_W = UniformGravityFieldElement().gravity_vector()
        carried = tool.M_gripped_B
        p_SoScm_S = tool.X_SB @ carried.get_com()
        self.payload = Payload(carried.get_mass(), p_SoScm_S, g_W)
        self._of_twin = self.at_rest
        if station in ("cell", "hardware"):
            self.payload = Payload(tool.mass, tool.p_SoScm_S, g_W)

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
    def at_rest(self) -> Array:
        """The reading (6,) at A under the known weight alone, without effects."""
        return self.payload.weight(self._R_WG @ self._R_BS)

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
    ) -> Array:
        """Returns states (n, 12) whose wrench is read through effects.

        Args:
            effects: in the order of the chain.
            states: without them, the wrench at So in S.
            zero: (6,) the reading at zeroing, without them.
            times: (n,) since the episode began [s]; they start anew in each episode.
        """
        raw = self.raw(states, zero)
        sensing = self.sensing(states, times)
        rest = self.payload.sensing(np.array(0.0), self._R_WG @ self._R_BS)
        load = sensed_along(raw, effects, sensing, zero, rest)
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
        R_GB = Rotation.from_rotvec(states[:, 3:6]).as_matrix()
        return np.asarray(self._R_WG @ R_GB @ self._R_BS)

"""A recorded episode of the task, in the twin's coordinates."""

import dataclasses
import functools
from typing import Self

import numpy as np

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.common.spatial import pose_from_vector
from drake_disasm.logs import Episode
from drake_disasm.logs.transitions import observations
from drake_disasm.twin.steps import Steps
from sysid.models.arm_rates import ArmRates
from sysid.models.base import Array
from sysid.models.commands import bolt_path
from sysid.models.grip_state import GripState
from sysid.models.late_pose import on_time
from sysid.models.sensor_reading import SensorReading, at_bolt, at_sensor


@dataclasses.dataclass(frozen=True)
class MeasuredEpisode:
    """An episode of n steps as it was recorded, in the twin's coordinates.

    Attributes:
        measured, commanded: (n + 1, 6) coordinates.
        wrench: (n + 1, 6) measured on the bolt at Bo in G.
        rates, grip: that tell what no encoder measures.
        lead: of the arm's command [s].
    """

    measured: Array
    commanded: Array
    wrench: Array
    rates: ArmRates
    grip: GripState
    lead: float

    @classmethod
    def of(
        cls,
        episode: Episode,
        rates: ArmRates,
        grip: GripState,
        lead: float,
        twin: BoltCoordinates,
    ) -> Self:
        """Returns a log's episode."""
        return cls(
            _coordinates(episode["X_GB_measured"], twin),
            _coordinates(episode["X_GB_commanded"], twin),
            observations(episode)[:, 6:],
            rates,
            grip,
            lead,
        )

    def at_sensor(self, sensing: SensorReading, p_BoTo_B: Array) -> Array:
        """Returns the states (n + 1, 12) with the wrench at So in S."""
        poses = bolt_path(self.measured, p_BoTo_B)
        return at_sensor(np.hstack([poses, self.wrench]), sensing.mounting)

    def without(self, offset: Array, sensing: SensorReading, p_BoTo_B: Array) -> Self:
        """Returns the episode with a wrench (6,) at So in S taken off."""
        if not offset.any():
            return self
        states = self.at_sensor(sensing, p_BoTo_B)
        states[:, 6:] -= offset
        return dataclasses.replace(
            self, wrench=at_bolt(states, sensing.mounting)[:, 6:]
        )

    def begins_elsewhere(self, other: Self, noticeable: tuple[float, float]) -> bool:
        """Returns whether the grip gives or creeps by (m, rad) more than another's."""
        given = self.grip.deflections(self.wrench - other.wrench)
        change = np.abs(np.vstack([given, self.elsewhere - other.elsewhere]))
        m, rad = noticeable
        return bool(np.any(change[:, :3] > m) or np.any(change[:, 3:] > rad))

    def ahead(self, rates: Array) -> Array:
        """Returns by how much (n, 6) the arm's command is elsewhere.

        Args:
            rates: (n, 6) commanded, in coordinates.
        """
        return self.lead * rates + self.elsewhere[:-1]

    @functools.cached_property
    def elsewhere(self) -> Array:
        """By how much the bolt is elsewhere in the grip (n + 1, 6): see GripState."""
        return self.grip.elsewhere(self.measured, self.wrench)

    def on_time(self, path: Array, weights: Array) -> Self:
        """Returns the episode with poses that do not come late: see `on_time`."""
        there = on_time(self.measured, path, weights)
        return dataclasses.replace(self, measured=there)

    def steps(self) -> Steps:
        """Returns its steps."""
        q, qd, wrench = self.measured, self.commanded, self.wrench
        elastic = self.grip.elastic(wrench[:-1])
        return Steps(
            np.arange(len(elastic)),
            q[:-1] + self.elsewhere[:-1],
            self.begin_rates(qd),
            qd[:-1],
            np.diff(qd, axis=0) / self.rates.step.h,
            elastic,
            self.grip.rates(elastic, wrench[:-1]),
        )

    def begin_rates(self, path: Array) -> Array:
        """Returns how fast the arm moves (n, 6) as each step begins.

        Args:
            path: (n + 1, 6) what it was commanded to do, in coordinates.
        """
        return self.rates.along(self.measured, path, self.wrench)


def _coordinates(poses: Array, twin: BoltCoordinates) -> Array:
    """Returns the twin's coordinates (n, 6) of poses (n, 7)."""
    return np.array([twin.solve(pose_from_vector(p), np.zeros(6)) for p in poses])

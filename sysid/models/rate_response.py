"""What a change of the commanded rate does in the cell, and not in the twin's steps."""

import copy
import dataclasses
import functools
from typing import Self

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from drake_disasm.cell.tool import Tool
from drake_disasm.common.rotations import rotation_vectors
from drake_disasm.common.spatial import pose_from_vector
from drake_disasm.common.timing import boundary
from drake_disasm.devices.sensor_chain import BETWEEN
from drake_disasm.logs import Episode
from drake_disasm.parts import ContactConfig
from drake_disasm.scenario import Scenario
from drake_disasm.stations.cell import CellStation
from drake_disasm.stations.contact import exclude_collisions
from drake_disasm.task.simulation import TaskSimulation
from sysid.models.arm_rates import ArmRates
from sysid.models.base import Array
from sysid.models.cell_motion import lead
from sysid.models.commands import bolt_path, twin_coordinates

#: Changes that are simulated, along and about the axes of G [m/s, rad/s].
_CHANGES = (1e-3,) * 3 + (1e-2,) * 3


@dataclasses.dataclass(frozen=True)
class RateResponse:
    """Response to a change of the commanded rate, along and about the axes of G.

    Within a few hundredths of a second the arm gathers speed, and what hangs on the
    sensor pulls at it. A twin's step knows its two ends: between them it has the load
    on a straight line. And where the step ends the arm is a little elsewhere than the
    twin's, which is linear, has joints in place of seven, and a command that is even.

    Attributes:
        swing: (6, BETWEEN, 6) by how much loads at So in S, evenly in the step that
            begins with the change, are off the straight line [N s/m, N s/rad, ...].
        lag: (6, 6) by how much the bolt's pose is elsewhere at the step's end than
            where the twin has it, in G [s, and s m/rad or s rad/m].
    """

    swing: Array
    lag: Array

    @classmethod
    def of(cls, scenario: Scenario, station: str) -> Self:
        """Returns the response of a station.

        Simulated in the cell with nothing around the bolt. Nothing of other stations:
        a twin's logs are as the twin has them, and a real arm's response is not known.

        Args:
            scenario: of the log.
            station: "cell", "hardware", "twin", or whatever the log says.
        """
        if station != "cell":
            return cls(np.zeros((6, BETWEEN, 6)), np.zeros((6, 6)))
        quiet = copy.deepcopy(scenario)
        quiet.effects, quiet.randomisation, quiet.contact = [], [], ContactConfig()
        quiet.ft_sensor.noise = quiet.ft_sensor.quantum = [0.0] * 6
        quiet.imprecision = 0.0
        found = _simulated(_Asked(repr(quiet), quiet))
        moves = scenario.ft_sensor.place != "part"
        return cls(moves * found[0], found[1])


def rate_changes(episode: Episode, period: float) -> Array:
    """Returns by how much the commanded rates (n, 6) change as steps begin.

    Args:
        episode: of n steps, of a log.
        period: of a step [s].
    """
    poses = episode["X_GB_commanded"]
    R = np.array([pose_from_vector(pose).rotation().matrix() for pose in poses])
    turned = rotation_vectors(R[1:] @ R[:-1].transpose(0, 2, 1))
    rates = np.hstack([np.diff(poses[:, :3], axis=0), turned]) / period
    return np.diff(rates, axis=0, prepend=np.zeros((1, 6)))


@dataclasses.dataclass(frozen=True)
class _Asked:
    """A scenario; equal if its text is."""

    text: str
    scenario: Scenario = dataclasses.field(compare=False)


@functools.lru_cache(maxsize=8)
def _simulated(asked: _Asked) -> tuple[Array, Array]:
    """Returns swing and lag."""
    scenario, action = asked.scenario, np.zeros(6)
    period = scenario.task.period
    simulation = TaskSimulation(scenario, _InTheOpen, lambda _: action)
    share = np.linspace(0.0, 1.0, BETWEEN + 2)
    swing, lag = [], []
    for axis, change in enumerate(_CHANGES):
        action[:] = period * change * np.eye(6)[axis]
        pose, loads = simulation.reset(0)[:6], []
        for time in share * period:
            simulation.simulator.AdvanceTo(boundary(0, period) + time)
            loads.append(simulation.evaluate(simulation.station, "ft_sensor.wrench"))
        line = np.outer(1.0 - share, loads[0]) + np.outer(share, loads[-1])
        swing.append((loads - line)[1:-1] / change)
        went = simulation.observation()[:6] - pose
        lag.append((went - _of_twin(scenario, action)) / change)
    return np.array(swing), np.array(lag)


def _of_twin(scenario: Scenario, action: Array) -> Array:
    """Returns where the twin's arm is (6,) after a step from rest."""
    p_BoTo_B = Tool.from_models(scenario).p_BoTo_B
    step = ArmRates.of(scenario).step
    [_, end] = twin_coordinates(np.array([np.zeros(6), action]), p_BoTo_B)
    rate = end / step.h
    commanded = np.hstack([end + lead(scenario, "cell") * rate, rate])
    [reached] = step.ahead(np.zeros((1, 12)), commanded[None])[:, :6]
    return np.asarray(bolt_path(reached[None], p_BoTo_B)[0])


class _InTheOpen(CellStation):
    """The cell, whose bolt meets no groove."""

    def _finish(self, builder: DiagramBuilder) -> None:
        lock = self.lock
        exclude_collisions(self.scene_graph, lock.bolt_ids.values(), lock.groove_ids)
        super()._finish(builder)

"""Measured transitions of the task, as a twin replays and predicts them."""

import dataclasses
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.cell.tool import Tool
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.spatial import pose_from_vector
from drake_disasm.effects import MotionEffect
from drake_disasm.logs import Episode, Log
from drake_disasm.logs.refusal import refusal
from drake_disasm.logs.transitions import observations
from drake_disasm.mdp import STATE_NAMES
from drake_disasm.scenario import Scenario
from drake_disasm.task.replay import Steps
from sysid.models.arm_rates import ArmRates
from sysid.models.base import Array
from sysid.models.commands import Commands, twin_coordinates
from sysid.models.measurements import Channel, Measurements
from sysid.models.sensor_reading import SensorReading, at_sensor

#: Repeatability of a robot's own encoders within an episode, m and rad: below that of
#: the robot (0.1 mm, against an external frame), above their resolution.
POSE_NOISE = (2e-5, 1e-4)


@dataclasses.dataclass(frozen=True)
class Transitions:
    """Transitions of one or more episodes.

    Attributes:
        steps: measured state and command of each transition (rows,).
        before: (rows, 12) state at its beginning, the wrench at So in S.
        rows: (rows,) its number among all transitions of the episodes.
        commands: of whole episodes, since effects on the motion have a memory.
        period: of the MDP [s].
        p_BoTo_B: (3,) of the twin's coordinates [m].
    """

    steps: Steps
    before: Array
    rows: NDArray[np.int64]
    commands: tuple[Commands, ...]
    period: float
    p_BoTo_B: Array

    @classmethod
    def of(
        cls, logs: Sequence[Log], scenario: Scenario, sensing: SensorReading
    ) -> Self:
        """Returns all transitions of some logs.

        Raises:
            DisasmError: a log is of another kind or period.
        """
        for log in logs:
            _refuse_other_logs(log, scenario)
        episodes = [episode for log in logs for episode in log.episodes]
        period = scenario.task.period
        p_BoTo_B = Tool.from_models(scenario).p_BoTo_B
        twin, rates = BoltCoordinates(p_BoTo_B), ArmRates.of(scenario)
        steps = _concatenated([_steps(e, rates, twin) for e in episodes])
        states = [at_sensor(observations(e)[:-1], sensing.X_SB) for e in episodes]
        commands = tuple(Commands.of(e, period) for e in episodes)
        rows = np.arange(len(steps))
        return cls(steps, np.concatenate(states), rows, commands, period, p_BoTo_B)

    def select(self, mask: NDArray[np.bool_]) -> Self:
        """Returns the transitions where the mask (rows,) is true."""
        return dataclasses.replace(
            self,
            steps=self.steps.select(mask),
            before=self.before[mask],
            rows=self.rows[mask],
        )

    def executed(self, effects: Sequence[MotionEffect]) -> Steps:
        """Returns the steps as effects, in the chain's order, have them executed."""
        if not effects:
            return self.steps
        paths = [
            twin_coordinates(c.executed(effects), self.p_BoTo_B) for c in self.commands
        ]
        qd = np.concatenate([path[:-1] for path in paths])
        moved = np.concatenate([np.diff(path, axis=0) for path in paths])
        return dataclasses.replace(
            self.steps, qd=qd[self.rows], qd_rate=moved[self.rows] / self.period
        )

    def ends_before(self, ends: Array) -> Array:
        """Returns what the step before ended with, of (rows, ...) that steps end with.

        Zero where an episode begins, or the step before is not among these.
        """
        follows = (np.diff(self.rows) == 1) & (self.steps.index[1:] > 0)
        before = np.zeros_like(ends)
        before[1:][follows] = ends[:-1][follows]
        return before

    def covariates(self) -> dict[str, Array]:
        """Returns time, place, action and force at each beginning (rows,), by name."""
        steps = self.steps
        found = {
            "time": steps.index * self.period,
            "order of steps": self.rows.astype(float),
            "travel x": steps.q[:, 0],
            "position z": steps.q[:, 2],
            "commanded rate along x": steps.qd_rate[:, 0],
            "commanded rate along z": steps.qd_rate[:, 2],
        }
        forces = self.before[:, 6:9].T
        axes = zip("xyz", forces, strict=True)
        return found | {f"force along {axis}_S": force for axis, force in axes}


def measured_states(
    logs: Sequence[Log], scenario: Scenario, sensing: SensorReading
) -> Measurements:
    """Returns the states (rows, 12) after each transition, the wrench at So in S.

    Raises:
        DisasmError: the scenario's sensor has neither noise nor a quantum.
    """
    return Measurements.of_logs(
        logs,
        _channels(scenario),
        lambda _, episode: at_sensor(observations(episode)[1:], sensing.X_SB),
    )


def _channels(scenario: Scenario) -> tuple[Channel, ...]:
    units = ["m"] * 3 + ["rad"] * 3 + ["N"] * 3 + ["N m"] * 3
    sensor = scenario.ft_sensor
    rounding = np.array(sensor.quantum) / np.sqrt(12.0)  # of a uniform distribution
    wrench = np.hypot(sensor.noise, rounding)
    noise = [POSE_NOISE[0]] * 3 + [POSE_NOISE[1]] * 3 + wrench.tolist()
    if min(noise) <= 0.0:
        raise DisasmError(
            "ft_sensor.noise: is zero with a zero quantum; channels are weighted by "
            "their noise, give the sensor's"
        )
    origins = ["repeatability of the arm"] * 6 + ["ft_sensor.noise"] * 6
    return tuple(
        Channel(*row) for row in zip(STATE_NAMES, units, noise, origins, strict=True)
    )


def _refuse_other_logs(log: Log, scenario: Scenario) -> None:
    where = log.folder / "log.yaml"
    if log.header.kind != "transitions":
        raise refusal(
            where,
            f"a log of kind '{log.header.kind}', the twin predicts 'transitions'",
            "name a log that tools/simulate.py --record or the cell wrote",
        )
    period = log.header.period
    if period is None or abs(period - scenario.task.period) > 1e-9:
        raise refusal(
            where,
            f"period {period} s, the scenario has task.period {scenario.task.period} s",
            "give the scenario that was recorded, or --set task.period",
        )


def _steps(episode: Episode, rates: ArmRates, twin: BoltCoordinates) -> Steps:
    measured = _coordinates(episode["X_GB_measured"], twin)
    commanded = _coordinates(episode["X_GB_commanded"], twin)
    wrench = observations(episode)[:, 6:]
    v = np.zeros((episode.rows - 1, 6))
    for k in range(1, len(v)):
        last = np.s_[None, k - 1 : k + 1]
        v[k] = rates.after(
            v[None, k - 1], measured[last], commanded[last], wrench[last]
        )
    return Steps(
        np.arange(episode.rows - 1),
        measured[:-1],
        v,
        commanded[:-1],
        np.diff(commanded, axis=0) / rates.step.h,
        wrench[:-1],
    )


def _coordinates(poses: Array, twin: BoltCoordinates) -> Array:
    """Returns the twin's coordinates (n, 6) of poses (n, 7)."""
    return np.array([twin.solve(pose_from_vector(p), np.zeros(6)) for p in poses])


def _concatenated(parts: Sequence[Steps]) -> Steps:
    return Steps(
        *(
            np.concatenate([getattr(part, f.name) for part in parts])
            for f in dataclasses.fields(Steps)
        )
    )

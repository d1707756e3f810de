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
from sysid.models.cell_arm import CellArm, Sway
from sysid.models.commands import Commands, twin_coordinates
from sysid.models.grip_lag import GripLag
from sysid.models.late_pose import LatePoses, on_time
from sysid.models.measurements import Channel, Measurements
from sysid.models.sensor_reading import SensorReading, at_sensor

#: Repeatability of a robot's own encoders within an episode, m and rad: below that of
#: the robot (0.1 mm, against an external frame), above their resolution.
POSE_NOISE = (2e-5, 1e-4)

#: What the twin misses of forces that were measured on the cell: a constant part [N],
#: of commands that come in pieces and a bolt that creeps in the pads, and a share of
#: the force's change in the step, of contacts that are made a moment sooner or later.
#: Measured on three logs of the cell with nothing hidden, so that 99 % of the rows are
#: within about three standard deviations (docs/physics.md, "Twin against cell").
FORCE_ERROR = (0.02, 0.15)

#: And of where the arm is [m], beyond what its encoders say: the twin's arm has six
#: axes instead of seven joints, and follows a change of rate a little differently (in
#: those logs by 10 um along y). It is no noise, so it counts twice.
POSITION_ERROR = 2e-5


@dataclasses.dataclass(frozen=True)
class Transitions:
    """Transitions of one or more episodes.

    Attributes:
        steps: measured state and command of each transition (rows,).
        before: (rows, 12) state at its beginning, the wrench at So in S.
        rows: (rows,) its number among all transitions of the episodes.
        episodes: whole ones, in the twin's coordinates, for poses that come late.
        commands: of whole episodes, since effects on the motion have a memory.
        lead: (rows,) by which the command is ahead on average [s].
        shift: (rows, 6) by which it is elsewhere.
        sway: (rows, 6) what moving loads the sensor with besides, at So in S.
        period: of the MDP [s].
        p_BoTo_B: (3,) of the twin's coordinates [m].
    """

    steps: Steps
    before: Array
    rows: NDArray[np.int64]
    episodes: "tuple[_Recorded, ...]"
    commands: tuple[Commands, ...]
    lead: Array
    shift: Array
    sway: Array
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
        twin = BoltCoordinates(p_BoTo_B)
        rates, grip = ArmRates.of(scenario), GripLag.of(scenario)
        recorded = tuple(_Recorded.of(e, rates, grip, twin) for e in episodes)
        steps = Steps.concatenated([each.steps() for each in recorded])
        arms = [CellArm.of(scenario, _station(log)) for log in logs]
        counts = [sum(e.rows - 1 for e in log.episodes) for log in logs]
        lead = np.repeat([arm.lead for arm in arms], counts)
        ends = np.cumsum(counts)[:-1]
        parts = (np.split(each, ends) for each in (steps.q, _begins(episodes)))
        shift = np.concatenate(
            [arm.shifts(*row) for arm, *row in zip(arms, *parts, strict=True)]
        )
        states = [at_sensor(observations(e)[:-1], sensing.X_SB) for e in episodes]
        sway = np.concatenate([_sway(log, scenario, sensing) for log in logs])
        before = np.concatenate(states)
        commands = tuple(Commands.of(e, period) for e in episodes)
        rows = np.arange(len(steps))
        found = cls(
            steps, before, rows, recorded, commands, lead, shift, sway, period, p_BoTo_B
        )
        return dataclasses.replace(found, steps=found._moved(steps.qd, steps.qd_rate))

    def select(self, mask: NDArray[np.bool_]) -> Self:
        """Returns the transitions where the mask (rows,) is true."""
        return dataclasses.replace(
            self,
            steps=self.steps.select(mask),
            before=self.before[mask],
            rows=self.rows[mask],
            lead=self.lead[mask],
            shift=self.shift[mask],
            sway=self.sway[mask],
        )

    def executed(
        self, effects: Sequence[MotionEffect], weights: Array
    ) -> tuple[Steps, LatePoses | None]:
        """Returns the steps as effects have them executed, and late poses, if any.

        Args:
            effects: on the motion, in the chain's order.
            weights: of poses in the one that is measured, see `pose_weights`.
        """
        is_late = len(weights) > 1
        if not effects and not is_late:
            return self.steps, None
        paths = [
            twin_coordinates(c.executed(effects), self.p_BoTo_B) for c in self.commands
        ]
        qd = np.concatenate([path[:-1] for path in paths])
        moved = np.concatenate([np.diff(path, axis=0) for path in paths])
        steps = self._moved(qd[self.rows], moved[self.rows] / self.period)
        if not is_late:
            return steps, None
        pairs = list(zip(self.episodes, paths, strict=True))
        went = [each.rates.path(path, each.wrench) for each, path in pairs]
        late = LatePoses.of(went, weights)
        pairs = list(zip(self.episodes, went, strict=True))
        begun = Steps.concatenated(
            [e.on_time(path, weights).steps() for e, path in pairs]
        )
        begun = begun.select(self.rows)
        return dataclasses.replace(steps, q=begun.q, v=begun.v), late

    def _moved(self, qd: Array, qd_rate: Array) -> Steps:
        """Returns the steps with commands (rows, 6) as the arm has them."""
        led = qd + self.lead[:, None] * qd_rate + self.shift
        return dataclasses.replace(self.steps, qd=led, qd_rate=qd_rate)

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
    found = Measurements.of_logs(
        logs,
        _channels(scenario),
        lambda _, episode: at_sensor(observations(episode)[1:], sensing.X_SB),
    )
    error = np.concatenate([_model_error(log, sensing) for log in logs])
    return dataclasses.replace(found, model_error=error) if error.any() else found


def _model_error(log: Log, sensing: SensorReading) -> Array:
    """Returns by how much the twin is off (rows, 12) in a log of an arm, 1 sigma.

    The force may be off to any side, and turns the sensor with the lever to the bolt.
    A log of the twin has none.
    """
    changes = [np.diff(observations(e)[:, 6:9], axis=0) for e in log.episodes]
    change = np.linalg.norm(np.concatenate(changes), axis=1)
    found = np.zeros((len(change), 12))
    if _station(log) not in ("cell", "hardware"):
        return found
    least, share = FORCE_ERROR
    force = np.hypot(least, share * change)
    lever = np.abs(sensing.X_SB.translation())
    across = np.sqrt(np.maximum(lever @ lever - lever**2, 0.0))
    found[:, :3] = POSITION_ERROR
    found[:, 6:9] = force[:, None]
    found[:, 9:] = force[:, None] * across
    return found


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


def _station(log: Log) -> str:
    """Returns where a log was recorded, as it says."""
    return str(log.header.provenance.get("station", ""))


def _sway(log: Log, scenario: Scenario, sensing: SensorReading) -> Array:
    """Returns what moving loads the sensor with (rows, 6), at So in S."""
    moves = Sway.of(scenario, _station(log))
    R_SB = sensing.X_SB.rotation().matrix()
    paths = [e["X_GB_commanded"][:, :3] for e in log.episodes]
    rates = [np.diff(path, axis=0) / scenario.task.period for path in paths]
    return np.concatenate([moves.wrenches(rate, R_SB) for rate in rates])


def _begins(episodes: Sequence[Episode]) -> Array:
    """Returns the measured wrench (rows, 6) at the begin of each step."""
    return np.concatenate([observations(e)[:-1, 6:] for e in episodes])


@dataclasses.dataclass(frozen=True)
class _Recorded:
    """An episode of n steps as it was recorded, in the twin's coordinates.

    Attributes:
        measured, commanded: (n + 1, 6) coordinates.
        wrench: (n + 1, 6) measured on the bolt at Bo in G.
        rates, grip: that tell what no encoder measures.
    """

    measured: Array
    commanded: Array
    wrench: Array
    rates: ArmRates
    grip: GripLag

    @classmethod
    def of(
        cls, episode: Episode, rates: ArmRates, grip: GripLag, twin: BoltCoordinates
    ) -> Self:
        """Returns a log's episode."""
        return cls(
            _coordinates(episode["X_GB_measured"], twin),
            _coordinates(episode["X_GB_commanded"], twin),
            observations(episode)[:, 6:],
            rates,
            grip,
        )

    def on_time(self, path: Array, weights: Array) -> Self:
        """Returns the episode with poses that do not come late: see `on_time`."""
        there = on_time(self.measured, path, weights)
        return dataclasses.replace(self, measured=there)

    def steps(self) -> Steps:
        """Returns its steps."""
        q, qd, wrench = self.measured, self.commanded, self.wrench
        v, elastic = np.zeros((len(q) - 1, 6)), np.array(wrench[:-1])
        for k in range(1, len(v)):
            last = np.s_[None, k - 1 : k + 1]
            v[k] = self.rates.after(v[None, k - 1], q[last], qd[last], wrench[last])
            elastic[k] = self.grip.after(elastic[None, k - 1], wrench[last])
        return Steps(
            np.arange(len(v)),
            q[:-1],
            v,
            qd[:-1],
            np.diff(qd, axis=0) / self.rates.step.h,
            elastic,
            self.grip.rates(elastic, wrench[:-1]),
        )


def _coordinates(poses: Array, twin: BoltCoordinates) -> Array:
    """Returns the twin's coordinates (n, 6) of poses (n, 7)."""
    return np.array([twin.solve(pose_from_vector(p), np.zeros(6)) for p in poses])

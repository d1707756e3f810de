"""Measured transitions of the task, as a twin replays and predicts them."""

import dataclasses
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.cell.tool import Tool
from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import MotionEffect, SensorEffect, SensorMemoryEffect
from drake_disasm.logs import Episode, Log
from drake_disasm.logs.refusal import refusal
from drake_disasm.logs.transitions import observations
from drake_disasm.mdp import STATE_NAMES
from drake_disasm.scenario import Scenario
from drake_disasm.twin.steps import Steps
from sysid.models.arm_rates import ArmRates
from sysid.models.base import Array
from sysid.models.cell_motion import lead, sway
from sysid.models.commands import Commands, twin_coordinates
from sysid.models.grip_state import GripState, of_encoders
from sysid.models.late_pose import LatePoses
from sysid.models.measured_episode import MeasuredEpisode
from sysid.models.measurements import Channel, Measurements
from sysid.models.rate_response import rate_changes
from sysid.models.sensor_reading import SensorReading, at_bolt, at_sensor, station_of
from sysid.models.undo_sensor_effects import undo_sensor_effects

#: Repeatability of a robot's own encoders within an episode, m and rad: below that of
#: the robot (0.1 mm, against an external frame), above their resolution.
POSE_NOISE = (2e-5, 1e-4)

#: What the twin misses of forces that were measured on the cell: a constant part [N],
#: of commands that come in pieces and a bolt that creeps in the pads, and a share of
#: the force's change in the step, of contacts that are made a moment sooner or later.
#: Measured on three logs of the cell with nothing hidden, so that 99 % of the rows are
#: within about three standard deviations (docs/explanation/physics.md).
FORCE_ERROR = (0.02, 0.15)

#: And of where the arm is [m, rad], beyond what its encoders say: its posture is taken
#: to first order, and it follows a change of rate a little differently. By 20 um, and a
#: hand that yields so far turns by 40 urad. It is no noise, so it counts twice.
#: Besides, the arm yields to what the force is off by.
POSE_ERROR = (2e-5, 4e-5)

#: Standard deviations of an average beyond which it is an offset: by chance three times
#: in a million logs of six channels.
_OFFSET = 5.0

_RELEASE = 2  # steps in which a part comes free

#: By how much the grip gives, so that a step begins noticeably elsewhere [m, rad]: a
#: tenth of what encoders repeat.
_NOTICEABLE = (0.1 * POSE_NOISE[0], 0.1 * POSE_NOISE[1])


@dataclasses.dataclass(frozen=True)
class Transitions:
    """Transitions of one or more episodes.

    Attributes:
        steps: measured state and command of each transition (rows,).
        before: (rows, 12) state at its beginning, the wrench at So in S.
        rows: (rows,) its number among all transitions of the episodes.
        recorded: whole episodes, in the twin's coordinates.
        logs: (episodes,) number of the log of each.
        at_begin: (logs, 6) what is taken for a load of each log's first readings, on
            average, at So in S; the rest is the sensor's own.
        episodes: the same, with the wrench as it was before effects on the sensor, and
            without its offset.
        commands: of whole episodes, since effects on the motion have a memory.
        sway: (rows, 6) what moving loads the sensor with besides, at So in S.
        rate_change: (rows, 6) of what is commanded, as a step begins: along and about
            the axes of G [m/s, rad/s].
        elsewhere: (rows, 6) by how much the bolt is elsewhere in the grip as a step
            begins, in coordinates.
        seen: (steps, 12) of all steps of the episodes, by how much the grip's springs
            carry another wrench than `GripState` says as they begin, and its rates.
        period: of the MDP [s].
        p_BoTo_B: (3,) of the twin's coordinates [m].
    """

    steps: Steps
    before: Array
    rows: NDArray[np.int64]
    recorded: tuple[MeasuredEpisode, ...]
    logs: NDArray[np.int64]
    at_begin: Array
    episodes: tuple[MeasuredEpisode, ...]
    commands: tuple[Commands, ...]
    sway: Array
    rate_change: Array
    elsewhere: Array
    seen: Array
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
        recorded = tuple(
            episode
            for log in logs
            for episode in _recorded(log, scenario, BoltCoordinates(p_BoTo_B))
        )
        noise = np.array([channel.noise for channel in _channels(scenario)][6:])
        at_begin = np.array([_load_at_begin(log, noise, sensing) for log in logs])
        sources = np.repeat(np.arange(len(logs)), [len(log.episodes) for log in logs])
        started = _without_offset(recorded, sources, at_begin, sensing, p_BoTo_B)
        steps = Steps.concatenated([each.steps() for each in started])
        found = cls(
            steps=steps,
            before=np.concatenate(
                [at_sensor(observations(e)[:-1], sensing.mounting) for e in episodes]
            ),
            rows=np.arange(len(steps)),
            recorded=recorded,
            logs=sources,
            at_begin=at_begin,
            episodes=started,
            commands=tuple(Commands.of(e, period) for e in episodes),
            sway=np.concatenate([_sway(log, scenario, sensing) for log in logs]),
            rate_change=np.concatenate([rate_changes(e, period) for e in episodes]),
            elsewhere=np.concatenate([each.elsewhere[:-1] for each in started]),
            seen=np.zeros((len(steps), 12)),
            period=period,
            p_BoTo_B=p_BoTo_B,
        )
        return dataclasses.replace(found, steps=found._moved(steps.qd, steps.qd_rate))

    def without_effects(
        self, effects: Sequence[SensorEffect], sensing: SensorReading
    ) -> Self:
        """Returns the transitions as they begin where effects on the sensor are undone.

        By how much the grip gives as a step begins is known from the measured wrench,
        but not as an episode begins: an offset is an offset. These transitions, if none
        begins noticeably elsewhere.

        Args:
            effects: in the chain's order; those with a memory are not undone, since
                that would amplify noise.
            sensing: of the scenario.
        """
        known = [e for e in effects if not isinstance(e, SensorMemoryEffect)]
        before = undo_sensor_effects(self.recorded, known, sensing, self.p_BoTo_B)
        episodes = _without_offset(
            before, self.logs, self.at_begin, sensing, self.p_BoTo_B
        )
        pairs = zip(episodes, self.episodes, strict=True)
        if not any(one.begins_elsewhere(other, _NOTICEABLE) for one, other in pairs):
            return self
        return self._of(episodes)

    def with_loads(self, states: Array, sensing: SensorReading) -> Self:
        """Returns the transitions as they begin under other loads than were read.

        Args:
            states: (steps, 12) as all steps of the episodes begin, the wrench at So in
                S, without effects and offset.
            sensing: of the scenario.
        """
        wrench = at_bolt(states, sensing.mounting)[:, 6:]
        parts = np.split(wrench, self._ends)
        return self._of(
            tuple(
                dataclasses.replace(
                    episode, wrench=np.vstack([own, episode.wrench[-1]])
                )
                for episode, own in zip(self.episodes, parts, strict=True)
            )
        )

    def _of(self, episodes: tuple[MeasuredEpisode, ...]) -> Self:
        """Returns the transitions of the same episodes under other loads."""
        steps = Steps.concatenated([e.steps() for e in episodes])
        steps = dataclasses.replace(
            steps,
            wrench=steps.wrench + self.seen[:, :6],
            give_rate=steps.give_rate + self.seen[:, 6:],
        )
        elsewhere = np.concatenate([each.elsewhere[:-1] for each in episodes])
        found = dataclasses.replace(
            self,
            steps=steps.select(self.rows),
            episodes=episodes,
            elsewhere=elsewhere[self.rows],
        )
        return dataclasses.replace(found, steps=found._moved(steps.qd, steps.qd_rate))

    def beginning(self, rows: NDArray[np.int64], elastic: Array, rates: Array) -> Self:
        """Returns all transitions, some of which begin with another give of the grip.

        Args:
            rows: (n,) their numbers; these are all transitions.
            elastic: (n, 6) wrench that the springs carry, on the bolt at Bo in Gn.
            rates: (n, 6) of the bolt against the arm.
        """
        wrench, give_rate = self.steps.wrench.copy(), self.steps.give_rate.copy()
        wrench[rows], give_rate[rows] = elastic, rates
        more = np.hstack([wrench - self.steps.wrench, give_rate - self.steps.give_rate])
        steps = dataclasses.replace(self.steps, wrench=wrench, give_rate=give_rate)
        return dataclasses.replace(self, steps=steps, seen=self.seen + more)

    @property
    def wrench(self) -> Array:
        """Measured on the bolt at Bo in G (steps, 6) as all steps begin."""
        return np.concatenate([each.wrench[:-1] for each in self.episodes])

    def most_give(self) -> float:
        """Returns by how much the grip gives within a step, at most [m]."""
        give = self.episodes[0].grip.deflections(self.steps.wrench)[:, :3]
        follows = (np.diff(self.rows) == 1) & (self.steps.index[1:] > 0)
        change = np.linalg.norm(np.diff(give, axis=0)[follows], axis=1)
        return float(change.max(initial=0.0))

    def read(self, sensing: SensorReading) -> Array:
        """Returns the states (steps, 12) as all steps of the episodes begin.

        The wrench is at So in S, without effects and offset.
        """
        states = [e.at_sensor(sensing, self.p_BoTo_B)[:-1] for e in self.episodes]
        return np.concatenate(states)

    def select(self, mask: NDArray[np.bool_] | NDArray[np.int64]) -> Self:
        """Returns the transitions of a mask (rows,), or of some rows."""
        return dataclasses.replace(
            self,
            steps=self.steps.select(mask),
            before=self.before[mask],
            rows=self.rows[mask],
            sway=self.sway[mask],
            rate_change=self.rate_change[mask],
            elsewhere=self.elsewhere[mask],
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
        steps = self._moved(qd, moved / self.period)
        pairs = list(zip(self.episodes, paths, strict=True))
        if not is_late:
            v = np.concatenate([each.begin_rates(path) for each, path in pairs])
            return dataclasses.replace(steps, v=v[self.rows]), None
        went = [each.rates.path(path, each.wrench) for each, path in pairs]
        late = LatePoses.of(went, weights)
        pairs = list(zip(self.episodes, went, strict=True))
        on_time = Steps.concatenated(
            [e.on_time(path, weights).steps() for e, path in pairs]
        ).select(self.rows)
        return dataclasses.replace(steps, q=on_time.q, v=on_time.v), late

    def _moved(self, qd: Array, qd_rate: Array) -> Steps:
        """Returns the steps with commands as the arm has them.

        Args:
            qd, qd_rate: (n, 6) commanded in all steps of the episodes.
        """
        rates = np.split(qd_rate, self._ends)
        pairs = zip(self.episodes, rates, strict=True)
        moved = qd + np.concatenate([each.ahead(own) for each, own in pairs])
        return dataclasses.replace(
            self.steps, qd=moved[self.rows], qd_rate=qd_rate[self.rows]
        )

    @property
    def _ends(self) -> NDArray[np.int64]:
        """Numbers of the steps that follow an episode's last, but the last of all."""
        lengths = [len(each.wrench) - 1 for each in self.episodes]
        return np.asarray(np.cumsum(lengths)[:-1])

    def of_encoders(
        self, states: Array, steps: Steps, rows: slice, moves: Array
    ) -> Array:
        """Returns the states (n, 12) after some steps as encoders have them.

        Args:
            states: of the twin, the wrench at Bo in G.
            steps: the transitions' steps, as they are executed.
            rows: which of them.
            moves: (n, 6) by how much the arm is elsewhere for its posture.
        """
        elsewhere = self.elsewhere[rows] - moves
        if not elsewhere.any():
            return states
        return of_encoders(states, steps.q[rows] - elsewhere, elsewhere, self.p_BoTo_B)

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
        lambda _, episode: at_sensor(observations(episode)[1:], sensing.mounting),
    )
    head = scenario.part.touch_radius
    twin = twin_of(scenario)
    yields = np.linalg.inv(twin.arm.at(-twin.p_BoTo_B).K)[:, :3]
    errors = [_model_error(log, sensing, head, yields) for log in logs]
    error = np.concatenate(errors)
    return dataclasses.replace(found, model_error=error) if error.any() else found


def _model_error(log: Log, sensing: SensorReading, head: float, yields: Array) -> Array:
    """Returns by how much the twin is off (rows, 12) in a log of an arm, 1 sigma.

    The force may be off to any side, and turns the sensor with the lever to the bolt,
    on whose head it acts anywhere; where a part comes free, by the whole load. The arm
    yields to it. A log of the twin has none.

    Args:
        log: of transitions.
        sensing: of the scenario.
        head: the head's radius [m].
        yields: (6, 3) pose of the arm by a force on the bolt at Bo, in G.
    """
    changes = [np.diff(observations(e)[:, 6:9], axis=0) for e in log.episodes]
    change = np.linalg.norm(np.concatenate(changes), axis=1)
    found = np.zeros((len(change), 12))
    if station_of(log) not in ("cell", "hardware"):
        return found
    least, share = FORCE_ERROR
    force = np.hypot(least, share * change)
    lever = np.abs(sensing.p_SoBo_S)
    across = np.sqrt(np.maximum(lever @ lever - lever**2, 0.0) + head**2)
    of_force = force[:, None] * np.linalg.norm(yields, axis=1)
    found[:, :6] = np.hypot(np.repeat(POSE_ERROR, 3), of_force)
    found[:, 6:9] = force[:, None]
    found[:, 9:] = force[:, None] * across
    lost = [_lost_at_the_end(episode, sensing) for episode in log.episodes]
    return np.hypot(found, np.concatenate(lost))


def _lost_at_the_end(episode: Episode, sensing: SensorReading) -> Array:
    """Returns what a part that comes free may be off by (n, 12); elsewhere zero.

    That ends an episode. In which of the last two steps contact is lost, a moment
    decides: the whole load, and how far the arm springs back, beyond its motion in the
    step before.

    Args:
        episode: of a log.
        sensing: of the scenario: a lever turns the sensor.
    """
    states = at_sensor(observations(episode), sensing.mounting)
    lost = np.zeros((len(states) - 1, 12))
    force, torque = _lengths(states[-_RELEASE - 1 :, 6:])
    has_ended = bool(episode["terminated"][-1]) and len(lost) > _RELEASE
    if not has_ended or force[-1] >= force[0]:  # or by a limit
        return lost
    moved = np.diff(states[-_RELEASE - 2 :, :6], axis=0)
    way, turn = _lengths(moved[1:] - moved[0])
    lost[-_RELEASE:] = np.repeat([way.max(), turn.max(), force[0], torque[0]], 3)
    return lost


def _lengths(pairs: Array) -> tuple[Array, Array]:
    """Returns the lengths (n,) of both vectors of pairs (n, 6)."""
    first, second = np.hsplit(pairs, 2)
    return np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)


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
            "name a log that `drake-disasm simulate` or the cell wrote",
        )
    period = log.header.period
    if period is None or abs(period - scenario.task.period) > 1e-9:
        raise refusal(
            where,
            f"period {period} s, the scenario has task.period {scenario.task.period} s",
            "give the scenario that was recorded, or change its task.period",
        )


def _load_at_begin(log: Log, noise: Array, sensing: SensorReading) -> Array:
    """Returns what may be a load of an episode's first reading (6,), at So in S.

    Each episode begins without one: what its first reading is beyond chance, on average
    over the log's episodes, is an offset of the sensor, which moves no bolt. What is
    within chance is taken for a load: the noise of a reading moves the bolt as far.

    Args:
        log: of transitions.
        noise: (6,) of a reading.
        sensing: of the scenario.
    """
    states = np.array([observations(episode)[0] for episode in log.episodes])
    first = np.mean(at_sensor(states, sensing.mounting)[:, 6:], axis=0)
    by_chance = _OFFSET * noise / np.sqrt(len(states))
    return np.where(np.abs(first) > by_chance, 0.0, first)


def _without_offset(
    episodes: Sequence[MeasuredEpisode],
    logs: NDArray[np.int64],
    at_begin: Array,
    sensing: SensorReading,
    p_BoTo_B: Array,
) -> tuple[MeasuredEpisode, ...]:
    """Returns the episodes without the offset of the sensor in their log.

    Args:
        episodes: with the wrench as it was measured.
        logs, at_begin: see `Transitions`.
        sensing: of the scenario.
        p_BoTo_B: (3,) of the twin's coordinates [m].
    """
    first = np.array([e.at_sensor(sensing, p_BoTo_B)[0, 6:] for e in episodes])
    means = [first[logs == log].mean(axis=0) for log in range(len(at_begin))]
    offsets = np.array(means) - at_begin
    return tuple(
        episode.without(offsets[log], sensing, p_BoTo_B)
        for episode, log in zip(episodes, logs, strict=True)
    )


def _sway(log: Log, scenario: Scenario, sensing: SensorReading) -> Array:
    """Returns what moving loads the sensor with (rows, 6), at So in S."""
    station = station_of(log)
    R_SB = sensing.mounting.X_BS.R.T
    paths = [e["X_GB_commanded"][:, :3] for e in log.episodes]
    rates = [np.diff(path, axis=0) / scenario.task.period for path in paths]
    return np.concatenate([sway(scenario, station, rate, R_SB) for rate in rates])


def _recorded(
    log: Log, scenario: Scenario, twin: BoltCoordinates
) -> list[MeasuredEpisode]:
    """Returns the episodes of a log, in the twin's coordinates."""
    station = station_of(log)
    given = ArmRates.of(scenario), GripState.of(scenario, station)
    ahead = lead(scenario, station)
    return [MeasuredEpisode.of(e, *given, ahead, twin) for e in log.episodes]

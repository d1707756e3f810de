"""The digital twin as a model of measured transitions (thesis, eq. 4.8)."""

import dataclasses
from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.cell.tool import Tool
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.spatial import pose_from_vector
from drake_disasm.effects import (
    ContactExponent,
    Effect,
    EnvironmentEffect,
    MotionEffect,
    SensorEffect,
    motion_chain,
    sensor_chain,
)
from drake_disasm.logs import Episode, Log
from drake_disasm.logs.refusal import refusal
from drake_disasm.logs.transitions import observations
from drake_disasm.mdp import STATE_NAMES
from drake_disasm.scenario import Scenario
from drake_disasm.task.impact_replay import ImpactReplay
from drake_disasm.task.replay import Steps, TwinReplay
from sysid.models.base import (
    Array,
    PredictionError,
    ScenarioModel,
    even_chunks,
)
from sysid.models.commands import Commands, twin_coordinates
from sysid.models.measurements import Channel, Measurements
from sysid.models.sensor_reading import SensorReading, at_sensor
from sysid.parameters import Parameter

#: How well a robot's own encoders repeat within an episode, m and rad: below its
#: repeatability (0.1 mm, against an outside frame), above their resolution.
POSE_NOISE = (2e-5, 1e-4)

_FRICTION = "contact.friction"  # which both kinds of contact have
_CHUNK = 32  # transitions: a tenth of a second of work
_IMPACT_CHUNK = 512  # large enough for arrays, small enough to share


class TwinModel(ScenarioModel):
    """The twin replays measured commands; its next states are compared.

    Channels are the bolt's pose in G (x, y, z, u, v, w) and the processed wrench,
    taken back to the sensor's origin and axes (fx ... tz), where the noise of the
    six channels is independent. Shifted to the bolt, force noise times the lever
    would be in the torques, too.

    With `rollout` false, each transition is simulated from its *measured* previous
    state (eq. 4.8). With `rollout` true an episode is simulated whole from its first
    state, and each of its states is compared: errors add up there, so effects too
    small for one step show.
    """

    effect_types = (EnvironmentEffect, MotionEffect, SensorEffect)
    held_out_share = 0.25
    has_commands = True

    def __init__(
        self,
        logs: Sequence[Log],
        scenario: Scenario,
        parameters: Sequence[Parameter],
        rollout: bool = False,
        coarse: bool = True,
    ) -> None:
        """Takes the steps out of the logs.

        Args:
            logs: of transitions.
            scenario: what the twin is at the parameters' nominal values.
            parameters: paths in that scenario.
            rollout: whether episodes are simulated whole.
            coarse: whether a transition may begin in coarse steps (`TwinReplay`).

        Raises:
            DisasmError: a log is of another kind or period.
        """
        self.parameters = tuple(parameters)
        self.scenario, self.rollout, self.coarse = scenario, rollout, coarse
        tool = Tool.from_models(scenario)
        self._X_SB = tool.X_SB
        for log in logs:
            _refuse_other_logs(log, scenario)
        episodes = [episode for log in logs for episode in log.episodes]
        period = scenario.task.period
        self._commands = [Commands.of(e, period) for e in episodes]
        self._readings = [at_sensor(observations(e), self._X_SB) for e in episodes]
        self.steps = _concatenated([_steps(e, scenario) for e in episodes])
        self._rows = np.arange(len(self.steps))
        self.measurements = Measurements.of_logs(
            logs,
            _channels(scenario),
            lambda _, episode: at_sensor(observations(episode)[1:], self._X_SB),
        )
        self._sensing = SensorReading(scenario, tool)
        self._replay: TwinReplay | ImpactReplay | None = None
        self._simulated: bytes | None = None
        self._moved: tuple[str, Steps] | None = None
        self._displacement: Array | None = None

    def predict(self, theta: Array, rows: slice) -> Array:
        """See LogModel."""
        return self.read(theta, rows, self.simulate(theta, rows))

    def simulate(self, theta: Array, rows: slice) -> Array:
        """Returns the states, the wrench at the sensor, and the reading at zeroing.

        (len(rows), 18), as the sensor would read them without effects.
        """
        scenario = self.scenario_at(theta)
        try:
            replay = self._replay_at(theta, scenario)
            steps = self._steps_of(_mean_chain(scenario)).select(rows)
            if self._displacement is not None:
                rate = self._displacement[rows] / self.scenario.task.period
                steps = _faster(steps, rate)
            states = at_sensor(self._states(replay, steps), self._X_SB)
        except (RuntimeError, DisasmError, ValueError) as error:
            self._replay = self._simulated = None
            text = " ".join(str(error).split())
            raise PredictionError(text) from None
        zero = np.broadcast_to(replay.reading_at_zeroing, (len(states), 6))
        return np.hstack([states, zero])

    def read(self, theta: Array, rows: slice, simulated: Array) -> Array:
        """Returns the states as the sensor's effects let them be read."""
        effects = sensor_chain(self.scenario_at(theta).effects)
        states, zero = simulated[:, :12], simulated[0, 12:]
        if not effects:
            return states
        times = (self.steps.index[rows] + 1) * self.scenario.task.period
        return self._sensing.read(effects, states, zero, times)

    @property
    def simulated(self) -> NDArray[np.bool_]:
        """All parameters but those of the sensor's effects."""
        paths = [parameter.path.split(".") for parameter in self.parameters]
        return np.array(
            [
                part[0] != "effects"
                or not isinstance(self.scenario.effects[int(part[1])], SensorEffect)
                for part in paths
            ],
            dtype=bool,
        )

    @property
    def costly(self) -> bool:
        """See LogModel."""
        return not self._has_impact

    def applicable_effects(self, library: Sequence[type[Effect]]) -> list[Effect]:
        """See LogModel; IMPACT alone has an exponent."""
        acting = [k for k in library if self._has_impact or k is not ContactExponent]
        return super().applicable_effects(acting)

    def surrogate(self) -> Self:
        """See LogModel: IMPACT, where all parameters mean the same to it."""
        paths = [parameter.path for parameter in self.parameters]
        own = [p for p in paths if p.startswith("contact.") and p != _FRICTION]
        if self._has_impact or self.rollout or own:
            return self
        contact = dataclasses.replace(self.scenario.contact, model="impact")
        return self.replace(
            scenario=dataclasses.replace(self.scenario, contact=contact)
        )

    def displaced(self, displacement: Array) -> Self:
        """See LogModel."""
        return self.replace(_displacement=displacement)

    def covariates(self, channel: int) -> dict[str, Array]:
        """See LogModel: time, place, action and force at the beginning of a step."""
        steps, rows = self.steps, self._rows
        before = np.concatenate([r[:-1] for r in self._readings])[rows]
        found = {
            "time": steps.index * self.scenario.task.period,
            "order of steps": rows.astype(float),
            "travel x": steps.q[:, 0],
            "position z": steps.q[:, 2],
            "commanded rate along x": steps.qd_rate[:, 0],
            "commanded rate along z": steps.qd_rate[:, 2],
        }
        forces = {f"force along {a}_S": before[:, 6 + i] for i, a in enumerate("xyz")}
        return found | forces

    def _steps_of(self, effects: Sequence[MotionEffect]) -> Steps:
        """Returns the steps as effects on the motion would have them executed."""
        if not effects:
            return self.steps
        if self._moved is None or self._moved[0] != repr(effects):
            paths = [twin_coordinates(c.executed(effects)) for c in self._commands]
            period = self.scenario.task.period
            steps = dataclasses.replace(
                self.steps,
                qd=np.concatenate([p[:-1] for p in paths])[self._rows],
                qd_rate=np.concatenate([np.diff(p, axis=0) for p in paths])[self._rows]
                / period,
            )
            self._moved = (repr(effects), steps)
        return self._moved[1]

    def chunks(self) -> list[slice]:
        """See LogModel; a rollout can't be cut within an episode."""
        if not self.rollout:
            size = _IMPACT_CHUNK if self._has_impact else _CHUNK
            return even_chunks(self.measurements.rows, size)
        starts = np.flatnonzero(np.diff(self.measurements.episode, prepend=-1))
        ends = [*starts[1:], self.measurements.rows]
        return [slice(int(a), int(b)) for a, b in zip(starts, ends, strict=True)]

    def first(self, rows: int) -> Self:
        """Returns the same model of the first transitions alone."""
        return self.of_rows(np.arange(self.measurements.rows) < rows)

    def thin(self, every: int) -> Self:
        """See LogModel; a rollout keeps every n-th episode."""
        rows = np.arange(self.measurements.rows)
        of = self.measurements.episode if self.rollout else rows
        return self.of_rows(of % every == 0)

    def select_rows(self, mask: NDArray[np.bool_]) -> Self:
        """See LogModel."""
        return self.replace(steps=self.steps.select(mask), _rows=self._rows[mask])

    def _replay_at(self, theta: Array, scenario: Scenario) -> TwinReplay | ImpactReplay:
        """Returns the twin at parameters (p,); a change takes some 10 ms."""
        key = theta[self.simulated].tobytes()
        if self._replay is None:
            self._replay = self._new_replay(_environment_alone(scenario))
        elif self._simulated != key:
            self._replay.reconfigure(_environment_alone(scenario))
        self._simulated = key
        return self._replay

    def _new_replay(self, scenario: Scenario) -> TwinReplay | ImpactReplay:
        if self.rollout:
            return TwinReplay(scenario)
        kind = ImpactReplay if self._has_impact else TwinReplay
        return kind(scenario, self.coarse)

    @property
    def _has_impact(self) -> bool:
        return self.scenario.contact.model == "impact"

    def _states(self, replay: TwinReplay | ImpactReplay, steps: Steps) -> Array:
        """Returns the states (len(steps), 12) after each step."""
        if isinstance(replay, ImpactReplay) or not self.rollout:
            return replay.transitions(steps)
        return replay.episode(steps)

    def __getstate__(self) -> dict[str, Any]:
        """Leaves the diagram out: each worker builds its own."""
        return self.__dict__ | {"_replay": None, "_simulated": None, "_moved": None}


def _mean_chain(scenario: Scenario) -> tuple[MotionEffect, ...]:
    """Returns the effects on the motion that a prediction can follow."""
    return tuple(e for e in motion_chain(scenario.effects) if not e.is_random)


def _faster(steps: Steps, rate: Array) -> Steps:
    """Returns steps that go faster by rates (n, 3) [m/s]."""
    more = np.hstack([rate, np.zeros_like(rate)])
    return dataclasses.replace(steps, qd_rate=steps.qd_rate + more)


def _environment_alone(scenario: Scenario) -> Scenario:
    """Returns a scenario with those effects alone that a replay simulates."""
    effects: list[Any] = [
        e for e in scenario.effects if isinstance(e, EnvironmentEffect)
    ]
    return dataclasses.replace(scenario, effects=effects)


def _channels(scenario: Scenario) -> tuple[Channel, ...]:
    units = ["m"] * 3 + ["rad"] * 3 + ["N"] * 3 + ["N m"] * 3
    sensor = scenario.ft_sensor
    counts = np.array(sensor.quantum) / np.sqrt(12.0)
    wrench = np.hypot(sensor.noise, counts)
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


def _steps(episode: Episode, scenario: Scenario) -> Steps:
    measured = _coordinates(episode["X_GB_measured"])
    commanded = _coordinates(episode["X_GB_commanded"])
    period = scenario.task.period
    rates = np.diff(measured, axis=0) / period
    return Steps(
        np.arange(episode.rows - 1),
        measured[:-1],
        np.vstack([np.zeros((1, 6)), rates[:-1]]),
        commanded[:-1],
        np.diff(commanded, axis=0) / period,
    )


def _coordinates(poses: Array) -> Array:
    """Returns the twin's coordinates (n, 6) of poses (n, 7)."""
    twin = BoltCoordinates()
    return np.array([twin.solve(pose_from_vector(p), np.zeros(6)) for p in poses])


def _concatenated(parts: Sequence[Steps]) -> Steps:
    return Steps(
        *(
            np.concatenate([getattr(part, f.name) for part in parts])
            for f in dataclasses.fields(Steps)
        )
    )

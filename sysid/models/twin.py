"""The digital twin as a model of measured transitions (thesis, eq. 4.8)."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from drake_disasm.effects import (
    Effect,
    EnvironmentEffect,
    MotionEffect,
    PoseEffect,
    Reach,
    SensorEffect,
    SensorMemoryEffect,
    SensorResidualModel,
    motion_chain,
    pose_weights,
    reported_poses,
    sensor_chain,
)
from drake_disasm.logs import Log
from drake_disasm.logs.schema import WRENCH
from drake_disasm.scenario import Scenario, with_values
from drake_disasm.scenario.names import find_field
from drake_disasm.twin.contact_step import NO_BALANCE
from drake_disasm.twin.steps import Steps
from sysid.models.arm_posture import ArmPosture
from sysid.models.base import Array, PredictionError, even_chunks
from sysid.models.bookkeeping import Frame
from sysid.models.commands import bolt_path, twin_coordinates
from sysid.models.grip_observer import GripObserver, Led
from sysid.models.late_pose import LatePoses
from sysid.models.measurements import Measurements
from sysid.models.rate_response import RateResponse
from sysid.models.replays import DiagramReplays, ImpactReplays, Replayed
from sysid.models.sensor_reading import SensorReading, at_bolt, at_sensor
from sysid.models.simulated_model import FAILURES, SimulatedModel
from sysid.models.transitions import Transitions, measured_states
from sysid.models.validity import Validity
from sysid.parameters import Parameter

_FRICTION = "contact.friction"  # which both kinds of contact have
_CHUNK = 32  # transitions: a tenth of a second of work
_IMPACT_CHUNK = 512  # large enough for arrays, small enough to share
_IMPACT_BATCH = 4096  # with more an array operation hardly gets faster
_N_PER_MM = 1e-3  # of N/m
_DRAWS = 4  # of where steps begin: a standard deviation is then known to a third
_PASSES = 4  # but the first of those steps alone whose begin has surely changed
_KEPT = 64  # steps of that many parameter sets
_T = TypeVar("_T")
#: By which the contact's stiffness may be off, as a share. It is, by 1 to 8 % in four
#: logs of a bolt that wedges on the cell, and in all of their rows alike: three times
#: as much, as an error of each row.
_STIFFNESS_ERROR = 0.2
_RUN = 6  # rows that follow each other in a thinned log: 0.6 s


class TwinModel(SimulatedModel):
    """The twin replays measured commands; the states that follow are compared.

    Channels are the bolt's pose in G (x, y, z, u, v, w) and the processed wrench,
    taken back to the sensor's origin and axes (fx ... tz), where the noise of the
    six channels is independent. Shifted to the bolt, force noise times the lever
    would be in the torques, too.

    With `rollout` false, each transition is simulated from its *measured* previous
    state (eq. 4.8). With `rollout` true an episode is simulated whole from its first
    state, and each of its states is compared: errors add up there, so effects too
    small for one step show.
    """

    effect_types = (EnvironmentEffect, MotionEffect, PoseEffect, SensorEffect)
    residual_effect = SensorResidualModel
    held_out_share = 0.25
    setting = "task"

    def __init__(
        self,
        logs: Sequence[Log],
        scenario: Scenario,
        parameters: Sequence[Parameter],
        rollout: bool = False,
    ) -> None:
        """Takes the steps out of the logs.

        Args:
            logs: of transitions.
            scenario: of the twin, at the parameters' nominal values.
            parameters: paths in that scenario.
            rollout: whether episodes are simulated whole.

        Raises:
            DisasmError: a log is of another kind or period.
        """
        self.parameters = tuple(parameters)
        self.scenario, self.rollout = scenario, rollout
        self.reading = SensorReading.of(logs, scenario)
        self._response = RateResponse.of(scenario, self.reading.station)
        self._posture = ArmPosture.of(scenario)
        recorded = Transitions.of(logs, scenario, self.reading)
        effects = sensor_chain(scenario.effects)
        self._whole = self._transitions = recorded.without_effects(
            effects, self.reading
        )
        self.measurements = measured_states(logs, scenario, self.reading)
        self._begins_vary = False  # with parameters of effects on the sensor
        self._displacement: Array | None = None  # (rows, 2, 3) of begin and end
        self._transitions_by_sensor: dict[str, Transitions] = {}
        self._executed: dict[str, tuple[Steps, LatePoses | None]] = {}
        self.measurements = self._with_contact_error(self.measurements)

    def _with_contact_error(self, measured: Measurements) -> Measurements:
        """Returns what was measured, with what hangs on how stiff contact is.

        That is known about; it matters where a bolt wedges, to which the grip yields
        less than contact does. Whether it does, the poses tell: a sensor may lie. Not
        of whole episodes, nor where it is a parameter.
        """
        model, error = self.replace(parameters=()).surrogate(), measured.model_error
        own = any(each.path.startswith("contact.impact") for each in self.parameters)
        if error is None or own or model.rollout or model.costly:
            return measured
        scenario, name = model.scenario, "contact.impact.stiffness"
        shares = 1.0 + _STIFFNESS_ERROR * np.array([-1.0, 1.0])
        about = (scenario.contact.impact.stiffness * shares).tolist()
        try:
            model = model._led_without_sensor()
            soft, stiff = (
                model.replace(scenario=with_values(scenario, {name: k})).predictions(
                    np.zeros(0)
                )
                for k in about
            )
        except FAILURES:
            return measured
        error = np.hypot(error, 0.5 * (stiff - soft))
        return dataclasses.replace(measured, model_error=error)

    def _simulated(self, thetas: Array, rows: slice) -> list[Array | str]:
        """Returns the states, the wrench at the sensor, and the reading at zeroing.

        (len(rows), 18) of each parameter set, as the sensor would read them without
        effects; or that contact finds no balance.
        """
        found = [
            self._at_sensor_and_zero(*own, rows) for own in self._led(thetas, rows)
        ]
        return [each if np.isfinite(each).all() else NO_BALANCE for each in found]

    def _led(
        self, thetas: Array, rows: slice
    ) -> list[tuple[Replayed, Transitions, Steps]]:
        """Returns where steps lead, how they begin, and the steps, of sets (k, p)."""
        scenarios = [self.scenario_at(theta) for theta in thetas]
        executed = [self._executed_at(scenario) for scenario in scenarios]
        steps = [self._displaced(own.select(rows), rows) for own, _ in executed]
        replays = self._replays_at(scenarios)
        found = replays.transitions(steps)
        transitions = [self._transitions_at(scenario) for scenario in scenarios]
        went = [own for own, _ in executed]
        return list(zip(found, transitions, went, strict=True))

    def _at_sensor_and_zero(
        self, found: Replayed, transitions: Transitions, steps: Steps, rows: slice
    ) -> Array:
        """Returns the states and the reading at zeroing (len(rows), 18)."""
        own, went = self._transitions, steps.select(rows)
        states = found.states
        if self.reading.station in ("cell", "hardware"):
            load = 0.5 * (went.wrench + states[:, 6:])
            moves = self._posture.moves(went, own.before[rows], load)
            states = transitions.of_encoders(states, steps, rows, moves)
        states = at_sensor(states, self.reading.mounting)
        states[:, :6] += own.rate_change[rows] @ self._response.lag
        states[:, 6:] += own.sway[rows]
        zero = self.reading.zeroed(found.reading_at_zeroing)
        return np.hstack([states, np.broadcast_to(zero, (len(states), 6))])

    def read(self, theta: Array, rows: slice, simulated: Array) -> Array:
        """Returns the states (len(rows), 12), wrench and pose read through effects."""
        scenario = self.scenario_at(theta)
        effects = sensor_chain(scenario.effects)
        states, zero = simulated[:, :12], simulated[0, 12:]
        if effects:
            times, between = self._times[rows], self._between(theta, rows)
            states = self.reading.read(effects, states, zero, times, between)
        steps, late = self._executed_at(scenario)
        if late is None:
            return states
        poses = self._reported(scenario, states, steps, late, rows)
        return self.reading.reported(states, poses)

    def residual_inputs(self, theta: Array) -> dict[str, Array]:
        """See LogModel: of readings before zeroing is taken off."""
        rows = slice(0, self.measurements.rows)
        simulated = np.concatenate([self.simulate(theta, c) for c in self.chunks()])
        states = self.read(theta, rows, simulated)
        raw = self.reading.raw(states, simulated[0, 12:])
        sensing = self.reading.sensing(states, self._times)
        inputs: Array = SensorResidualModel.inputs_of(raw, sensing)
        return dict.fromkeys(WRENCH, inputs)

    def _between(self, theta: Array, rows: slice) -> Array | None:
        """Returns what moving loads the sensor with on the way through each step.

        See `sensed_along`; None where nobody remembers it.
        """
        if not _with_memory(self.scenario_at(theta)):
            return None
        change, times = self._transitions.rate_change[rows], self._times[rows]
        follows = np.diff(times, prepend=0.0) < 1.5 * self._transitions.period
        swing = self._response.swing
        found: Array = np.einsum("na,abj->nbj", change * follows[:, None], swing)
        return found

    @property
    def _times(self) -> Array:
        """When each step ends (rows,) [s], since its episode began."""
        return (self._transitions.steps.index + 1) * self._transitions.period

    @property
    def simulated(self) -> NDArray[np.bool_]:
        """All parameters but those of the sensor's effects, unless begins vary."""
        paths = [parameter.path.split(".") for parameter in self.parameters]
        return np.array(
            [
                part[0] != "effects"
                or self._begins_vary
                or not isinstance(self.scenario.effects[int(part[1])], SensorEffect)
                for part in paths
            ],
            dtype=bool,
        )

    @property
    def reach(self) -> Reach:
        """See LogModel."""
        steps = self._transitions.steps
        duration = (steps.index.max() + 1) * self._transitions.period
        speed = np.linalg.norm(steps.qd_rate[:, :3], axis=1).max()
        return Reach(float(duration), float(np.ptp(steps.q[:, 0])), float(speed))

    @property
    def costly(self) -> bool:
        """See LogModel."""
        return not self._has_impact

    def applicable_effects(self, library: Sequence[type[Effect]]) -> list[Effect]:
        """See LogModel; some act in one model of contact, or on one part, alone."""
        contact = self.scenario.contact.model
        part = type(self.scenario.part).__name__
        acting = [
            kind
            for kind in library
            if not issubclass(kind, EnvironmentEffect)
            or (contact in kind.contact_models and kind.of_part in ("", part))
        ]
        return super().applicable_effects(acting)

    def surrogate(self) -> Self:
        """See LogModel: IMPACT, where it has all parameters, with the same meaning."""
        paths = [parameter.path for parameter in self.parameters]
        own = [p for p in paths if p.startswith("contact.") and p != _FRICTION]
        if self._has_impact or self.rollout or own or self.scenario.part.gaps is None:
            return self
        return self.replace(scenario=with_impact_as_stiff(self.scenario))

    def with_begins(self, theta: Array | None) -> Self:
        """See LogModel: steps begin where the wrench says, without sensor effects.

        And where the model has the grip at the end of the step before: `GripObserver`.
        """
        if theta is None:
            return self.replace(_begins_vary=True)
        effects = sensor_chain(self.scenario_at(theta).effects)
        whole = self._whole.without_effects(effects, self.reading)
        if not self.rollout:
            try:
                whole = self._observed(theta, whole)
            except FAILURES:  # steps begin as the wrench says
                return self
        if whole is self._whole:
            return self
        own = whole.select(self._transitions.rows)
        return self.replace(_whole=whole, _transitions=own)

    def validity(self, theta: Array) -> Validity | None:
        """See LogModel: how far predictions depend on how the grip gives.

        What the sensor's noise leaves unknown of that is put to one side or the other
        at random. None for a model that does not know it: of whole episodes, or with
        parameters of the hydroelastic contact alone.

        Args:
            theta: (p,) values of `parameters`.
        """
        model = self.surrogate().with_begins(theta)
        if model.rollout or model.costly:
            return None
        try:
            [moved] = model._moved_begins(theta, 1)
        except PredictionError as error:
            return Validity(1.0, np.nan, str(error))
        share = float(np.mean(np.abs(moved).max(axis=1) > 3.0))
        return Validity(share, model._transitions.most_give())

    def begin_error(self, theta: Array) -> Array | None:
        """See SimulatedModel: of how far the grip gives, see `validity`."""
        model = self.surrogate().with_begins(theta)
        if model.rollout or model.costly:
            return None
        try:
            moved = model._moved_begins(theta, _DRAWS)
        except PredictionError:
            return None
        return np.asarray(np.sqrt(np.mean(moved**2, axis=0)))

    def _moved_begins(self, theta: Array, draws: int) -> Array:
        """Returns by how much predictions move with where steps begin.

        (draws, rows, channels), in units of their stated errors, where steps begin
        elsewhere by what the sensor's noise leaves unknown of it, to random sides.

        Args:
            theta: (p,) values of `parameters`.
            draws: how often.

        Raises:
            PredictionError: a simulation failed.
        """
        found, rows = self.predictions(theta), self._transitions.rows
        random, moved = np.random.default_rng(0), []
        for _ in range(draws):
            sides = random.choice([-1.0, 1.0], (len(self._whole.steps), 6))
            away = self._observer.uncertain(self._whole, sides).select(rows)
            moved.append(self.replace(_transitions=away).predictions(theta) - found)
        return np.array(moved) / self.measurements.sigma

    @property
    def _observer(self) -> GripObserver:
        noise = self.measurements.noise[6:]
        return GripObserver.of(self._whole, noise, self.reading.mounting)

    def _observed(self, theta: Array, whole: Transitions) -> Transitions:
        """Returns all transitions, those of this model beginning as it has the grip.

        The same, if that makes no noticeable difference. Steps that follow one whose
        begin was surely another are led there once more.

        Args:
            theta: (p,) values of `parameters`.
            whole: all transitions.
        """
        model = self.surrogate()
        if model.costly:
            return whole
        rows = self._transitions.rows
        ends = rows[whole.steps.index[rows] > 0]
        if _with_memory(self.scenario_at(theta)):
            known = model._led_alone(theta, whole)
        else:
            known = model._begun_where_led(theta, whole, ends)
        change = self._observer.change(known.select(rows), self._transitions)
        is_new = not self._whole.seen.any()
        noticeable = is_new or np.mean(change**2, axis=0).max() > 1.0
        return known if noticeable or whole is not self._whole else self._whole

    def _led_without_sensor(self) -> Self:
        """Returns a model without parameters whose steps begin where the last one led.

        With the grip as the model has it, whatever the sensor reads.
        """
        known = self._led_alone(np.zeros(0), self._whole)
        return self.replace(_whole=known, _transitions=known)

    def _led_alone(self, theta: Array, whole: Transitions) -> Transitions:
        """Returns all transitions, each beginning where the step before it has led.

        Under the load that this model has: what a sensor with a memory reads is not it.

        Args:
            theta: (p,) values of `parameters`.
            whole: all transitions.
        """
        ends, states = np.flatnonzero(whole.steps.index > 0), whole.read(self.reading)
        for _ in range(_PASSES):
            model = self.replace(_whole=whole, _displacement=None)
            led = model._ends(theta, ends - 1)
            is_known = np.isfinite(led.states).all(axis=1)
            states[ends[is_known], 6:] = led.states[is_known, 6:]
            before, loaded = whole, whole.with_loads(states, self.reading)
            whole = self._observer.corrected(loaded, ends, led, states)
            if not self._observer.changed(whole, before).any():
                break
        return whole

    def _begun_where_led(
        self,
        theta: Array,
        known: Transitions,
        ends: NDArray[np.int64],
    ) -> Transitions:
        """Returns all transitions, some of which begin where the step before has led.

        Args:
            theta: (p,) values of `parameters`.
            known: all transitions.
            ends: (n,) numbers of those that begin so; none is an episode's first.
        """
        observer, read = self._observer, known.read(self.reading)
        for _ in range(_PASSES):
            if not len(ends):
                break
            led = self.replace(_whole=known, _displacement=None)._ends(theta, ends - 1)
            before, known = known, observer.corrected(known, ends, led, read)
            ends = ends[observer.changed(known, before)[ends - 1]]
        return known

    def _ends(self, theta: Array, rows: NDArray[np.int64]) -> Led:
        """Returns where some steps of the log lead, by their numbers (n,)."""
        model = self.replace(_transitions=self._whole.select(rows))
        parts = []
        for each in even_chunks(len(rows), _IMPACT_CHUNK):
            [own] = model._led(theta[None], each)
            states = model._at_sensor_and_zero(*own, each)[:, :12]
            parts.append((own[0].give, states))
        give, states = (np.concatenate(part) for part in zip(*parts, strict=True))
        return Led(give, states)

    def with_displacement(self, displacement: Array, push: Array) -> Self:
        """See SimulatedModel."""
        begin = self._transitions.ends_before(displacement)
        ends = np.stack([begin, displacement + push], axis=1)
        return self.replace(_displacement=ends)

    def covariates(self, channel: int) -> dict[str, Array]:
        """See LogModel: time, place, action and force at the beginning of a step."""
        return self._transitions.covariates()

    def frames(self, rows: NDArray[np.int64]) -> list[Frame]:
        """See LogModel."""
        mounting = self.reading.mounting
        in_table = Frame(
            "wrench, in G at Bo",
            lambda v: at_bolt(v, mounting),
            lambda v: at_sensor(v, mounting),
        )
        return [in_table, Frame("ft_sensor, in S at So")]

    def _reported(
        self,
        scenario: Scenario,
        states: Array,
        steps: Steps,
        late: LatePoses,
        rows: slice,
    ) -> Array:
        """Returns the poses (n, 6) that are reported where steps led, of states."""
        poses, before = states[:, :6], self._transitions.before[rows, :6]
        if not self.rollout:
            p, own = self._transitions.p_BoTo_B, self._transitions.rows[rows]
            q, q_before = (twin_coordinates(x, p) for x in (poses, before))
            q_begin = steps.q[rows] - self._transitions_at(scenario).elsewhere[rows]
            return bolt_path(late.at_ends(own, q_before, q_begin, q), p)
        episode, found = self.measurements.episode[rows], np.empty_like(poses)
        for number in np.unique(episode):
            own = episode == number
            path = np.vstack([before[own][:1], poses[own]])
            found[own] = reported_poses(path, late.weights)[1:]
        return found

    def _executed_at(self, scenario: Scenario) -> tuple[Steps, LatePoses | None]:
        """Returns the steps as effects have them executed, and late poses, if any."""
        transitions, effects = self._transitions_at(scenario), _mean_chain(scenario)
        weights = pose_weights(scenario.effects, transitions.period)
        sensor = sensor_chain(scenario.effects) if self._begins_vary else ()
        key = repr((effects, weights.tolist(), sensor))
        return _kept(
            self._executed, key, lambda: transitions.executed(effects, weights)
        )

    def _transitions_at(self, scenario: Scenario) -> Transitions:
        """Returns the transitions as they begin with a scenario's sensor."""
        if not self._begins_vary:
            return self._transitions
        effects = sensor_chain(scenario.effects)
        return _kept(
            self._transitions_by_sensor,
            repr(effects),
            lambda: self._transitions.without_effects(effects, self.reading),
        )

    def _displaced(self, steps: Steps, rows: slice) -> Steps:
        """Returns steps as the arm scatters about its commands, if it does."""
        if self._displacement is None:
            return steps
        return _with_displacement(
            steps, self._displacement[rows], self._transitions.period
        )

    @property
    def together(self) -> int:
        """See LogModel: as many as arrays are fast with."""
        if self.rollout or not self._has_impact:
            return 1
        rows = min(self.measurements.rows, _IMPACT_CHUNK)
        return max(1, round(_IMPACT_BATCH / rows))

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
        """See LogModel; every n-th run of a few rows, of a rollout every n-th episode.

        What comes late, or has a memory, needs the rows before it.
        """
        rows = np.arange(self.measurements.rows)
        of = self.measurements.episode if self.rollout else rows // _RUN
        return self.of_rows(of % every == 0)

    def select_rows(self, mask: NDArray[np.bool_]) -> Self:
        """See LogModel."""
        displacement = self._displacement
        return self.replace(
            _transitions=self._transitions.select(mask),
            _displacement=None if displacement is None else displacement[mask],
        )

    def _replays_at(
        self, scenarios: Sequence[Scenario]
    ) -> ImpactReplays | DiagramReplays:
        """Returns the replays of scenarios."""
        simulated = [_environment_alone(scenario) for scenario in scenarios]
        if self.rollout or not self._has_impact:
            return DiagramReplays(simulated, self.rollout)
        return ImpactReplays(simulated)

    @property
    def _has_impact(self) -> bool:
        return self.scenario.contact.model == "impact"

    def __getstate__(self) -> dict[str, Any]:
        """Leaves out what is quickly found again."""
        return self.__dict__ | {"_transitions_by_sensor": {}, "_executed": {}}


def _kept(found: dict[str, _T], key: str, compute: Callable[[], _T]) -> _T:
    """Returns what was found before of a key, or is found now and kept for a while."""
    if key not in found:
        while len(found) >= _KEPT:
            del found[next(iter(found))]
        found[key] = compute()
    return found[key]


def with_impact_as_stiff(scenario: Scenario) -> Scenario:
    """Returns a scenario with IMPACT contact about as stiff as its hydroelastic one."""
    contact = scenario.contact
    most = find_field(scenario, "contact.impact.stiffness").metadata["high"]
    stiffness = _N_PER_MM * scenario.part.impact_stiffness(contact)
    impact = dataclasses.replace(
        contact.impact, stiffness=min(stiffness, most), exponent=1.0
    )
    contact = dataclasses.replace(contact, model="impact", impact=impact)
    return dataclasses.replace(scenario, contact=contact)


def _mean_chain(scenario: Scenario) -> tuple[MotionEffect, ...]:
    """Returns the effects on the motion that are not random, in the chain's order."""
    return tuple(e for e in motion_chain(scenario.effects) if not e.is_random)


def _with_displacement(steps: Steps, ends: Array, period: float) -> Steps:
    """Returns steps whose command is displaced by (n, 2, 3) [m] at begin and end."""
    zero = np.zeros((len(steps), 3))
    begin = np.hstack([ends[:, 0], zero])
    more = np.hstack([ends[:, 1] - ends[:, 0], zero])
    return dataclasses.replace(
        steps, qd=steps.qd + begin, qd_rate=steps.qd_rate + more / period
    )


def _with_memory(scenario: Scenario) -> list[SensorMemoryEffect]:
    """Returns the effects on the sensor that have one."""
    chain = sensor_chain(scenario.effects)
    return [each for each in chain if isinstance(each, SensorMemoryEffect)]


def _environment_alone(scenario: Scenario) -> Scenario:
    """Returns a scenario with only the effects that a replay simulates."""
    effects: list[Any] = [
        e for e in scenario.effects if isinstance(e, EnvironmentEffect)
    ]
    return dataclasses.replace(scenario, effects=effects)

"""How an arm's measured positions follow from commanded ones."""

import dataclasses
import functools
import itertools
from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import (
    ArmEffect,
    ArmTorqueEffect,
    Effect,
    JointMemoryEffect,
)
from drake_disasm.logs import Episode, Log
from drake_disasm.logs.refusal import refusal
from drake_disasm.scenario import Scenario
from sysid.models.arm_logs import arm_urdf, refuse_other_joints, refuse_other_logs
from sysid.models.arm_plant import ArmPlant
from sysid.models.base import Array, LogModel
from sysid.models.bookkeeping import Assumption
from sysid.models.effects import one_way_joints, travel_of
from sysid.models.joint_units import in_units_of_joints, prismatic_unit
from sysid.models.measurements import Channel, Measurements
from sysid.models.response.drive import Drive, DriveSettings, joined
from sysid.models.response.gears import ON_GEARS
from sysid.models.response.near_motion import MOST_KEPT, Bodies
from sysid.models.response.rigid_bodies import RigidBodies
from sysid.models.response.segments import (
    LocalFit,
    Segment,
    inputs_of,
    interpolated,
    local_fit,
    measured_noise,
    reach_of,
    segments_of,
)
from sysid.models.response.simulation import (
    ON_BODIES,
    Arm,
    ParameterSet,
    positions_at,
    simulate,
)
from sysid.models.response.start import Guess, guessed_drives
from sysid.parameters import Parameter

SEGMENT = 1.0  # s: several times what a servo takes to forget where it was
_STEP = 0.005  # s, of the integrator at most
#: Parameter sets times joints that are simulated side by side: more would be a little
#: faster in one process, and leave others without work.
_TOGETHER = 64
_CHUNK = 32  # segments of one piece of work
_FEWEST = 24  # of a thinned model, if there are so many
_REACH = 30.0  # times what was guessed, on either side
_LONGEST = 0.3  # s, of damping over stiffness: slower is no servo
_LATEST = 0.05  # s, of a goal
_TRIED = 21  # delays of the goal, evenly spaced, that the guess is made of
_MANY = 5.0  # times the greatest torque of the rigid bodies, at most, by any effect
_CLEARLY = 0.1  # of what one kind of controller leaves, at most, if it is the other
_FOLLOWS = 0.1  # of a motion's spread: a joint that errs by less does what it is told
_MOST_ROWS = 2000  # that the guess is made of


class JointResponseModel(LogModel):
    """q(t) of an arm that follows its commands, simulated segment by segment.

    M(q) vd + bias(q, v) + effects(q, v, vd, load) = drive(q_d(t - T), q, v), from the
    state in which each segment was measured to begin. The rigid bodies are those of the
    URDF, and set the scale of all torques; each joint's drive has a stiffness and a
    damping, and all have a delay T of the goal. Those are the parameters.
    """

    effect_types = (ArmTorqueEffect, JointMemoryEffect, *ON_BODIES, *ON_GEARS)
    makes_contact = False

    def __init__(
        self,
        logs: Sequence[Log],
        urdf: str | None = None,
        scenario: Scenario | None = None,
        segment: float = SEGMENT,
    ) -> None:
        """Reads the motion from the logs.

        Args:
            logs: of kind `joint_response`, of one arm.
            urdf: of the arm; by default the one named in the first log.
            scenario: whose arm effects act.
            segment: length [s]; infinite to simulate each episode as a whole.

        Raises:
            DisasmError: a log is of another kind or arm, there is no URDF, an effect
                acts at a joint that the log does not have, or the positions do not
                follow what is commanded.
        """
        refuse_other_logs(logs, "joint_response", "a joint's response")
        header = logs[0].header
        self._urdf = arm_urdf(logs, urdf)
        self._joints = header.joints
        self._settings = _settings_of(logs)
        self._scenario = scenario or Scenario()
        self._effects = tuple(self._scenario.effects)
        refuse_other_joints(self._effects, header.joints)
        self._prismatic = ArmPlant.of(self._urdf, header.joints).prismatic(
            header.joints
        )
        episodes = [episode for log in logs for episode in log.episodes]
        reach = reach_of(episodes)
        smoothed = _smoothed(episodes, reach)
        self._cut(episodes, smoothed, segment, reach)
        self.measurements = Measurements.of_logs(
            logs, self._channels(episodes), lambda _, episode: episode["q"]
        )
        guess = self._guess(episodes, smoothed)
        self.parameters = self._drive_parameters(guess, episodes, logs)

    def _channels(self, episodes: Sequence[Episode]) -> tuple[Channel, ...]:
        """Returns the joints' positions as channels, with the noise of readings."""
        noises = zip(self._joints, measured_noise(episodes), strict=True)
        return tuple(
            Channel(
                joint,
                "m" if joint in self._prismatic else "rad",
                float(noise),
                "scatter about nearby rows",
            )
            for joint, noise in noises
        )

    def _cut(
        self,
        episodes: Sequence[Episode],
        smoothed: Sequence[tuple[Array, LocalFit]],
        length: float,
        reach: float,
    ) -> None:
        """Cuts episodes into segments, and numbers them for each row."""
        segments: list[Segment] = []
        numbers = []
        for episode, (at, fit) in zip(episodes, smoothed, strict=True):
            own, number = segments_of(episode, self._settings, length, reach)
            measured = episode["q"], interpolated(at, fit.v, episode["time"])
            numbers.append(number + len(segments))
            path = at, fit.q
            segments += [
                dataclasses.replace(s, measured=measured, path=path) for s in own
            ]
        self._segments = tuple(segments)
        self._segment = np.concatenate(numbers)
        self._time = np.concatenate([episode["time"] for episode in episodes])

    # Parameters.

    def _guess(
        self, episodes: Sequence[Episode], smoothed: Sequence[tuple[Array, LocalFit]]
    ) -> Guess:
        """Returns about what the drives are, by inverse dynamics of some rows.

        Keeps each row's goal and velocity.
        """
        delays = np.linspace(0.0, _LATEST, _TRIED).tolist()
        motions, inputs, states = [], [], []
        for episode, (at, fit) in zip(episodes, smoothed, strict=True):
            time = episode["time"]
            motions.append(np.stack([fit.q, fit.v, fit.vd]))
            given = inputs_of(episode, self._settings)
            whole = Segment(0.0, fit.q[0], fit.v[0], time, given, fit.vd[0])
            inputs.append([whole.inputs_at(at, t) for t in delays])
            states.append(np.stack([given.goal, interpolated(at, fit.v, time)]))
        self._state = np.concatenate(states, axis=1)
        q, v, vd = np.concatenate(motions, axis=1)
        load = self._bodies.terms(q, v, ()).load(vd)
        self._most = _largest(load, q, v, vd)
        self._most_per_load = _largest_per_load(self._joints, load)
        by_delay = {t: joined(own) for t, *own in zip(delays, *inputs, strict=True)}
        limit, holding = self._settings.limit, self._bodies.holding(q)
        guesses = [
            guessed_drives(load - added, q, v, vd, by_delay, limit)
            for added in (0.0 * holding, holding)
        ]
        return guesses[self._compensates(*guesses)]

    def _compensates(self, without: Guess, compensating: Guess) -> bool:
        """Returns whether the controller adds what gravity takes, as is stated.

        Or as is clear from the motion, where nothing is stated. Keeps that as an
        assumption, and where what is stated is clearly wrong.

        Args:
            without: drives that have to hold the arm against gravity.
            compensating: those that don't.
        """
        stated = self._settings.gravity_compensation
        shares = [float(np.mean(g.left)) for g in (without, compensating)]
        is_clear = min(shares) < _CLEARLY * max(shares)
        by_motion = is_clear and shares[1] < shares[0]
        assumed = by_motion if stated is None else stated
        self._settings = dataclasses.replace(
            self._settings, gravity_compensation=assumed
        )
        if is_clear and by_motion != bool(stated):
            self.assumptions = (_assumption(stated, by_motion, shares),)
        return assumed

    def _drive_parameters(
        self, guess: Guess, episodes: Sequence[Episode], logs: Sequence[Log]
    ) -> tuple[Parameter, ...]:
        """Returns each joint's stiffness and damping, and the delay of all goals."""
        has_gain = any("gain" in e for e in episodes)
        has_supply = any("supply" in e for e in episodes)
        per = " per V" * has_supply + " per unit of gain" * has_gain
        inputs = [inputs_of(episode, self._settings) for episode in episodes]
        usual = np.median(np.concatenate([i.gain * i.supply for i in inputs]), axis=0)
        found = []
        for i, joint in enumerate(self._joints):
            k, d = float(guess.stiffness[i]), float(guess.damping[i])
            if not k > 0.0:
                raise self._not_driven(i, episodes, logs)
            unit, of_damping = "N m/rad", "N m s/rad"
            if joint in self._prismatic:
                unit, of_damping = prismatic_unit(unit), prismatic_unit(of_damping)
            most = max(_LONGEST * k * float(usual[i]), 10.0 * d)
            found += [
                Parameter(
                    f"{joint}.stiffness",
                    k,
                    k / _REACH,
                    k * _REACH,
                    unit,
                    f"of the drive{per}",
                    log_scale=True,
                ),
                Parameter(f"{joint}.damping", d, 0.0, most, of_damping, "of the drive"),
            ]
        delay = Parameter(
            "delay", guess.delay, 0.0, _LATEST, "s", "of what is commanded"
        )
        return (*found, delay)

    def _not_driven(
        self, number: int, episodes: Sequence[Episode], logs: Sequence[Log]
    ) -> DisasmError:
        """Returns why a joint has no stiffness: it follows at once, or not at all."""
        where = logs[0].folder
        goal, q = (
            np.concatenate([e[name] for e in episodes]) for name in ("q_commanded", "q")
        )
        error, spread = np.sqrt(np.mean((q - goal) ** 2, axis=0)), q.std(axis=0)
        if np.linalg.norm(error) < _FOLLOWS * np.linalg.norm(spread):
            apart = f"{1e3 * error.min():.2g} to {1e3 * error.max():.2g}"
            return refusal(
                where,
                f"joints follow what is commanded within {apart} mrad (mm) rms: this "
                "log says nothing of stiffness, friction or load",
                "record motor currents or joint torques, and import them as kind "
                "joint_motion",
            )
        return refusal(
            where,
            f"joint '{self._joints[number]}' does not follow 'q_commanded.{number}'",
            self.assumptions[0].remedy
            if self.assumptions
            else "check signs and units of both, the gain, and that the joint carries "
            "something by the URDF",
        )

    # Effects.

    def applicable_effects(self, library: Sequence[type[Effect]]) -> list[Effect]:
        """See LogModel; what is in a torque sensor's reading alone moves nothing."""
        moving = [k for k in library if issubclass(k, ArmEffect) and k.moves_the_arm]
        return super().applicable_effects(moving)

    def with_effects(
        self, effects: Sequence[Effect], parameters: Sequence[Parameter] = ()
    ) -> Self:
        """See LogModel; additional parameters get the units of their joints.

        And bounds for an arm of this size: a step of a ten-thousandth of 200 N m is
        more than a small servo has.
        """
        added = in_units_of_joints(parameters, effects, self._prismatic)
        bounded = [self._bounded(p, effects) for p in added]
        return super().with_effects(effects, bounded)

    def _bounded(self, parameter: Parameter, effects: Sequence[Effect]) -> Parameter:
        """Returns a field of effects with bounds that no arm of this size exceeds."""
        joint = getattr(effects[int(parameter.path.split(".")[1])], "joint", "")
        sizes = self._most | self._most_per_load.get(joint, {})
        most = sizes.get(parameter.unit)
        if most is None or parameter.is_shape:
            return parameter
        most = max(most, 2.0 * abs(parameter.nominal))
        low, high = max(parameter.low, -most), min(parameter.high, most)
        return dataclasses.replace(parameter, low=low, high=high)

    def scenario_at(self, theta: Array) -> Scenario:
        """Returns a scenario with the effects; drives are no part of it."""
        effects: list[Any] = list(self.effects_at(theta))
        return dataclasses.replace(self._scenario, effects=effects, randomisation=[])

    # Rows.

    @property
    def joints(self) -> tuple[str, ...]:
        """See LogModel."""
        return self._joints

    @property
    def travel(self) -> dict[str, float]:
        """See LogModel."""
        return travel_of(self._joints, self.measurements.values)

    @property
    def piece(self) -> NDArray[np.int64]:
        """See LogModel: a segment begins where the arm was measured."""
        return self._segment

    @property
    def one_way(self) -> tuple[str, ...]:
        """See LogModel."""
        return one_way_joints(self._joints, self._state[1])

    def select_rows(self, mask: NDArray[np.bool_]) -> Self:
        """See LogModel."""
        return self.replace(
            _segment=self._segment[mask],
            _time=self._time[mask],
            _state=self._state[:, mask],
        )

    def covariates(self, channel: int) -> dict[str, Array]:
        """See LogModel: the joint's own motion as it was measured, and its goal."""
        goal, velocity = self._state[..., channel]
        position = self.measurements.values[:, channel]
        return {
            "time": self._time,
            "position": position,
            "velocity": velocity,
            "distance to the goal": goal - position,
        }

    def thin(self, every: int) -> Self:
        """Returns the same model of every n-th segment: rows of one come for free.

        So do a few dozen segments side by side, and fewer would not show all that the
        arm did: those stay.
        """
        numbers = np.unique(self._segment)
        kept = numbers[:: max(1, min(every, len(numbers) // _FEWEST))]
        return self.of_rows(np.isin(self._segment, kept))

    def chunks(self) -> list[slice]:
        """See LogModel: some segments each."""
        begins = np.flatnonzero(np.diff(self._segment, prepend=-1))
        edges = [*begins[::_CHUNK].tolist(), len(self._segment)]
        return [slice(a, b) for a, b in itertools.pairwise(edges)]

    # Prediction.

    @property
    def together(self) -> int:
        """See LogModel."""
        return max(1, _TOGETHER // len(self._joints))

    def predict(self, theta: Array, rows: slice) -> Array:
        """See LogModel."""
        return self._simulated(theta[None], rows)[0]

    def simulate_all(self, thetas: Array, rows: slice) -> list[Array | str]:
        """See LogModel."""
        found = self._simulated(np.array([self.with_frozen(t) for t in thetas]), rows)
        return [
            own if np.isfinite(own).all() else "no step of the integrator was found"
            for own in found
        ]

    def _simulated(self, thetas: Array, rows: slice) -> Array:
        """Returns positions (k, rows, joints) of parameter sets (k, all)."""
        numbers, segment = np.unique(self._segment[rows], return_inverse=True)
        segments = [self._segments[number] for number in numbers]
        if len(np.unique(self._segment)) > MOST_KEPT:
            segments = [dataclasses.replace(s, measured=None) for s in segments]
        after = self._time[rows] - np.array([s.start for s in segments])[segment]
        steps = max(1, int(np.ceil(float(after.max()) / _STEP - 1e-9)))
        bodies = Bodies(self._bodies, bool(self._settings.gravity_compensation))
        arm = Arm(self._joints, bodies)
        sets = [self._parameter_set(theta) for theta in thetas]
        motion = simulate(arm, sets, segments, steps, _STEP)
        return positions_at(motion, _STEP, after, segment)

    def _parameter_set(self, theta: Array) -> ParameterSet:
        """Returns what parameters (all,) stand for: see `parameters`."""
        count = 2 * len(self._joints)
        drive = Drive(theta[0:count:2], theta[1:count:2], self._settings.limit)
        effects = tuple(e for e in self.effects_at(theta) if isinstance(e, ArmEffect))
        return ParameterSet(drive, float(theta[count]), effects)

    @property
    def _bodies(self) -> RigidBodies:
        """Built once in each process that evaluates the model."""
        return _rigid_bodies(self._urdf, self._joints)


@functools.lru_cache(maxsize=4)
def _rigid_bodies(urdf: str, joints: tuple[str, ...]) -> RigidBodies:
    return RigidBodies(urdf, joints)


def _assumption(
    stated: bool | None, by_motion: bool, shares: Sequence[float]
) -> Assumption:
    """Returns that a controller adds what gravity takes, or doesn't.

    Args:
        stated: whether it does by the log; None: that doesn't say.
        by_motion: whether it does by the motion.
        shares: of the torques that drives can't have given, if it doesn't and does.
    """
    said = "doesn't say whether" if stated is None else "says otherwise:"
    does = "adds" if by_motion else "does not add"
    without, compensating = (f"{100.0 * share:.2g} %" for share in shares)
    return Assumption(
        f"log.yaml {said} the controller {does} what gravity takes, which the motion "
        f"shows (drives miss {compensating} of the torques if it does, else {without})",
        f"state 'drive: {{gravity_compensation: {str(by_motion).lower()}}}' there",
    )


def _smoothed(
    episodes: Sequence[Episode], reach: float
) -> list[tuple[Array, LocalFit]]:
    """Returns times [s] of some rows of each episode, and the motion there."""
    every = max(1, sum(len(e["time"]) for e in episodes) // _MOST_ROWS)
    times = [episode["time"][::every] for episode in episodes]
    return [
        (at, local_fit(episode["time"], episode["q"], at, reach))
        for episode, at in zip(episodes, times, strict=True)
    ]


def _largest(load: Array, q: Array, v: Array, vd: Array) -> dict[str, float]:
    """Returns how large effects may be, by the unit of their amplitudes.

    Args:
        load: (n, joints) torques of the rigid bodies.
        q, v, vd: (n, joints) the motion.
    """
    torque = _MANY * float(np.abs(load).max())
    spread = float(np.sqrt(np.mean(np.var(q, axis=0))))
    speed, acceleration = (float(np.sqrt(np.mean(a**2))) for a in (v, vd))
    sizes = {
        "N m": torque,
        "N m/rad": torque / spread,
        "N m s/rad": torque / speed,
        "kg m^2": torque / acceleration,
    }
    found = {unit: most for unit, most in sizes.items() if 0.0 < most < np.inf}
    return found | {prismatic_unit(unit): most for unit, most in found.items()}


def _largest_per_load(
    joints: Sequence[str], load: Array
) -> dict[str, dict[str, float]]:
    """Returns how large friction per squared load (n, joints) may be, by the joint.

    As large as the greatest load itself: no gear would move beyond.
    """
    unit = "1/(N m)"
    most = 1.0 / np.maximum(np.abs(load).max(axis=0), 1e-9)
    return {
        joint: {unit: float(k), prismatic_unit(unit): float(k)}
        for joint, k in zip(joints, most, strict=True)
    }


def _settings_of(logs: Sequence[Log]) -> DriveSettings:
    """Returns what the logs say of their drives, which must be the same."""
    found = [
        DriveSettings.of(log.header.drive or {}, str(log.folder / "log.yaml"))
        for log in logs
    ]
    for log, settings in zip(logs, found, strict=True):
        if settings != found[0]:
            raise refusal(
                log.folder / "log.yaml",
                "another 'drive' than in the first log",
                "fit it by itself",
            )
    return found[0]

"""Many episodes of the twin in lockstep, on one set of array operations."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from drake_disasm.common.arrays import Array, array_like, namespace, to_numpy
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.rotations import Pose
from drake_disasm.devices.ft_sensor import quantise
from drake_disasm.mdp import (
    BoltState,
    is_removed,
    is_terminated,
    is_truncated,
    outcomes,
    reward_terms,
)
from drake_disasm.scenario import Scenario, draw, with_values
from drake_disasm.systems.imprecision import clamped
from drake_disasm.systems.pose_target import executed_pose, moved_poses
from drake_disasm.twin.episodes import Episodes, TwinBatch
from drake_disasm.twin.refusals import make_like, refuse_count, refuse_scenarios
from drake_disasm.twin.stacking import put_rows, rows_of
from drake_disasm.twin.twins import Twins

_NOISE_STREAM = 0x4E4F4953  # apart from that of the ranges
#: What no arm does to a bolt in a step: contact has thrown it. m from where an episode
#: starts; N and N m.
_FAR, _MUCH = 1.0, 1e5


def with_impact(scenario: Scenario) -> Scenario:
    """Returns a scenario with the contact that a batch has a form of."""
    contact = dataclasses.replace(scenario.contact, model="impact")
    return dataclasses.replace(scenario, contact=contact)


@dataclasses.dataclass(frozen=True)
class BatchResult:
    """What one step of the MDP returned, of n environments.

    Attributes:
        observation: (n, 12) the states after it.
        place: (n, 3) of the bolts, as in `StepResult` [m].
        reward_terms: the weighted terms by name, (n,) each.
        outcome: (n,) numbers of `mdp.Outcome`.
        has_failed: (n,) whether its simulation failed. Its observation is the one
            before, its reward zero.
        failure: (n) why, or "".
    """

    observation: Array
    place: Array
    reward_terms: dict[str, Array]
    outcome: Array
    has_failed: Array
    failure: Sequence[str]

    @property
    def reward(self) -> Array:
        """Sum of the terms (n,)."""
        return sum(self.reward_terms.values())

    @property
    def terminated(self) -> Array:
        """Whether the task itself ended each episode (n,)."""
        return is_terminated(self.outcome) & ~self.has_failed

    @property
    def truncated(self) -> Array:
        """Whether the step limit ended it, or the simulation failed (n,)."""
        return is_truncated(self.outcome) | self.has_failed


class BatchedTwin:
    """The twin with IMPACT contact, N episodes in lockstep.

    What `TaskSimulation(scenario, "twin")` simulates, by the same equations for
    effects, contact, observation, reward and end of an episode; the diagram is the
    reference (tests/drake_disasm/twin). Noise has the same distribution but other
    numbers. States are float64.

    Attributes:
        count: how many environments.
        scenarios: one for each of them, as given.
        episodes: that run.
        drawn: values drawn from the ranges for each running episode, by parameter.
        observation, reading: (n, 12), (n, 6) the newest states and sensor readings.
        action, action_executed: (n, 6) of the newest step, without and with the
            scenario's imprecision.

    Args:
        scenarios: one for all, or one for each environment: effects, parameters and
            ranges may differ.
        count: how many environments; of a list, its length.
        device: "cpu", or "cuda", where torch computes; or "numpy".
        threads: of the host, which share the environments.

    Raises:
        DisasmError: the batch can't carry an effect or a scenario, the device is not
            there, or there is no environment.
    """

    def __init__(
        self,
        scenarios: Scenario | Sequence[Scenario],
        count: int | None = None,
        device: str = "cpu",
        threads: int = 1,
    ) -> None:
        given = [scenarios] if isinstance(scenarios, Scenario) else list(scenarios)
        count = len(given) if count is None else count
        refuse_count(count, len(given))
        self.scenarios = given * count if len(given) == 1 else given
        self.count = len(self.scenarios)
        refuse_scenarios(self.scenarios)
        self.like = make_like(device)
        self._batch = TwinBatch(self.scenarios, self.like, threads)
        self.drawn: list[dict[str, float]] = [{} for _ in self.scenarios]
        self._steps = max(s.task.steps for s in self.scenarios)
        self._noise = np.zeros((self.count, 0, 12))
        if any(s.imprecision or any(s.ft_sensor.noise) for s in self.scenarios):
            shape = (self.count, self._steps + 1, 12)
            self._noise = array_like(np.zeros(shape, np.float32), self.like)
        self._starts, self._start_of = self._common_starts()
        self.episodes: Episodes
        self._twins: Twins
        self.observation: Array
        self.reading: Array
        self.action = self.action_executed = array_like(
            np.zeros((self.count, 6)), self.like
        )

    def reset(self, seeds: Sequence[int]) -> Array:
        """Starts all episodes anew; returns the first observations (n, 12).

        Args:
            seeds: one for each environment: of noise, and of what is drawn from the
                scenario's ranges, the same as the diagram draws.

        Raises:
            DisasmError: they are not as many as the environments.
        """
        if np.shape(seeds) != (self.count,):
            raise DisasmError(
                f"seeds: {np.size(seeds)} for {self.count} environments; give one for "
                "each"
            )
        every = np.arange(self.count)
        self.episodes = self.begin(every, seeds)
        self.observation = array_like(np.zeros((self.count, 12)), self.like)
        return self.start(every, seeds, self.episodes)

    def begin(self, rows: np.ndarray, seeds: Sequence[int]) -> Episodes:
        """Returns episodes that may be started, of some environments (m,).

        It takes as long as some steps of the task; for many at once little more than
        for one. Where nothing is drawn from ranges it takes no time.
        """
        drawn = [k for k, i in enumerate(rows) if self.scenarios[i].randomisation]
        own = [int(rows[k]) for k in drawn]
        scenarios = [
            with_values(self.scenarios[i], draw(self.scenarios[i], seeds[k]))
            for i, k in zip(own, drawn, strict=True)
        ]
        if self._starts is None or len(own) == len(rows):
            return self._batch.begin(own, scenarios)
        begun = rows_of(self._starts, self._start_of[rows])
        if own:
            put_rows(begun, drawn, self._batch.begin(own, scenarios))
        return begun

    def start(
        self, rows: np.ndarray, seeds: Sequence[int], beginning: Episodes
    ) -> Array:
        """Starts episodes in some environments; returns all observations (n, 12).

        Args:
            rows: (m,) which environments.
            seeds: of them.
            beginning: from `begin`, m of them.
        """
        if beginning is not self.episodes:
            put_rows(self.episodes, rows, beginning)
        self._twins = self._batch.twins(self.episodes)
        for row, seed in zip(rows, seeds, strict=True):
            self.drawn[row] = draw(self.scenarios[row], seed)
            if self._noise.shape[1]:
                random = np.random.default_rng([seed, _NOISE_STREAM])
                numbers = random.standard_normal(self._noise.shape[1:], np.float32)
                self._noise[row] = array_like(numbers, self._noise)
        xp, found = namespace(self.like), self._observed()[rows]
        # Where the start has failed, so will the first step, which says so.
        self.observation[rows] = xp.where(xp.isfinite(found), found, 0.0)
        return self.observation

    def step(self, actions: Array) -> BatchResult:
        """Advances one period of the MDP.

        Args:
            actions: (n, 6) [m, rad], clipped to the bounds.

        Raises:
            DisasmError: nothing was reset, or the actions have another shape.
        """
        self._refuse_step(actions)
        xp, episodes, before = namespace(self.like), self.episodes, self.observation
        numbers = self._twins.numbers
        action = array_like(actions, self.like)
        is_finite = xp.all(xp.isfinite(action), axis=1)
        action = xp.where(is_finite[:, None], action, 0.0)
        action = self.action = clamped(action, numbers.bounds)
        if self._noise.shape[1]:
            noise = self._noise_now()[:, :6]
            action = numbers.imprecise.action(action, noise)
        self.action_executed = action
        goal = self._goal(action)
        # An environment that fails may overflow; what fails is named below.
        with np.errstate(over="ignore", invalid="ignore"):
            v = action[:, :3] / self.period
            is_solved = self._batch.advance(episodes, self._twins, goal, v)
            episodes.steps = episodes.steps + 1.0
            found = self._observed()
        is_solved = is_solved & xp.all(xp.isfinite(found), axis=1)
        is_thrown = xp.any(xp.abs(found[:, :3]) > _FAR, axis=1)
        is_thrown = is_thrown | xp.any(xp.abs(found[:, 6:]) > _MUCH, axis=1)
        has_failed = ~(is_finite & is_solved & ~is_thrown)
        after = self.observation = xp.where(has_failed[:, None], before, found)
        states = BoltState.from_vector(before), BoltState.from_vector(after)
        terms = reward_terms(*states, numbers.task, numbers.geometry)
        terms = {name: xp.where(has_failed, 0.0, term) for name, term in terms.items()}
        p_GBo = self._p_GBo() if numbers.task.judged_by == "bolt" else None
        judged = (numbers.task, numbers.geometry, p_GBo)
        ends = outcomes(states[1], episodes.steps, *judged)
        reasons = self._reasons(has_failed, is_finite, is_solved)
        place = numbers.geometry.place(states[1])
        return BatchResult(after, place, terms, ends, has_failed, reasons)

    def _refuse_step(self, actions: Array) -> None:
        """Raises DisasmError for actions of another shape, or before a reset."""
        if tuple(np.shape(actions)) != (self.count, 6):
            raise DisasmError(
                f"actions: are of shape {tuple(np.shape(actions))}; give "
                f"{(self.count, 6)}, [dx dy dz du dv dw] in m and rad"
            )
        if not hasattr(self, "episodes"):
            raise DisasmError("step: nothing was reset; call reset first")

    def _reasons(
        self, has_failed: Array, is_finite: Array, is_solved: Array
    ) -> list[str]:
        """Returns why environments failed (n)."""
        reasons, failed = [""] * self.count, np.flatnonzero(to_numpy(has_failed))
        if not len(failed):
            return reasons
        fine, solved = to_numpy(is_finite), to_numpy(is_solved)
        for row in failed:
            reason = "contact has thrown the bolt away; its stiffness can't be right"
            if not fine[row]:
                reason = "its action is not finite"
            elif not solved[row]:
                reason = "no contact force balances its step"
            reasons[row] = f"environment {row}: {reason}; its episode ends"
        return reasons

    def bolt_is_out(self) -> np.ndarray:
        """Returns whether each bolt truly is out (n,): only a simulation knows."""
        return to_numpy(is_removed(self._p_GBo(), self._twins.numbers.geometry))

    def _p_GBo(self) -> Array:
        """Returns where each bolt truly is in its groove (n, 3) [m]."""
        numbers, around = self._twins.numbers, self._twins.plant_at_A.conditions.around
        X_GnB = numbers.coordinates.poses(self.episodes.state.q)
        moved = (X_GnB.p - around.p_GnG)[:, None]
        return namespace(self.like).matmul(moved, around.R_GnG)[:, 0]

    @property
    def period(self) -> float:
        """Of the MDP [s]."""
        return self._batch.period

    def _goal(self, action: Array) -> Array:
        """Returns the coordinates (n, 6) to which the command goes."""
        episodes = self.episodes
        episodes.commanded = executed = moved_poses(episodes.commanded, action)
        effects = self._twins.effects.motion
        if effects:
            wrench, memory = self.observation[:, 6:], episodes.motion_memory
            executed, episodes.motion_memory = executed_pose(
                effects, executed, wrench, memory, self.period
            )
        return self._twins.numbers.coordinates.of_poses(executed)

    def _observed(self) -> Array:
        """Returns what the newest readings show (n, 12), with noise."""
        episodes, numbers = self.episodes, self._twins.numbers
        reading = episodes.reading
        if self._noise.shape[1]:
            reading = reading + numbers.noise * self._noise_now()[:, 6:]
        self.reading = quantise(reading, numbers.quantum)
        pose = self.pose_measured()
        return self._twins.processing.state(pose, self.reading, episodes.offset)

    def pose_measured(self) -> Pose:
        """Returns where the encoders have the bolts, X_GB (n, ...)."""
        coordinates = self._twins.numbers.coordinates
        return coordinates.poses(self.episodes.state.arm[:, :6])

    def _noise_now(self) -> Array:
        """Returns unit noise (n, 12) for this step, of action and reading."""
        xp = namespace(self.like)
        every = xp.arange(self.count)
        step = xp.astype(self.episodes.steps, xp.int64)
        last = self._noise.shape[1] - 1
        return xp.astype(self._noise[every, xp.clip(step, 0, last)], self.like.dtype)

    def _common_starts(self) -> tuple[Episodes | None, np.ndarray]:
        """Returns the starts (k, ...) of k scenarios, and which one each row has (n,).

        Of scenarios of which nothing is drawn for each episode, which makes starts
        differ; None if there is no such scenario. Other rows have the first.
        """
        fixed = {id(s): i for i, s in enumerate(self.scenarios) if not s.randomisation}
        if not fixed:
            return None, np.zeros(self.count, int)
        rows, number = list(fixed.values()), {key: k for k, key in enumerate(fixed)}
        starts = self._batch.begin(rows, [self.scenarios[i] for i in rows])
        return starts, np.array([number.get(id(s), 0) for s in self.scenarios])

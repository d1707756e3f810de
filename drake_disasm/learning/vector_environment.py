"""The task as a Gymnasium vector environment, on a batch of twins.

::

    import drake_disasm
    import gymnasium

    envs = gymnasium.make_vec(
        "drake_disasm/Removal-v0", num_envs=256, vectorization_mode="vector_entry_point"
    )
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from drake_disasm.common.arrays import to_numpy
from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.environment import effects_in
from drake_disasm.mdp import (
    ACTION_NAMES,
    REWARD_TERMS,
    STATE_NAMES,
    Outcome,
    action_bounds,
)
from drake_disasm.scenario import Scenario
from drake_disasm.scenario.given import scenario_of
from drake_disasm.twin.batch import BatchedTwin, BatchResult, with_impact
from drake_disasm.twin.refusals import refuse_count
from drake_disasm.twin.starts import NextEpisodes

#: Where a batch computes.
DEVICES = ("auto", "numpy", "cpu", "cuda")
_MODES = (AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP)
_WORTH_A_GPU = 1024  # environments: with fewer, starting its kernels takes longer
_UNITS = ("m",) * 3 + ("rad",) * 3 + ("N",) * 3 + ("N m",) * 3
_TERMINATED = np.array([outcome.terminated for outcome in Outcome])
_TRUNCATED = np.array([outcome.truncated for outcome in Outcome])
_LABELS = np.array([outcome.label for outcome in Outcome], dtype=object)

Scenarios = Scenario | str | Path | Sequence[Scenario | str | Path]


class DisassemblyVectorEnv(VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """`DisassemblyEnv` on the twin with IMPACT contact, many times in lockstep.

    Observations, actions, rewards and the ends of episodes are those of
    `DisassemblyEnv`; an environment of the same seed draws the same from the scenario's
    ranges in all its episodes. Contact is IMPACT whatever the scenario's: hydroelastic
    contact has no form for a batch.

    An episode that ends is followed by the next in the same step: the observation is
    its first one, and `infos["final_obs"]`, `infos["final_info"]` have the last of the
    one before (gymnasium's AutoresetMode.SAME_STEP). An environment whose simulation
    fails (an action that is not finite, contact without a balance) is truncated, with
    reward 0, the outcome "failed" and the reason in `infos["final_info"]["failure"]`;
    the others go on.

    Units are in `metadata`: m, rad, N, N m. The spaces bound actions, rotations, and
    positions by how far all actions lead together; forces have no bound.

    Attributes:
        twin: the batch.

    Args:
        num_envs: how many environments.
        scenario: an object, a shipped name, or a file; or one for each environment.
        station: "twin"; a cell has no batch.
        device: "cpu", or "cuda", where torch computes; "numpy"; or "auto": cuda if it
            is there and faster (from 1024 environments), else numpy.
        autoreset_mode: SAME_STEP or NEXT_STEP.

    Raises:
        DisasmError: see `BatchedTwin`.
    """

    def __init__(
        self,
        num_envs: int = 1,
        scenario: Scenarios = "removal",
        station: str = "twin",
        device: str = "auto",
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
    ) -> None:
        refuse_count(num_envs)
        if station != "twin":
            raise DisasmError(
                f"station: '{station}' has no batch; use twin, or num_envs of "
                'gymnasium\'s own with vectorization_mode="sync"'
            )
        self._mode = _mode_of(autoreset_mode)
        self.metadata = {
            "render_modes": [],
            "autoreset_mode": self._mode,
            "observation_units": dict(zip(STATE_NAMES, _UNITS, strict=True)),
            "action_units": dict(zip(ACTION_NAMES, _UNITS[:6], strict=True)),
        }
        self.num_envs, self._device = num_envs, choose_device(device, num_envs)
        self._given = _scenarios_of(scenario, num_envs)
        self._build(self._given)
        bounds = np.max([action_bounds(s.task) for s in self._given], axis=0)
        high = bounds.astype(np.float32)
        self.single_action_space = gymnasium.spaces.Box(-high, high)
        self.single_observation_space = _observation_space(self._given)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def _build(self, scenarios: list[Scenario]) -> None:
        same = len({id(s) for s in scenarios}) == 1
        given = scenarios[0] if same else scenarios
        self.twin = BatchedTwin(given, self.num_envs, self._device)
        self._generators: list[np.random.Generator] = []
        self._next: NextEpisodes | None = None
        self._has_ended = np.zeros(self.num_envs, bool)

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Starts an episode in all environments.

        Args:
            seed: of the first environment's episode, one more for each of the others;
                or a list. None: of the environments' own generators.
            options: {"effects": [...]} replaces the scenarios' effects from now on.

        Raises:
            DisasmError: an option is unknown, the seeds are not as many as the
                environments, or the batch can't carry an effect.
        """
        effects = effects_in(options or {})
        if effects is not None:
            self._build([dataclasses.replace(s, effects=effects) for s in self._given])
        seeds = self._seed_all(seed)
        self._next = NextEpisodes(self.twin, self._generators)
        self._has_ended = np.zeros(self.num_envs, bool)
        rows = _Rows.beginning(to_numpy(self.twin.reset(seeds)))
        return rows.observation.astype(np.float32), rows.infos()

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Advances one period of the MDP in all environments.

        Raises:
            DisasmError: the actions are not (num_envs, 6), or nothing was reset.
        """
        actions = np.asarray(actions, dtype=float)
        wanted = (self.num_envs, len(ACTION_NAMES))
        if actions.shape != wanted:
            raise DisasmError(
                f"actions: are of shape {actions.shape}; give {wanted}, "
                "[dx dy dz du dv dw] in m and rad"
            )
        rows = _Rows.of(self.twin.step(actions))
        if self._has_ended.any():  # in the step before: its action was for nothing
            self._begin_next(self._has_ended, rows)
        reward, terminated, truncated = rows.reward, rows.terminated, rows.truncated
        ended = terminated | truncated
        infos: dict[str, Any] = {}
        if self._mode is AutoresetMode.NEXT_STEP:
            self._has_ended = ended
        elif ended.any():
            infos = rows.final(ended)
            self._begin_next(ended, rows)
        infos |= rows.infos()
        observation = rows.observation.astype(np.float32)
        return observation, reward, terminated, truncated, infos

    def _begin_next(self, ended: np.ndarray, rows: "_Rows") -> None:
        """Starts the next episodes where one has ended (n,)."""
        if self._next is None:
            raise DisasmError("step: nothing was reset; call reset first")
        which = np.flatnonzero(ended)
        seeds, episodes = self._next.take(which)
        observation = to_numpy(self.twin.start(which, seeds, episodes))
        rows.begin(which, observation[which])

    def _seed_all(self, seed: int | list[int | None] | None) -> list[int]:
        """Returns the seeds of all episodes; makes the generators of those to come."""
        count = self.num_envs
        seeds: list[int | None] = [None] * count
        if isinstance(seed, list):
            seeds = list(seed)
        elif seed is not None:
            seeds = [seed + i for i in range(count)]
        if len(seeds) != count:
            raise DisasmError(
                f"seed: {len(seeds)} seeds for {count} environments; give one for each"
            )
        if not self._generators:
            self._generators = [seeding.np_random(None)[0] for _ in range(count)]
        for i, given in enumerate(seeds):
            if given is not None:
                self._generators[i] = seeding.np_random(given)[0]
        return [
            int(generator.integers(2**31)) if given is None else given
            for given, generator in zip(seeds, self._generators, strict=True)
        ]


@dataclasses.dataclass
class _Rows:
    """What a step returns of n environments, in NumPy.

    Attributes:
        observation: (n, 12).
        reward_terms: (n,) by name.
        outcome: (n,) numbers of Outcome.
        failure: (n,) why the simulation failed, or None.
    """

    observation: np.ndarray
    reward_terms: dict[str, np.ndarray]
    outcome: np.ndarray
    failure: np.ndarray

    @classmethod
    def of(cls, result: BatchResult) -> "_Rows":
        """Returns those of a step."""
        failure = np.full(len(result.failure), None, dtype=object)
        for row, reason in enumerate(result.failure):
            failure[row] = reason or None
        terms = {n: np.array(to_numpy(t)) for n, t in result.reward_terms.items()}
        observation = np.array(to_numpy(result.observation))
        return cls(observation, terms, np.array(to_numpy(result.outcome)), failure)

    @classmethod
    def beginning(cls, observation: np.ndarray) -> "_Rows":
        """Returns those of episodes that begin."""
        count = len(observation)
        terms = {name: np.zeros(count) for name in REWARD_TERMS}
        running = np.zeros(count, np.int64)
        return cls(np.array(observation), terms, running, np.full(count, None))

    def begin(self, which: np.ndarray, observation: np.ndarray) -> None:
        """Replaces some rows by those of episodes that begin."""
        self.observation[which] = observation
        for term in self.reward_terms.values():
            term[which] = 0.0
        self.outcome[which], self.failure[which] = Outcome.RUNNING, None

    @property
    def reward(self) -> np.ndarray:
        """Sum of the terms (n,)."""
        return np.array(sum(self.reward_terms.values()))

    @property
    def _has_failed(self) -> np.ndarray:
        return np.array([reason is not None for reason in self.failure])

    @property
    def terminated(self) -> np.ndarray:
        """Whether the task itself ended the episode (n,)."""
        return _TERMINATED[self.outcome] & ~self._has_failed

    @property
    def truncated(self) -> np.ndarray:
        """Whether the step limit ended it, or the simulation failed (n,)."""
        return _TRUNCATED[self.outcome] | self._has_failed

    def infos(self, which: np.ndarray | None = None) -> dict[str, Any]:
        """Returns gymnasium's infos of the environments of a mask (n,); None: all."""
        mask = np.ones(len(self.outcome), bool) if which is None else which
        values: dict[str, Any] = {
            "reward_terms": _with_masks(self.reward_terms, mask),
            "wrench": self.observation[:, 6:],
            "outcome": np.where(self._has_failed, "failed", _LABELS[self.outcome]),
            "is_success": self.outcome == Outcome.SUCCESS,
            "failure": self.failure,
        }
        return _with_masks(values, mask)

    def final(self, ended: np.ndarray) -> dict[str, Any]:
        """Returns what gymnasium's infos have of episodes that have ended (n,)."""
        observations = np.full(len(ended), None, dtype=object)
        for row in np.flatnonzero(ended):
            observations[row] = self.observation[row].astype(np.float32)
        values = {"final_obs": observations, "final_info": self.infos(ended)}
        return _with_masks(values, ended)


def _with_masks(values: dict[str, Any], mask: np.ndarray) -> dict[str, Any]:
    """Returns copies of values with gymnasium's masks, `_key` for each key."""
    found: dict[str, Any] = {}
    for key, value in values.items():
        found[key] = value.copy()
        found[f"_{key}"] = mask.copy()
    return found


def _mode_of(mode: AutoresetMode | str) -> AutoresetMode:
    found = AutoresetMode(mode)
    if found not in _MODES:
        names = " or ".join(m.value for m in _MODES)
        raise DisasmError(f"autoreset_mode: {found.value} is not here; use {names}")
    return found


def choose_device(name: str, count: int) -> str:
    """Returns the device of a batch; of "auto" see `DisassemblyVectorEnv`."""
    if name != "auto":
        return name
    if count < _WORTH_A_GPU:  # torch need not even be loaded
        return "numpy"
    import torch
    from numba import cuda

    there = torch.cuda.is_available() and cuda.is_available()
    return "cuda" if there else "numpy"


def _scenarios_of(given: Scenarios, count: int) -> list[Scenario]:
    """Returns a scenario for each environment, with IMPACT contact."""
    if isinstance(given, Scenario | str | Path):
        return [_loaded(given)] * count
    if len(given) != count:
        raise DisasmError(
            f"scenario: {len(given)} scenarios for {count} environments; give one for "
            "each, or one for all"
        )
    return [_loaded(scenario) for scenario in given]


def _loaded(given: Scenario | str | Path) -> Scenario:
    return with_impact(scenario_of(given))


def _observation_space(scenarios: Sequence[Scenario]) -> gymnasium.spaces.Box:
    """Returns the states' space: an arm is nowhere near twice its whole command."""
    reach = max(
        2.0 * s.task.steps * (s.task.max_translation + s.imprecision) for s in scenarios
    )
    high = np.array([reach] * 3 + [np.pi] * 3 + [np.inf] * 6, dtype=np.float32)
    return gymnasium.spaces.Box(-high, high)

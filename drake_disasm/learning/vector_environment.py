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
        self._mode = AutoresetMode(autoreset_mode)
        if self._mode not in _MODES:
            names = " or ".join(mode.value for mode in _MODES)
            raise DisasmError(
                f"autoreset_mode: {self._mode.value} is not here; use {names}"
            )
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
        rows = _beginning(to_numpy(self.twin.reset(seeds)))
        return rows.observation.astype(np.float32), _infos(rows)

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Advances one period of the MDP in all environments.

        Raises:
            DisasmError: the actions are not (num_envs, 6), or nothing was reset.
        """
        rows = _in_numpy(self.twin.step(np.asarray(actions, dtype=float)))
        if self._has_ended.any():  # in the step before: its action was for nothing
            self._begin_next(self._has_ended, rows)
        reward, terminated, truncated = rows.reward, rows.terminated, rows.truncated
        ended = terminated | truncated
        infos: dict[str, Any] = {}
        if self._mode is AutoresetMode.NEXT_STEP:
            self._has_ended = ended
        elif ended.any():
            infos = _final(rows, ended)
            self._begin_next(ended, rows)
        observation = rows.observation.astype(np.float32)
        return observation, reward, terminated, truncated, infos | _infos(rows)

    def _begin_next(self, ended: np.ndarray, rows: BatchResult) -> None:
        """Starts the next episodes where one has ended (n,)."""
        assert self._next is not None  # the twin was reset
        which = np.flatnonzero(ended)
        seeds, episodes = self._next.take(which)
        begun = _beginning(to_numpy(self.twin.start(which, seeds, episodes)))
        for values, first in zip(_arrays(rows), _arrays(begun), strict=True):
            values[which] = first[which]

    def _seed_all(self, seed: int | list[int | None] | None) -> list[int]:
        """Returns the seeds of all episodes; makes the generators of those to come."""
        count = self.num_envs
        given: list[int | None] = [None] * count
        if isinstance(seed, list):
            given = seed
        elif seed is not None:
            given = [seed + i for i in range(count)]
        if len(given) != count:
            raise DisasmError(
                f"seed: {len(given)} seeds for {count} environments; give one for each"
            )
        old = self._generators or [seeding.np_random(None)[0] for _ in range(count)]
        self._generators = [
            before if one is None else seeding.np_random(one)[0]
            for before, one in zip(old, given, strict=True)
        ]
        return [
            int(generator.integers(2**31)) if one is None else one
            for one, generator in zip(given, self._generators, strict=True)
        ]


def _in_numpy(result: BatchResult) -> BatchResult:
    """Returns a step in NumPy, in memory of its own."""
    return BatchResult(
        np.array(to_numpy(result.observation)),
        np.array(to_numpy(result.place)),
        {n: np.array(to_numpy(t)) for n, t in result.reward_terms.items()},
        np.array(to_numpy(result.outcome)),
        np.array(to_numpy(result.has_failed)),
        result.failure,
    )


def _beginning(observation: np.ndarray) -> BatchResult:
    """Returns the rows of episodes that begin with observations (n, 12)."""
    count = len(observation)
    terms = {name: np.zeros(count) for name in REWARD_TERMS}
    outcome, failed = np.full(count, Outcome.RUNNING), np.zeros(count, bool)
    place, failure = np.zeros((count, 3)), [""] * count
    return BatchResult(np.array(observation), place, terms, outcome, failed, failure)


def _arrays(rows: BatchResult) -> list[np.ndarray]:
    terms = rows.reward_terms.values()
    return [rows.observation, rows.place, *terms, rows.outcome, rows.has_failed]


def _infos(rows: BatchResult, which: np.ndarray | None = None) -> dict[str, Any]:
    """Returns gymnasium's infos of the environments of a mask (n,); None: all."""
    mask = np.ones(len(rows.outcome), bool) if which is None else which
    pairs = zip(rows.failure, rows.has_failed, strict=True)
    failure = [why if has_failed else None for why, has_failed in pairs]
    values: dict[str, Any] = {
        "reward_terms": _with_masks(rows.reward_terms, mask),
        "wrench": rows.observation[:, 6:],
        "outcome": np.where(rows.has_failed, "failed", _LABELS[rows.outcome]),
        "is_success": rows.outcome == Outcome.SUCCESS,
        "failure": np.array(failure, object),
    }
    return _with_masks(values, mask)


def _final(rows: BatchResult, ended: np.ndarray) -> dict[str, Any]:
    """Returns what gymnasium's infos have of episodes that have ended (n,)."""
    observations = np.full(len(ended), None, dtype=object)
    for row in np.flatnonzero(ended):
        observations[row] = rows.observation[row].astype(np.float32)
    values = {"final_obs": observations, "final_info": _infos(rows, ended)}
    return _with_masks(values, ended)


def _with_masks(values: dict[str, Any], mask: np.ndarray) -> dict[str, Any]:
    """Returns copies of values with gymnasium's masks, `_key` for each key."""
    masks = {f"_{key}": mask.copy() for key in values}
    return {key: value.copy() for key, value in values.items()} | masks


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
        return [with_impact(scenario_of(given))] * count
    if len(given) != count:
        raise DisasmError(
            f"scenario: {len(given)} scenarios for {count} environments; give one for "
            "each, or one for all"
        )
    return [with_impact(scenario_of(scenario)) for scenario in given]


def _observation_space(scenarios: Sequence[Scenario]) -> gymnasium.spaces.Box:
    """Returns the states' space: an arm is nowhere near twice its whole command."""
    reach = max(
        2.0 * s.task.steps * (s.task.max_translation + s.imprecision) for s in scenarios
    )
    high = np.array([reach] * 3 + [np.pi] * 3 + [np.inf] * 6, dtype=np.float32)
    return gymnasium.spaces.Box(-high, high)

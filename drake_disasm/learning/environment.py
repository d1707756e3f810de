"""The task as a Gymnasium environment.

::

    import drake_disasm
    import gymnasium

    env = gymnasium.make("drake_disasm/Removal-v0", station="cell")
"""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from drake_disasm.common.errors import DisasmError, DivergedError, UnreachableError
from drake_disasm.effects import Effect
from drake_disasm.mdp import REWARD_TERMS, Outcome
from drake_disasm.scenario import Scenario
from drake_disasm.task.simulation import StepResult, TaskSimulation


class DisassemblyEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """Slide the bolt along the groove, in the cell or on its twin.

    Observation: the state s (12,) of `mdp.STATE_NAMES` [m, rad, N, N m].
    Action: the movement a (6,) of `mdp.ACTION_NAMES` [m, rad], within the task's
    bounds; beyond them it is clipped.
    Reward: the sum of `mdp.reward_terms`, which `info` gives apart.
    Randomisation: sensor noise, imprecision, and the scenario's own ranges.
    Success: see `mdp`. Success and exceeded safety limits are `terminated`, the
    step limit is `truncated`; `info["outcome"]` says which.

    All numbers are SI. An agent that wants them scaled can wrap the environment in
    gymnasium's RescaleAction and TransformObservation.

    Attributes:
        simulation: the diagram, built once and reset in place.
        result: of the newest step.

    Args:
        scenario: an object, a shipped name, or a file.
        station: "twin" or "cell".
    """

    metadata = {"render_modes": []}  # noqa: RUF012, gymnasium's own declaration

    def __init__(
        self, scenario: Scenario | str | Path = "removal", station: str = "twin"
    ) -> None:
        self.simulation = TaskSimulation(scenario, station)
        unlimited = np.full(12, np.inf, dtype=np.float32)
        self.observation_space = gymnasium.spaces.Box(-unlimited, unlimited)
        bounds = self.simulation.bounds.astype(np.float32)
        self.action_space = gymnasium.spaces.Box(-bounds, bounds)
        terms = dict.fromkeys(REWARD_TERMS, 0.0)
        self.result = StepResult(np.zeros(12), np.zeros(3), terms, Outcome.RUNNING)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Starts an episode.

        Args:
            seed: of this episode, the same as in `drake-disasm simulate`; without
                one it is drawn from the environment's own generator.
            options: {"effects": [...]} replaces the scenario's effects.

        Raises:
            DisasmError: an option is unknown.
        """
        super().reset(seed=seed)
        effects = effects_in(options or {})
        if seed is None:
            seed = int(self.np_random.integers(2**31))
        observation = self.simulation.reset(seed, effects)
        terms = dict.fromkeys(REWARD_TERMS, 0.0)
        self.result = StepResult(observation, np.zeros(3), terms, Outcome.RUNNING)
        return observation.astype(np.float32), self._info()

    def step(
        self, action: np.ndarray
    ) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Advances one period of the MDP.

        An action that leads the arm beyond its limits, or has the simulation diverge,
        ends the episode outside of the workspace, with the state before it. Not the
        first one: where that can't be done the scenario is at fault.

        Raises:
            DisasmError: the action is not six finite numbers, or the first of an
                episode and can't be done.
        """
        action = np.asarray(action, dtype=float)
        if action.shape != (6,) or not np.isfinite(action).all():
            raise DisasmError(
                f"action {action}: give 6 finite numbers [dx dy dz du dv dw], m and rad"
            )
        try:
            result = self.simulation.step(action)
        except (UnreachableError, DivergedError):
            if self.simulation.steps == 1:
                raise
            result = self.result.cut_short()
        self.result = result
        return (
            result.observation.astype(np.float32),
            result.reward,
            result.outcome.terminated,
            result.outcome.truncated,
            self._info(),
        )

    def _info(self) -> dict[str, Any]:
        outcome = self.result.outcome
        return {
            "reward_terms": self.result.reward_terms,
            "wrench": self.result.observation[6:].copy(),
            "outcome": outcome.label,
            "is_success": outcome is Outcome.SUCCESS,
        }


def effects_in(options: dict[str, Any]) -> list[Effect] | None:
    """Returns the effects in a reset's options; None if there are none.

    Raises:
        DisasmError: an option is unknown.
    """
    for name in options:
        if name != "effects":
            raise DisasmError(f"option '{name}' is not known; use effects=[...]")
    return options.get("effects")

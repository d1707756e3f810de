"""The batch of twins as a VecEnv of stable-baselines3, which has to be installed.

::

    from stable_baselines3 import SAC
    from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

    from drake_disasm.learning.stable_baselines import DisassemblyVecEnv

    envs = VecMonitor(DisassemblyVecEnv(num_envs=16, scenario="removal"))
    agent = SAC("MlpPolicy", VecNormalize(envs, norm_reward=False))
    agent.learn(20_000)
"""

from typing import Any, NoReturn

import gymnasium
import numpy as np
from gymnasium.wrappers.vector import DictInfoToList
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import (
    VecEnvIndices,
    VecEnvStepReturn,
)

from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.vector_environment import DisassemblyVectorEnv, Scenarios


class DisassemblyVecEnv(VecEnv):
    """`DisassemblyVectorEnv` with the interface that stable-baselines3 asks for.

    An episode that ends is followed by the next in the same step. Its infos are those
    of its last step, with `terminal_observation` and `TimeLimit.truncated` (true where
    the step limit or a failed simulation ended it). All environments take the same
    options at a reset. There are no environments of their own behind the batch:
    `get_attr` gives an attribute of the batch for each of them, `set_attr` sets it for
    all, and `env_method` is refused.

    Attributes:
        envs: the vector environment of gymnasium, see there for units and spaces.

    Args:
        num_envs: how many environments.
        scenario: an object, a shipped name, or a file; or one for each environment.
        device: "cpu", "cuda", "numpy" or "auto", see `DisassemblyVectorEnv`.

    Raises:
        DisasmError: see `DisassemblyVectorEnv`.
    """

    def __init__(
        self,
        num_envs: int = 1,
        scenario: Scenarios = "removal",
        device: str = "auto",
    ) -> None:
        self.envs = DisassemblyVectorEnv(num_envs, scenario, device=device)
        self._listing = DictInfoToList(self.envs)
        self._actions = np.zeros((num_envs, 6))
        super().__init__(
            num_envs,
            self.envs.single_observation_space,
            self.envs.single_action_space,
        )
        self.metadata = self.envs.metadata

    def reset(self) -> np.ndarray:
        """Starts an episode in all environments; returns observations (n, 12).

        The seeds are those of `seed`, the options those of `set_options`, each for one
        reset.

        Raises:
            DisasmError: the options of the environments differ, or one is unknown.
        """
        options = self._options[0]
        if any(other != options for other in self._options):
            raise DisasmError(
                "set_options: the environments of a batch share their options; give "
                "one dictionary for all"
            )
        unseeded = all(seed is None for seed in self._seeds)
        observation, self.reset_infos = self._listing.reset(
            seed=None if unseeded else self._seeds,  # type: ignore[arg-type]
            options=options or None,
        )
        self._reset_seeds()
        self._reset_options()
        return observation

    def step_async(self, actions: np.ndarray) -> None:
        """Takes the actions (n, 6) of the next step [m, rad]."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Advances one period of the MDP.

        Returns:
            Observations (n, 12), rewards (n,), whether episodes ended (n,), and infos.
        """
        observation, reward, terminated, truncated, infos = self._listing.step(
            self._actions
        )
        ended = terminated | truncated
        for i in np.flatnonzero(ended):
            last = infos[i].pop("final_info")
            last["terminal_observation"] = infos[i].pop("final_obs")
            self.reset_infos[i], infos[i] = infos[i], last
        for info, is_cut in zip(infos, truncated & ~terminated, strict=True):
            info["TimeLimit.truncated"] = bool(is_cut)
        return observation, reward.astype(np.float32), ended, infos

    def close(self) -> None:
        """Releases the batch."""
        self.envs.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Returns an attribute of the batch, once for each environment."""
        value = getattr(self.envs, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(
        self, attr_name: str, value: Any, indices: VecEnvIndices = None
    ) -> None:
        """Sets an attribute of the batch.

        Raises:
            DisasmError: for some environments alone.
        """
        if set(self._get_indices(indices)) != set(range(self.num_envs)):
            raise DisasmError(
                f"set_attr {attr_name}: the environments of a batch share their "
                "attributes; leave `indices` out"
            )
        setattr(self.envs, attr_name, value)

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: VecEnvIndices = None,
        **method_kwargs: Any,
    ) -> NoReturn:
        """Refuses: a batch has no environments of their own.

        Raises:
            DisasmError: always.
        """
        raise DisasmError(
            f"env_method {method_name}: a batch has no environments of their own; call "
            "`envs`, or use DisassemblyEnv in a DummyVecEnv"
        )

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Returns False for each environment: no wrapper is around a single one."""
        return [False for _ in self._get_indices(indices)]

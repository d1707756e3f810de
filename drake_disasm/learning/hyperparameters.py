"""Hyper-parameters of an agent: one dataclass, and the presets of the thesis.

A preset is a function of the algorithm, because DDPG, TD3 and SAC share most values
and differ in few (thesis, table 3.3; its footnotes c and d are swapped).
"""

import contextlib
import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

from drake_disasm.common import bounded_yaml
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import check, closest, quantity
from drake_disasm.common.text import clipped

ALGORITHMS = ("ddpg", "td3", "sac")
_WIDTHS = {"low": 1, "high": 10_000}
_MOST_LAYERS = 20
SCHEDULES = ("delayed", "every_step")


@dataclasses.dataclass(frozen=True)
class Hyperparameters:
    """Hyper-parameters of an agent; the defaults are DDPG's of chapter 3.

    The state is divided by the scales below before a network sees it, and an action
    is the tanh output times the task's bounds; the thesis states neither.
    """

    algorithm: str = quantity("ddpg", "", "which update", choices=ALGORITHMS)
    episodes: int = quantity(200, "1", "of a training", low=1, high=1_000_000)
    schedule: str = quantity(
        "delayed",
        "",
        "updates after each episode (algorithm 3.1) or each step (5.1)",
        choices=SCHEDULES,
    )
    updates_per_step: float = quantity(
        1.0, "1", "gradient updates for each step of an episode", low=1e-6, high=100
    )
    warmup_episodes: int = quantity(
        0, "1", "first episodes, before updates start", low=0, high=10_000
    )
    hidden: list[int] = dataclasses.field(
        default_factory=lambda: [50, 50],
        metadata={"unit": "1", "doc": "widths of the hidden layers", **_WIDTHS},
    )
    layer_norm: bool = quantity(False, "", "LayerNorm in the critics")
    critics: int = quantity(1, "1", "the target is their minimum", low=1, high=20)
    actor_rate: float = quantity(1e-3, "1", "Adam's alpha", low=1e-7, high=1.0)
    critic_rate: float = quantity(1e-3, "1", "Adam's alpha", low=1e-7, high=1.0)
    adam_epsilon: float = quantity(1e-7, "1", "Adam's epsilon", low=1e-12, high=1e-2)
    replay: int = quantity(100_000, "1", "transitions kept", low=1, high=10_000_000)
    batch: int = quantity(30, "1", "transitions per update", low=1, high=100_000)
    gamma: float = quantity(0.9, "1", "discount", low=0.0, high=1.0)
    tau: float = quantity(
        0.9, "1", "weight of the new parameters in the targets", low=0.0, high=1.0
    )
    policy_delay: int = quantity(
        1, "1", "critic updates per actor update", low=1, high=100
    )
    exploration: float = quantity(
        0.003, "m", "initial sigma of the action noise", low=0.0, high=0.1
    )
    exploration_decay: float = quantity(
        0.995, "1", "of sigma, per episode", low=0.0, high=1.0
    )
    target_noise: float = quantity(
        0.0, "1", "TD3: sigma on the target's action", low=0.0, high=1.0
    )
    target_noise_limit: float = quantity(
        0.0, "1", "TD3: bound of that noise", low=0.0, high=1.0
    )
    entropy: float = quantity(
        0.2,
        "1",
        "SAC: entropy coefficient; the initial one if adapted",
        low=1e-6,
        high=100.0,
    )
    log_sigma: float = quantity(
        -2.0, "1", "SAC: initial log sigma on a base policy", low=-20.0, high=2.0
    )
    adapt_entropy: bool = quantity(False, "", "SAC: learn it (target: -6)")
    demonstrations: float = quantity(
        0.0, "1", "share of each batch that comes from logs", low=0.0, high=1.0
    )
    base: str = quantity("", "", "scripted policy that the agent adds to")
    residual: list[float] = quantity(
        [1.0] * 6,
        "1",
        "largest action of the agent, per axis, in shares of the task's bounds; of "
        "3 mm and 1 degree where it corrects a base policy, whatever the bounds",
        low=0.0,
        high=1.0,
    )
    axes: str = quantity(
        "groove",
        "",
        "in which the agent sees and acts: the groove's, or those of the stage that "
        "the bolt is in (`StageAxes`), which fit any part",
        choices=("groove", "stage"),
    )
    position_scale: float = quantity(0.01, "m", "of the state", low=1e-6, high=1e3)
    rotation_scale: float = quantity(0.035, "rad", "of the state", low=1e-6, high=1e3)
    force_scale: float = quantity(5.0, "N", "of the state", low=1e-6, high=1e6)
    torque_scale: float = quantity(1.0, "N m", "of the state", low=1e-6, high=1e6)

    def __post_init__(self) -> None:
        """Checks every value against its bounds.

        Raises:
            DisasmError: names the first that breaks them.
        """
        check(self)
        if not 1 <= len(self.hidden) <= _MOST_LAYERS:
            raise DisasmError(
                f"hidden: {len(self.hidden)} widths; give at least one width, and "
                f"{_MOST_LAYERS} at most"
            )

    @property
    def observation_scale(self) -> list[float]:
        """What the state (12,) is divided by."""
        scales = (
            self.position_scale,
            self.rotation_scale,
            self.force_scale,
            self.torque_scale,
        )
        return [scale for scale in scales for _ in range(3)]


def _variant(algorithm: str, **shared: Any) -> Hyperparameters:
    """Returns an algorithm's hyper-parameters with the shared values."""
    own: dict[str, dict[str, Any]] = {
        "ddpg": {},
        "td3": {
            "critics": 2,
            "policy_delay": 2,
            "target_noise": 0.01,
            "target_noise_limit": 0.01,
        },
        "sac": {"critics": 2, "entropy": 0.2},
    }
    return Hyperparameters(algorithm=algorithm, **(shared | own[algorithm]))


def _chapter3(algorithm: str) -> Hyperparameters:
    """Table 3.1."""
    return _variant(algorithm)


def _chapter4(algorithm: str) -> Hyperparameters:
    """Table 4.1; 150 episodes as on the twin."""
    return _variant(
        algorithm,
        episodes=150,
        hidden=[128, 128, 128],
        actor_rate=5e-4,
        critic_rate=5e-4,
        batch=2000,
        exploration=0.005,
        exploration_decay=0.95,
    )


def _chapter5(algorithm: str) -> Hyperparameters:
    """Tables 5.1 and 5.2; their factors are fixed here: 100, 0.5, 0.005."""
    return _variant(
        algorithm,
        episodes=100,
        schedule="every_step",
        hidden=[128, 128],
        actor_rate=0.005,
        critic_rate=0.005,
        replay=10_000,
        batch=100,
        tau=0.5,
        exploration_decay=0.95,
    )


def _best(algorithm: str) -> Hyperparameters:
    """The best of all that was tried; see docs/explanation/learning.md.

    A bounded residual on the admittance policy: it works from the first episode, and
    the bounds keep the agent's correction, times the arm's stiffness, below the safety
    force. SAC with LayerNorm in the critics then learns how to press less.
    """
    own = dataclasses.asdict(_variant(algorithm)) | {
        "episodes": 150,
        "updates_per_step": 2.0,
        "hidden": [64, 64],
        "layer_norm": True,
        "critics": 2,
        "batch": 100,
        "gamma": 0.97,
        "tau": 0.05,
        "exploration": 0.0006,
        "exploration_decay": 0.98,
        "entropy": 0.05,
        "adapt_entropy": True,
        "base": "admittance",
        "residual": [0.05, 0.3, 0.3, 0.1, 0.1, 0.1],
    }
    return Hyperparameters(**own)


#: By name: what makes the hyper-parameters of an algorithm.
PRESETS: dict[str, Callable[[str], Hyperparameters]] = {
    "chapter3": _chapter3,
    "chapter4": _chapter4,
    "chapter5": _chapter5,
    "best": _best,
}
#: The algorithm of a preset, where none is named.
_OWN_ALGORITHM = {"best": "sac"}


def preset(name: str, algorithm: str = "") -> Hyperparameters:
    """Returns the hyper-parameters of a preset for an algorithm.

    Args:
        name: of the preset.
        algorithm: one of ALGORITHMS; without one, DDPG, or what the preset prefers.

    Raises:
        DisasmError: there is no such preset or algorithm.
    """
    if name not in PRESETS:
        raise DisasmError(
            f"preset '{name}' does not exist; {closest(name, list(PRESETS))}"
        )
    algorithm = algorithm or _OWN_ALGORITHM.get(name, "ddpg")
    if algorithm not in ALGORITHMS:
        raise DisasmError(
            f"agent '{algorithm}' does not exist; "
            f"{closest(algorithm, list(ALGORITHMS))}"
        )
    return PRESETS[name](algorithm)


def override(config: Hyperparameters, pairs: Sequence[str]) -> Hyperparameters:
    """Returns the hyper-parameters with `key=value` changes, values as in YAML.

    Raises:
        DisasmError: unknown key, or a value of another kind or out of bounds.
    """
    changes: dict[str, Any] = {}
    fields = {field.name: field for field in dataclasses.fields(config)}
    for pair in pairs:
        key, separator, text = pair.partition("=")
        if not separator:
            raise DisasmError(f"hyper-parameter '{pair}': write it as key=value")
        if key not in fields:
            raise DisasmError(
                f"hyper-parameter '{key}' does not exist; {closest(key, list(fields))}"
            )
        changes[key] = _value(key, text, getattr(config, key))
    return dataclasses.replace(config, **changes)


def _value(key: str, text: str, present: Any) -> Any:
    """Returns the text as a value of the same kind as the present one."""
    try:
        value = bounded_yaml.load(text)
    except DisasmError as error:
        raise DisasmError(f"hyper-parameter '{key}': {error}") from None
    if isinstance(present, list) and isinstance(value, list):
        return [_value(key, str(item), present[0]) for item in value]
    if isinstance(present, float) and isinstance(value, (int, str)):
        with contextlib.suppress(ValueError):  # YAML takes 1e-3 for a text
            value = float(text)
    if value is None and isinstance(present, str):  # `base=` takes the base away
        value = ""
    if isinstance(value, bool) is not isinstance(present, bool) or not isinstance(
        value, type(present)
    ):
        raise DisasmError(
            f"hyper-parameter '{key}': {clipped(text)} is no "
            f"{type(present).__name__}; it is {present} now"
        )
    return value

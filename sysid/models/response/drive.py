"""The drive of each joint: a position controller, its amplifier and its motor."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from sysid.models.base import Array

_KEYS = ("limit", "gravity_compensation", "velocity_feedforward")


@dataclass(frozen=True)
class DriveSettings:
    """What is known of the drives, as `drive` in `log.yaml` says it.

    Attributes:
        limit: c, beyond which the amplifier saturates: of gain times error; infinite
            if it doesn't.
        gravity_compensation: whether the controller adds what gravity takes, by the
            URDF, as an arm in impedance control does; None: not stated.
        velocity_feedforward: whether the damping acts on the error of the velocity,
            not on the velocity.
    """

    limit: float = np.inf
    gravity_compensation: bool | None = None
    velocity_feedforward: bool = False

    @classmethod
    def of(cls, mapping: Mapping[str, Any], where: str) -> Self:
        """Returns what a mapping says.

        Args:
            mapping: of `log.yaml`.
            where: the file, for messages.

        Raises:
            DisasmError: an unknown key, or a value that can't be.
        """
        for key in mapping:
            if key not in _KEYS:
                remedy = closest(str(key), list(_KEYS))
                raise DisasmError(f"{where}: unknown key 'drive.{key}'; {remedy}")
        limit = mapping.get("limit", np.inf)
        if isinstance(limit, bool) or not isinstance(limit, int | float) or limit <= 0:
            raise DisasmError(
                f"{where}: key 'drive.limit' is {limit!r}; give a number above zero, "
                "the gain times error at which the amplifier saturates"
            )
        switches = {name: mapping[name] for name in _KEYS[1:] if name in mapping}
        for name, value in switches.items():
            if not isinstance(value, bool):
                raise DisasmError(
                    f"{where}: key 'drive.{name}' is {value!r}; give true or false"
                )
        return cls(float(limit), **switches)


@dataclass(frozen=True)
class Inputs:
    """What goes into the drives: (..., joints), of any leading shape.

    Attributes:
        goal: q_d(t - T), commanded positions [rad].
        rate: v_d(t - T), their rate, which the damping allows for [rad/s]; 0 if the
            controller does not.
        gain: g, of the position controller, in its own unit; 1 if none is logged.
        supply: U, the amplifier's voltage [V]; 1 if none is logged.
        enabled: whether the drive is on, 1 or 0.
    """

    goal: Array
    rate: Array
    gain: Array
    supply: Array
    enabled: Array

    def at(self, index: Any) -> "Inputs":
        """Returns the inputs at an index of the leading axes."""
        names = [f.name for f in dataclasses.fields(self)]
        return Inputs(*(getattr(self, name)[index] for name in names))


def joined(parts: Sequence[Inputs]) -> Inputs:
    """Returns the inputs of several parts, one after the other."""
    names = [f.name for f in dataclasses.fields(Inputs)]
    return Inputs(*(np.concatenate([getattr(p, n) for p in parts]) for n in names))


@dataclass(frozen=True)
class Drive:
    """Drives of all joints, for one lane or for many.

    Equation: tau = k U clip(g (q_d(t - T) - q), -c, c) + d (v_d(t - T) - v) while the
    drive is on, else 0, and, if it compensates gravity, what that takes; v_d = 0
    without `velocity_feedforward`. With g = U = 1 this is
    proportional-derivative or joint impedance control. Of a DC motor behind a gear of
    ratio N whose voltage is U times a duty cycle g e, it is k = N k_t / R and
    d = N^2 k_t^2 / R (Duclusaud, Passault, Padois and Ly 2025).

    Attributes:
        stiffness: k (..., joints) [N m/rad per unit of gain and supply].
        damping: d (..., joints) [N m s/rad].
        limit: c.
    """

    stiffness: Array
    damping: Array
    limit: float

    def of(self, lanes: Any) -> "Drive":
        """Returns the drives of some lanes."""
        return Drive(self.stiffness[lanes], self.damping[lanes], self.limit)

    def torque(self, q: Array, v: Array, inputs: Inputs) -> Array:
        """Returns torques (..., joints) at positions and velocities (..., joints)."""
        pull, drag = self.pull(q, inputs), inputs.enabled * (inputs.rate - v)
        return np.asarray(self.stiffness * pull + self.damping * drag)

    def pull(self, q: Array, inputs: Inputs) -> Array:
        """Returns what the stiffness multiplies (..., joints)."""
        duty = np.clip(inputs.gain * (inputs.goal - q), -self.limit, self.limit)
        return np.asarray(inputs.supply * inputs.enabled * duty)

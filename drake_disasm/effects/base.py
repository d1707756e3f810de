"""What an effect is, and the two places where one can act.

An effect is a frozen-in-time description of one physical thing that the
nominal model lacks. It is a dataclass, so a scenario can list it
(`- !SensorBias {fx: 0.5}`) and identification can fit its fields: each field
is a `parameter` with unit, bounds and a default that is its null value, at
which the effect vanishes bit for bit. What it does is a pure function, so the
simulator, identification and closing the loop share the one implementation.
"""

import abc
import dataclasses
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from drake_disasm.quantity import quantity


def parameter(unit: str, low: float, high: float, doc: str) -> Any:
    """Returns a field of an effect; its default and null value is zero."""
    return quantity(0.0, unit, doc, low=low, high=high)


@dataclasses.dataclass(frozen=True)
class Environment:
    """The part of the world that can differ without rebuilding the diagram.

    Attributes:
        X_GnG: pose of the true groove frame in the groove's nominal frame.
        friction: Coulomb coefficient between bolt and groove (static = dynamic).
        modulus, head_modulus: hydroelastic moduli of the bolt's neck and head [Pa].
        dissipation: Hunt-Crossley dissipation of the contact [s/m].
    """

    X_GnG: RigidTransform
    friction: float
    modulus: float
    head_modulus: float
    dissipation: float


@dataclasses.dataclass(frozen=True)
class Sensing:
    """The circumstances of one reading: what a sensor effect may depend on.

    Attributes:
        time: seconds since the episode (or the log) began.
        R_WS: orientation of the sensor in the world.
        g_W: gravity vector, (3,) [m/s^2].
    """

    time: float
    R_WS: RotationMatrix
    g_W: np.ndarray


class Effect:
    """Base of all effects; see the module's docstring."""


class EnvironmentEffect(Effect, abc.ABC):
    """Acts on the world around the bolt."""

    @abc.abstractmethod
    def apply(self, environment: Environment) -> Environment:
        """Returns the environment with this effect in it."""


class SensorEffect(Effect, abc.ABC):
    """Acts on what the force/torque sensor reports."""

    #: Whether zeroing the sensor before an episode sees the effect (a load that
    #: always hangs there) or not (an error that comes up afterwards).
    present_at_zeroing: bool = True

    @abc.abstractmethod
    def apply(self, wrench_S: np.ndarray, sensing: Sensing) -> np.ndarray:
        """Returns the reading with this effect in it.

        Args:
            wrench_S: (6,) [f; tau] the load on the sensor at So in S [N, N m].
            sensing: time and orientation of the reading.
        """

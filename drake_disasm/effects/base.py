"""What an effect is, and the places where one can act.

An effect is a frozen-in-time description of one physical thing that the
nominal model lacks. It is a dataclass, so a scenario can list it
(`- !SensorBias {fx: 0.5}`) and identification can fit its fields: each field
is a `parameter` with unit, bounds and a default that is its null value, at
which the effect vanishes bit for bit; or a `shape`, which says how the effect looks
and not how large it is, a time constant say, and matters only away from null. What
it does is a pure function, so the simulator, identification and closing the loop
share the one implementation.
"""

import abc
import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from drake_disasm.quantity import quantity


def parameter(unit: str, low: float, high: float, doc: str) -> Any:
    """Returns a field of an effect; its default and null value is zero."""
    return quantity(0.0, unit, doc, low=low, high=high)


def shape(
    default: float,
    unit: str,
    low: float,
    high: float,
    doc: str,
    grid: tuple[float, ...],
) -> Any:
    """Returns a field that says how an effect looks; searches begin on its grid."""
    return quantity(default, unit, doc, low=low, high=high, grid=grid)


def sizes(effect: type["Effect"]) -> tuple[str, ...]:
    """Returns the names of an effect's parameters that are zero at null."""
    return tuple(f.name for f in _numbers(effect) if not f.metadata["grid"])


def shapes(effect: type["Effect"]) -> dict[str, tuple[float, ...]]:
    """Returns the names of an effect's shape parameters, each with its grid."""
    return {f.name: f.metadata["grid"] for f in _numbers(effect) if f.metadata["grid"]}


def _numbers(effect: type["Effect"]) -> list[dataclasses.Field]:
    fields = dataclasses.fields(effect)  # type: ignore[arg-type]
    return [f for f in fields if isinstance(f.default, float)]


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
    """The circumstances of readings: what a sensor effect may depend on.

    Of one reading, or of many along leading axes.

    Attributes:
        time: (...,) seconds since the episode (or the log) began.
        R_WS: (..., 3, 3) orientation of the sensor in the world.
        g_W: gravity vector, (3,) [m/s^2].
    """

    time: np.ndarray
    R_WS: np.ndarray
    g_W: np.ndarray

    @property
    def g_S(self) -> np.ndarray:
        """Gravity in the sensor's frame, (..., 3) [m/s^2]."""
        return self.g_W @ self.R_WS


class Effect:
    """Base of all effects; see the module's docstring."""


class EnvironmentEffect(Effect, abc.ABC):
    """Acts on the world around the bolt."""

    @abc.abstractmethod
    def apply(self, environment: Environment) -> Environment:
        """Returns the environment with this effect in it."""


class SensorEffect(Effect, abc.ABC):
    """Acts on what the force/torque sensor reports."""

    #: Where in the chain from load to reading: 0 the load itself, 1 the sensor's
    #: place, 2 its elements, 3 its electronics, 4 its range. Whatever the order of a
    #: scenario's list, effects act in the order of the chain.
    stage: int = 3

    #: Whether zeroing the sensor before an episode sees the effect (a load that
    #: always hangs there) or not (an error that comes up afterwards).
    present_at_zeroing: bool = True

    @abc.abstractmethod
    def apply(self, wrench_S: np.ndarray, sensing: Sensing) -> np.ndarray:
        """Returns readings with this effect in them.

        Args:
            wrench_S: (..., 6) [f; tau] the load on the sensor at So in S [N, N m].
            sensing: time and orientation of the readings.
        """


@dataclasses.dataclass(frozen=True)
class JointSamples:
    """Samples of one joint's motion: what an arm's effect may depend on.

    Attributes:
        q, v, vd: (n,) position, velocity and acceleration [rad, rad/s, rad/s^2].
        load: (n,) torque that the rigid bodies need there [N m].
    """

    q: np.ndarray
    v: np.ndarray
    vd: np.ndarray
    load: np.ndarray


class ArmEffect(Effect, abc.ABC):
    """Acts at one joint of an arm, on the torque that its sensor measures.

    Attributes:
        joint: its name in the URDF.
    """

    joint: str

    @abc.abstractmethod
    def torque(self, samples: JointSamples) -> np.ndarray:
        """Returns what the measured torque has beside the rigid bodies', (n,) [N m]."""


def joint_name() -> Any:
    """Returns the field that names an arm effect's joint."""
    return quantity("", "", "name of the joint in the URDF")


def sensor_chain(effects: Sequence[Effect]) -> tuple[SensorEffect, ...]:
    """Returns the sensor's effects in the order in which they act."""
    chosen = [effect for effect in effects if isinstance(effect, SensorEffect)]
    return tuple(sorted(chosen, key=lambda effect: effect.stage))

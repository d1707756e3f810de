"""Friction and springs that Drake's joints lack, as symbolic expressions."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from pydrake.symbolic import Expression, Variable
from pydrake.symbolic import max as maximum

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import (
    ArmEffect,
    JointAsymmetricFriction,
    JointCoulombFriction,
    JointDahlFriction,
    JointEffect,
    JointLoadFriction,
    JointSamples,
    JointSpring,
    JointStribeckFriction,
    amplitudes,
    shape_parameters,
)

#: Friction that Drake's joints lack.
_DryFriction = (
    JointCoulombFriction
    | JointStribeckFriction
    | JointAsymmetricFriction
    | JointLoadFriction
)
#: Forces that Drake's joints lack, in the order of `JointFriction.parameters`.
IN_JOINTS: tuple[type[ArmEffect], ...] = (
    JointCoulombFriction,
    JointStribeckFriction,
    JointAsymmetricFriction,
    JointSpring,
    JointLoadFriction,
    JointDahlFriction,
)
_TINY = 1e-9  # N m, against 0 / 0


class JointFriction:
    """Symbols of one joint's friction, and of a spring there.

    Attributes:
        q, v: its position and velocity.
        u: the torque of its drive in the step before.
        memory: of pre-sliding friction, up to where the joint is.
        parameters: amplitudes and shape parameters of each of IN_JOINTS.

    Args:
        name: of the joint.
        time_step: of the plant [s].
    """

    def __init__(self, name: str, time_step: float) -> None:
        self._name, self._time_step = name, time_step
        self.q, self.v, self.u, self.memory = (
            Variable(f"{name}.{symbol}") for symbol in ("q", "v", "u", "memory")
        )
        self.parameters: list[Variable] = []
        self._by_motion: list[JointEffect] = []
        for kind in IN_JOINTS:
            symbols = {
                n: Variable(f"{name}.{kind.__name__}.{n}") for n in _numbers(kind)
            }
            self.parameters += symbols.values()
            effect = kind(**symbols)
            if isinstance(effect, JointDahlFriction):
                self._pre_sliding = effect
            elif isinstance(effect, JointEffect):
                self._by_motion.append(effect)

    def applied(self) -> Expression:
        """Returns the force on the joint: against its friction's measured torque.

        Of the drive's torque u, friction by load g |L|, g odd in v, leaves the load
        L: u = L + g |L|, so that g |L| = g u^2 / (|u| + g u), at most 2 g |u|: a gear
        near self-locking would be stiffer than a step can follow. (What the other
        frictions take off u is left in L: friction of friction.)
        """
        *without_load, by_load = self._by_motion
        torque = self._pre_sliding.torque(Expression(self.memory))
        torque += sum(_torque(e, self.q, self.v, 0.0) for e in without_load)
        g, u = _torque(by_load, self.q, self.v, 1.0), Expression(self.u)
        share = maximum(abs(u) + g * u, 0.5 * abs(u)) + _TINY
        return -torque - g * u * u / share

    def remembered(self) -> Expression:
        """Returns the memory of pre-sliding friction after a step, which ends with v.

        Drake's discrete steps move a joint by the velocity at their end, and the
        plant's state is updated before the memory is.
        """
        before = np.array([Expression(self.memory)])
        displacement = np.array([self._time_step * self.v])
        with np.errstate(all="ignore"):  # symbols are NaN on the way
            return self._pre_sliding.remember(before, displacement)[0]

    def values(self, effects: Sequence[ArmEffect], wider: float) -> list[float]:
        """Returns the values of `parameters`.

        Args:
            effects: at this joint.
            wider: factor on their `creep`.

        Raises:
            DisasmError: two effects are of one kind.
        """
        values = []
        for kind in IN_JOINTS:
            of_kind = [e for e in effects if isinstance(e, kind)] or [kind()]
            if len(of_kind) > 1:
                raise DisasmError(
                    f"{kind.__name__}: acts twice on {self._name}; the cell takes one "
                    "of a kind per joint, merge them"
                )
            effect = of_kind[0]
            if isinstance(effect, _DryFriction):
                effect = dataclasses.replace(effect, creep=wider * effect.creep)
            values += [getattr(effect, name) for name in _numbers(kind)]
        return values


def steepest_slope(effects: Sequence[ArmEffect], load: float) -> float:
    """Returns how steep friction is [N m s/rad], at most, under a load [N m]."""
    slope = 0.0
    for effect in effects:
        if isinstance(effect, _DryFriction):
            v = effect.creep * np.linspace(-5.0, 5.0, 1001)
            samples = JointSamples(0.0 * v, v, 0.0 * v, np.full_like(v, load))
            slope += np.abs(np.gradient(effect.torque(samples), v)).max()
    return slope


def _numbers(kind: type[ArmEffect]) -> list[str]:
    """Returns the names of a kind's amplitudes and shape parameters."""
    return [*amplitudes(kind), *shape_parameters(kind)]


def _torque(effect: JointEffect, q: Variable, v: Variable, load: float) -> Expression:
    """Returns a joint effect's own equation in symbols."""
    none, *motion = (np.array([Expression(symbol)]) for symbol in (0.0, q, v))
    samples = JointSamples(motion[0], motion[1], none, none + load)
    with np.errstate(all="ignore"):  # symbols are NaN on the way
        return effect.torque(samples)[0]

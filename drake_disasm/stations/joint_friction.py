"""Friction in a joint that Drake's joints lack, as symbolic expressions."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from pydrake.symbolic import Expression, Variable
from pydrake.symbolic import max as maximum

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import (
    JointAsymmetricFriction,
    JointCoulombFriction,
    JointEffect,
    JointLoadFriction,
    JointSamples,
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
#: The same, in the order of `JointFriction.parameters`.
DRY_FRICTION: tuple[type[_DryFriction], ...] = (
    JointCoulombFriction,
    JointStribeckFriction,
    JointAsymmetricFriction,
    JointLoadFriction,
)
_TINY = 1e-9  # N m, against 0 / 0


class JointFriction:
    """Symbols of one joint's friction.

    Attributes:
        v, u: its velocity, and the torque of its drive in the step before.
        parameters: amplitudes and shape parameters of each of DRY_FRICTION.

    Args:
        name: of the joint.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self.v, self.u = Variable(f"{name}.v"), Variable(f"{name}.u")
        self._effects: list[JointEffect] = []
        self.parameters: list[Variable] = []
        for kind in DRY_FRICTION:
            symbols = {
                n: Variable(f"{name}.{kind.__name__}.{n}") for n in _numbers(kind)
            }
            self._effects.append(kind(**symbols))
            self.parameters += symbols.values()

    def applied(self) -> Expression:
        """Returns the force on the joint: against its friction's measured torque.

        Of the drive's torque u, friction by load g |L|, g odd in v, leaves the load
        L: u = L + g |L|, so that g |L| = g u^2 / (|u| + g u), at most 2 g |u|: a gear
        near self-locking would be stiffer than a step can follow. (What the other
        frictions take off u is left in L: friction of friction.)
        """
        *dry, by_load = self._effects
        friction = sum((_torque(e, self.v, 0.0) for e in dry), Expression(0.0))
        g, u = _torque(by_load, self.v, 1.0), Expression(self.u)
        share = maximum(abs(u) + g * u, 0.5 * abs(u)) + _TINY
        return -friction - g * u * u / share

    def values(self, effects: Sequence[JointEffect], wider: float) -> list[float]:
        """Returns the values of `parameters`.

        Args:
            effects: at this joint.
            wider: factor on their `creep`.

        Raises:
            DisasmError: two effects are of one kind.
        """
        values = []
        for kind in DRY_FRICTION:
            found = [e for e in effects if isinstance(e, kind)] or [kind()]
            if len(found) > 1:
                raise DisasmError(
                    f"{kind.__name__}: acts twice on {self._name}; the cell takes one "
                    "of a kind per joint, merge them"
                )
            wide = dataclasses.replace(found[0], creep=wider * found[0].creep)
            values += [getattr(wide, name) for name in _numbers(kind)]
        return values


def steepest_slope(effects: Sequence[JointEffect], load: float) -> float:
    """Returns how steep friction is [N m s/rad], at most, under a load [N m]."""
    slope = 0.0
    for effect in effects:
        if isinstance(effect, _DryFriction):
            v = effect.creep * np.linspace(-5.0, 5.0, 1001)
            samples = JointSamples(0.0 * v, v, 0.0 * v, np.full_like(v, load))
            slope += np.abs(np.gradient(effect.torque(samples), v)).max()
    return slope


def _numbers(kind: type[JointEffect]) -> list[str]:
    """Returns the names of a kind's amplitudes and shape parameters."""
    return [*amplitudes(kind), *shape_parameters(kind)]


def _torque(effect: JointEffect, v: Variable, load: float) -> Expression:
    """Returns a joint effect's own equation in symbols."""
    none = np.array([Expression(0.0)])
    samples = JointSamples(none, np.array([Expression(v)]), none, none + load)
    with np.errstate(all="ignore"):  # symbols are NaN on the way
        return effect.torque(samples)[0]

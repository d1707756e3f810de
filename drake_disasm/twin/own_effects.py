"""Effects on the environment whose equation is of numbers, not of arrays."""

import dataclasses
import functools
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from drake_disasm.common.rotations import Pose
from drake_disasm.effects import BoltMotion, Environment, EnvironmentEffect
from drake_disasm.twin.probe import takes_arrays
from drake_disasm.twin.slots import Slot
from drake_disasm.twin.stacking import rows_of


def with_effect(
    effect: EnvironmentEffect, environment: Environment, motion: BoltMotion
) -> Environment:
    """Returns n environments with an effect in them.

    At once, if its equation takes arrays; an effect of a user's own that does not is
    applied to one after the other.

    Args:
        effect: of n environments.
        environment: one for all, or n.
        motion: (n, 3) each.
    """
    if _takes_arrays(type(effect)):
        return effect.apply(environment, motion)
    found = [
        rows_of(effect, i).apply(_row(environment, i), rows_of(motion, i))
        for i in range(len(motion.p))
    ]
    values = {
        field.name: _stacked([getattr(each, field.name) for each in found])
        for field in dataclasses.fields(Environment)
    }
    return Environment(**values)


@functools.cache
def _takes_arrays(kind: type[EnvironmentEffect]) -> bool:
    return takes_arrays(Slot.of(kind()), np.zeros(0))


def _row(environment: Environment, i: int) -> Environment:
    """Returns one of n environments, with Drake's pose."""
    X_GnG = environment.X_GnG
    if isinstance(X_GnG, Pose):
        X_GnG = (Pose(X_GnG.R[i], X_GnG.p[i]) if X_GnG.p.ndim > 1 else X_GnG).to_drake()
    force = environment.force_Gn
    numbers = {
        field.name: _number(getattr(environment, field.name), i)
        for field in dataclasses.fields(environment)
        if field.name not in ("X_GnG", "force_Gn")
    }
    pull = (_number(force[0], i), _number(force[1], i), _number(force[2], i))
    return Environment(X_GnG=X_GnG, force_Gn=pull, **numbers)


def _number(value: Any, i: int) -> float:
    return float(value[i] if getattr(value, "ndim", 0) else value)


def _stacked(values: list[Any]) -> Any:
    """Returns one field of n environments."""
    if isinstance(values[0], RigidTransform):
        R = np.array([X.rotation().matrix() for X in values])
        return Pose(R, np.array([X.translation() for X in values]))
    if isinstance(values[0], tuple):
        return tuple(np.array(values, dtype=np.float64).T)
    return np.array(values, dtype=np.float64)

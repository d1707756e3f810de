"""Whether the equations of users' own effects take arrays."""

from collections.abc import Sequence

import numpy as np

from drake_disasm.common.arrays import Array, array_like, to_numpy
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.rotations import Pose, rotation_matrices
from drake_disasm.effects import (
    BoltMotion,
    Effect,
    Environment,
    EnvironmentEffect,
    MotionEffect,
    Sensing,
    SensorEffect,
    SensorMemoryEffect,
)
from drake_disasm.twin.slots import Slot
from drake_disasm.twin.stacking import leaves_of, rows_of, shared

_OWN = "drake_disasm."  # effects of the library, which tests hold against the diagram
_PLACES = np.array([[0.01, 1e-3, -2e-3], [0.03, -1e-3, 1e-3]])
_WRENCHES = np.array([[3.0, -2.0, 1.0, 0.1, 0.2, -0.3], [-1.0, 4.0, 2.0, 0.3, 0.1, 0]])
_TWO = np.array([1.0, 1.1])
_MOTION = BoltMotion(_PLACES, 0.3 * _PLACES, 0.4 * _TWO)
_ENVIRONMENT = Environment(
    X_GnG=Pose(np.stack([np.eye(3)] * 2), 0.1 * _PLACES),
    friction=0.2 * _TWO,
    modulus=1e9 * _TWO,
    head_modulus=1e8 * _TWO,
    dissipation=20.0 * _TWO,
    clearance=4e-4 * _TWO,
    impact_stiffness=1e3 * _TWO,
    impact_exponent=_TWO,
    force_Gn=(_TWO, 2.0 * _TWO, 3.0 * _TWO),
    detent=0.2 * _TWO,
)
_SENSING = Sensing(
    0.3 * _TWO,
    rotation_matrices(10.0 * _PLACES),
    np.tile([0.0, 0.0, -9.81], (2, 1)),
    np.ones((2, 1)),
    np.tile([0.0, 0.0, 0.1], (2, 1)),
)


def refuse_scalar_effects(slots: Sequence[Slot], like: Array) -> None:
    """Refuses effects whose equation does not take a row for each of n environments.

    Args:
        slots: of a batch.
        like: an array of the kind with which it computes.

    Raises:
        DisasmError: names the first, and what it would need.
    """
    for slot in slots:
        reason = "" if slot.kind.__module__.startswith(_OWN) else _reason(slot, like)
        if reason:
            raise DisasmError(
                f"{slot.kind.__name__}: its equation takes no arrays, which a batch "
                f"needs ({reason}); write it with drake_disasm.common.arrays as those "
                "of the library, or simulate the diagram's twin"
            )


def _reason(slot: Slot, like: Array) -> str:
    """Returns what goes wrong with arrays; empty if nothing does."""
    fields = slot.kind.__dataclass_fields__
    noticeable = [
        null + 0.3 * (fields[name].metadata["high"] - null)
        for name, null in zip(slot.names, slot.null, strict=True)
    ]
    values = array_like(np.array([slot.null, noticeable]), like)
    try:
        both = _results(slot.effect(values), slice(None), like)
        for row in (slice(0, 1), slice(1, 2)):
            alone = _results(slot.effect(values[row]), row, like)
            for one, two in zip(alone, both, strict=True):
                there = np.broadcast_to(to_numpy(two), (2, *np.shape(one)[1:]))[row]
                if not np.allclose(to_numpy(one), there, rtol=1e-6, atol=1e-9):
                    return "with two environments it gives something else than with one"
    except Exception as error:  # whatever a user's equation does with arrays
        return " ".join(f"{type(error).__name__}: {error}".split())[:200]
    return ""


def _results(effect: Effect, rows: slice, like: Array) -> list[Array]:
    """Returns what an effect makes of one or both of two inputs."""
    wrench = array_like(_WRENCHES, like)[rows]
    environment = rows_of(shared(_ENVIRONMENT, like), rows)
    motion = rows_of(shared(_MOTION, like), rows)
    sensing = rows_of(shared(_SENSING, like), rows)
    if isinstance(effect, EnvironmentEffect):
        return leaves_of(effect.apply(environment, motion))
    if isinstance(effect, MotionEffect):
        return [*effect.execute(0.01 * wrench, wrench, 0.009 * wrench, 0.1)]
    if not isinstance(effect, SensorEffect):
        return []
    results = [effect.apply(wrench, effect.circumstances(sensing))]
    if isinstance(effect, SensorMemoryEffect):
        memory = effect.remember(effect.begin(wrench), 1.5 * wrench, 0.01)
        results += [memory, effect.read(wrench, memory)]
    return results

"""Tries whether an effect's equation takes arrays, for effects of users' own."""

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
from drake_disasm.twin.stacking import leaves_of

_OWN = "drake_disasm."  # effects of the library, which tests hold against the diagram
_PLACES = np.array([[0.01, 1e-3, -2e-3], [0.03, -1e-3, 1e-3]])
_WRENCHES = np.array([[3.0, -2.0, 1.0, 0.1, 0.2, -0.3], [-1.0, 4.0, 2.0, 0.3, 0.1, 0]])


def refuse_scalar_effects(slots: list[Slot], like: Array) -> None:
    """Refuses effects whose equation is not that of arrays.

    Args:
        slots: of a batch.
        like: an array of the kind with which it computes.

    Raises:
        DisasmError: names the first, and what it would need.
    """
    for slot in slots:
        reason = _reason(slot, like)
        if reason:
            raise DisasmError(
                f"{slot.kind.__name__}: its equation takes no arrays, which a batch "
                f"needs ({reason}); write it with drake_disasm.common.arrays as those "
                "of the library, or simulate the diagram's twin"
            )


def takes_arrays(slot: Slot, like: Array) -> bool:
    """Returns whether an effect's equation is that of arrays."""
    return not _reason(slot, like)


def _reason(slot: Slot, like: Array) -> str:
    """Returns what goes wrong with arrays; empty if nothing does."""
    if slot.kind.__module__.startswith(_OWN):
        return ""
    values = np.array([slot.null, _noticeable(slot)])
    try:
        together = _results(slot.effect(array_like(values, like)), like, None)
    except Exception as error:  # whatever a user's equation does with arrays
        return " ".join(f"{type(error).__name__}: {error}".split())[:200]
    for row in range(2):
        numbers = dict(zip(slot.names, values[row].tolist(), strict=True))
        alone = _results(slot.kind(**dict(slot.fixed), **numbers), np.zeros(0), row)
        for one, both in zip(alone, together, strict=True):
            found = np.broadcast_to(to_numpy(both), (2, *np.shape(one)))[row]
            if not np.allclose(found, one, rtol=1e-6, atol=1e-9):
                return "with arrays it gives something else than with numbers"
    return ""


def _noticeable(slot: Slot) -> list[float]:
    fields = slot.kind.__dataclass_fields__
    return [
        null + 0.3 * (fields[name].metadata["high"] - null)
        for name, null in zip(slot.names, slot.null, strict=True)
    ]


def _results(effect: Effect, like: Array, row: int | None) -> list[Array]:
    """Returns what an effect makes of two inputs, or of one of them by number."""
    which = slice(None) if row is None else row

    def given(values: np.ndarray) -> Array:
        """Returns inputs of the kind that is wanted."""
        return array_like(values[which], like)

    if isinstance(effect, EnvironmentEffect):
        pose = Pose(given(np.stack([np.eye(3)] * 2)), given(0.1 * _PLACES))
        X_GnG = pose if row is None else pose.to_drake()

        def each(value: float) -> float | Array:
            """Returns a quantity, somewhat larger in the second environment."""
            found = given(np.array([value, 1.1 * value]))
            return found if found.ndim else float(found)

        environment = Environment(
            X_GnG=X_GnG,
            friction=each(0.2),
            modulus=each(1e9),
            head_modulus=each(1e8),
            dissipation=each(20.0),
            clearance=each(4e-4),
            impact_stiffness=each(1e3),
            impact_exponent=each(1.0),
        )
        bolt = BoltMotion(given(_PLACES), given(0.3 * _PLACES), each(0.4))
        return leaves_of(effect.apply(environment, bolt))
    if isinstance(effect, MotionEffect):
        pose_vector, memory = given(0.01 * _WRENCHES), given(0.009 * _WRENCHES)
        return [*effect.execute(pose_vector, given(_WRENCHES), memory, 0.1)]
    if not isinstance(effect, SensorEffect):
        return []
    R_WS = rotation_matrices(10.0 * _PLACES)
    g_W = array_like(np.array([0.0, 0.0, -9.81]), like)
    p_SoScm_S = array_like(np.array([0.0, 0.0, 0.1]), like)
    sensing = Sensing(given(np.array([0.3, 0.7])), given(R_WS), g_W, 1.0, p_SoScm_S)
    load = given(_WRENCHES)
    found = [effect.apply(load, effect.circumstances(sensing))]
    if isinstance(effect, SensorMemoryEffect):
        memory = effect.remember(effect.begin(load), 1.5 * load, 0.01)
        found += [memory, effect.read(load, memory)]
    return found

"""What a motion tells of an arm's parameters and of effects, before it is recorded."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.effects import (
    ArmEffect,
    DelayEffect,
    Effect,
    Reach,
    amplitudes,
    registered_effects,
)
from sysid.confidence import Z
from sysid.models.arm_motion import IN_TORQUES, ArmMotion
from sysid.models.effects import at_null
from sysid.models.regressor import ArmRegressor, base_set

Array = NDArray[np.float64]

_STEP = 1e-3  # SI, of an amplitude: torques are linear in it, but for shifts in time
_RIDGE = 1e-9  # of the diagonal: what a motion does not show at all is not infinite


@dataclasses.dataclass(frozen=True)
class Unknown:
    """A quantity that recordings are to reveal.

    Attributes:
        name: of the base parameter, or of the effect's amplitude.
        unit: of it.
        value: by the URDF; zero for an effect.
        is_effect: whether it is an effect's amplitude.
    """

    name: str
    unit: str
    value: float
    is_effect: bool = False


class ArmExperiment:
    """An arm of a URDF whose base parameters and effects a motion is to show.

    Attributes:
        joints: their names.
        unknowns: base parameters, then effects' amplitudes.

    Args:
        urdf: a path, or `package://`.
        joints: names of the joints that move.
        kinds: names of effects, each at every joint where it can act.
        noise: (joints,) standard deviation of each joint's torque.
        duration: of the motion [s].
        separate: names of two effects that a motion is to tell apart, before it is to
            show all else.

    Raises:
        DisasmError: there is no such effect of arms.
    """

    def __init__(
        self,
        urdf: str,
        joints: Sequence[str],
        kinds: Sequence[str],
        noise: Array,
        duration: float,
        separate: tuple[str, str] | None = None,
    ) -> None:
        self.joints, self._separate = tuple(joints), separate
        if separate:
            kinds = [*kinds, *separate]
        self._arm = ArmRegressor(urdf, joints)
        self._base = base_set(self._arm.random_regressor())
        self._noise = noise
        self._amplitudes = _amplitudes(kinds, self.joints, duration)
        self._beta = self._base.beta(self._arm.inertia)
        names, units = self._arm.names, self._arm.units
        self.unknowns = tuple(
            Unknown(names[i], units[i], float(value))
            for i, value in zip(self._base.independent, self._beta, strict=True)
        ) + tuple(
            Unknown(f"{_name(effect)}.{field}", _unit(effect, field), 0.0, True)
            for effect, field in self._amplitudes
        )

    def torques(self, q: Array, v: Array, vd: Array) -> Array:
        """Returns the torques (n, joints) of the URDF's rigid bodies."""
        return self._arm.torques(q, v, vd)

    def columns(self, time: Array, q: Array, v: Array, vd: Array) -> Array:
        """Returns derivatives (n, joints, unknowns) of torques by the unknowns.

        Args:
            time: (n,) [s].
            q, v, vd: (n, joints).
        """
        episode = {"time": time, "q": q, "v": v, "vd": vd}
        motion = ArmMotion.of(self._arm, self._base, self.joints, [episode])
        still = motion.torques(self._beta, [])
        of_effects = [
            (self._with(motion, still, effect, field) - still) / _STEP
            for effect, field in self._amplitudes
        ]
        return np.concatenate([motion.Y, *(c[..., None] for c in of_effects)], axis=-1)

    def _with(
        self, motion: ArmMotion, still: Array, effect: ArmEffect, field: str
    ) -> Array:
        changed = dataclasses.replace(effect, **{field: _STEP})
        if isinstance(changed, DelayEffect):
            return motion.shifted(still, [changed])
        return motion.torques(self._beta, [changed])

    def information(self, columns: Array, rows: int) -> Array:
        """Returns the information matrix (unknowns, unknowns) of a recording.

        Args:
            columns: of samples spread evenly over the motion.
            rows: of the recording, its noise white.
        """
        scaled = (columns / self._noise[:, None]).reshape(-1, columns.shape[-1])
        return np.asarray(scaled.T @ scaled * (rows / len(columns)))

    def criterion(self, information: Array) -> float:
        """Returns how little a recording tells: least is best."""
        if self._separate is None:
            return uncertainty_of(information)
        kinds = [""] * (len(self.unknowns) - len(self._amplitudes))
        kinds += [type(effect).__name__ for effect, _ in self._amplitudes]
        return confusion_of(information, [np.array(kinds) == k for k in self._separate])

    @property
    def criterion_name(self) -> str:
        """What `criterion` is, in words."""
        if self._separate is None:
            return "-log det / unknown"
        one, other = self._separate
        return f"-log det / unknown of what separates {one} and {other}"

    def spreads(self, information: Array) -> Array:
        """Returns half the 95 % interval (unknowns,) of each unknown."""
        size = np.sqrt(np.maximum(np.diagonal(information), 1e-300))
        scaled = information / np.outer(size, size) + _RIDGE * np.eye(len(size))
        return np.asarray(Z * np.sqrt(np.diagonal(np.linalg.inv(scaled))) / size)


def uncertainty_of(information: Array) -> float:
    """Returns -log det of an information matrix, per unknown: least is best.

    D-optimality: half of it is the mean logarithm of the axes of the confidence
    ellipsoid, and units change it by a constant alone (Swevers et al. 1997).
    """
    size = len(information)
    ridge = _RIDGE * np.diag(np.maximum(np.diagonal(information), 1e-300))
    return float(-np.linalg.slogdet(information + ridge)[1] / size)


def confusion_of(information: Array, kinds: Sequence[NDArray[np.bool_]]) -> float:
    """Returns how badly some effects are told from each other: least is best.

    -log det of what each effect's amplitudes do that neither base parameters nor the
    other effects can do in their place, per amplitude: D_s-optimality, which for models
    that are linear in what tells them apart is T-optimality (Atkinson and Fedorov, "The
    design of experiments for discriminating between two rival models", 1975).

    Args:
        information: matrix (unknowns, unknowns).
        kinds: of each effect, which unknowns are its amplitudes (unknowns,).
    """
    size = len(information)
    whole = size * uncertainty_of(information)
    found = 0.0
    for kind in kinds:
        rest = information[np.ix_(~kind, ~kind)]
        found += whole - len(rest) * uncertainty_of(rest)
    return float(found / sum(int(kind.sum()) for kind in kinds))


def condition_of(information: Array) -> float:
    """Returns the condition number of the regressor, its columns scaled to one length.

    So that units change nothing. By the eigenvalues of the information matrix.
    """
    size = np.sqrt(np.maximum(np.diagonal(information), 1e-300))
    eigenvalues = np.linalg.eigvalsh(information / np.outer(size, size))
    least = max(float(eigenvalues[0]), _RIDGE)
    return float(np.sqrt(eigenvalues[-1] / least))


def arm_effects() -> dict[str, type[Effect]]:
    """Returns the effects of arms that a motion can be designed for, by name."""
    return {
        kind.__name__: kind
        for kind in registered_effects()
        if issubclass(kind, IN_TORQUES) and kind.is_physical
    }


def _amplitudes(
    kinds: Sequence[str], joints: tuple[str, ...], duration: float
) -> list[tuple[ArmEffect, str]]:
    """Returns effects at null, in their first shape, with each of their amplitudes."""
    known = arm_effects()
    found: dict[str, ArmEffect] = {}
    for name in kinds:
        if name not in known:
            remedy = closest(name, list(known))
            raise DisasmError(f"effect {name}: no arm's torques show it; {remedy}")
        for effect in at_null(known[name], joints, Reach(duration)):
            assert isinstance(effect, ArmEffect)
            found.setdefault(_name(effect), effect)
    return [(e, field) for e in found.values() for field in amplitudes(type(e))]


def _name(effect: ArmEffect) -> str:
    joint = getattr(effect, "joint", "")
    return f"{type(effect).__name__}.{joint}" if joint else type(effect).__name__


def _unit(effect: ArmEffect, field: str) -> str:
    fields = {f.name: f for f in dataclasses.fields(effect)}
    return str(fields[field].metadata["unit"])

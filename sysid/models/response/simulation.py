"""An arm behind its drives, simulated for many parameter sets and segments at once."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_disasm.effects import (
    ArmEffect,
    ArmSamples,
    ArmTilt,
    ArmTorqueEffect,
    FlangePayload,
)
from sysid.models.base import Array
from sysid.models.response.drive import Drive, Inputs
from sysid.models.response.integrator import STAGES, Motion, integrate
from sysid.models.response.rigid_bodies import RigidBodies, RigidBodyTerms
from sysid.models.response.segments import Segment

#: Effects that change the rigid bodies themselves.
ON_BODIES = (FlangePayload, ArmTilt)


@dataclass(frozen=True)
class Arm:
    """What all parameter sets share.

    Attributes:
        joints: their names.
        bodies: by the URDF.
        compensates: whether the controller adds what gravity takes.
    """

    joints: tuple[str, ...]
    bodies: RigidBodies
    compensates: bool


@dataclass(frozen=True)
class ParameterSet:
    """What distinguishes one simulation from another.

    Attributes:
        drive: of the joints, its arrays (joints,).
        delay: of the goal [s].
        effects: on the arm, the same classes in all sets.
    """

    drive: Drive
    delay: float
    effects: tuple[ArmEffect, ...]


@dataclass(frozen=True)
class _Terms(RigidBodyTerms):
    """Rigid bodies, and what the controller adds (lanes, joints)."""

    added: Array


def simulate(
    arm: Arm,
    sets: Sequence[ParameterSet],
    segments: Sequence[Segment],
    steps: int,
    h: float,
) -> Motion:
    """Returns how the arm moves: q and v of (steps + 1, sets, segments, joints).

    Args:
        arm: which.
        sets: simulated side by side.
        segments: the same for each set.
        steps: as many for each.
        h: of a step [s].
    """
    shape = (len(sets), len(segments), len(arm.joints))
    q, v = (
        np.broadcast_to([getattr(s, name) for s in segments], shape).reshape(
            -1, shape[2]
        )
        for name in ("q", "v")
    )
    motion = integrate(
        q, v, steps, h, _terms(arm, sets), _missing(arm, sets, segments, steps, h)
    )
    return Motion(*(a.reshape(steps + 1, *shape) for a in (motion.q, motion.v)))


def _terms(arm: Arm, sets: Sequence[ParameterSet]) -> Callable[[Array, Array], _Terms]:
    """Returns what gives the rigid bodies of all lanes (sets segments, joints)."""
    on_bodies = [[e for e in s.effects if isinstance(e, ON_BODIES)] for s in sets]
    groups = on_bodies if any(on_bodies) else [[]]

    def terms(q: Array, v: Array) -> _Terms:
        """Returns those of positions and velocities (lanes, joints)."""
        parts = [
            arm.bodies.terms(own_q, own_v, effects)
            for own_q, own_v, effects in zip(
                np.split(q, len(groups)), np.split(v, len(groups)), groups, strict=True
            )
        ]
        added = arm.bodies.holding(q) if arm.compensates else np.zeros_like(q)
        return _Terms(
            np.concatenate([part.M for part in parts]),
            np.concatenate([part.bias for part in parts]),
            added,
        )

    return terms


def _missing(
    arm: Arm,
    sets: Sequence[ParameterSet],
    segments: Sequence[Segment],
    steps: int,
    h: float,
) -> Callable[[Array, Array, Array, _Terms, int, int], Array]:
    """Returns what gives the torques that are missing for accelerations."""
    inputs = _inputs(sets, segments, steps, h)
    drive = Drive(
        np.repeat([s.drive.stiffness for s in sets], len(segments), axis=0),
        np.repeat([s.drive.damping for s in sets], len(segments), axis=0),
        sets[0].drive.limit,
    )
    effects = _stacked([s.effects for s in sets], len(segments))

    def missing(
        q: Array, v: Array, a: Array, terms: _Terms, step: int, stage: int
    ) -> Array:
        """Returns load and friction minus the drives' torque (lanes, joints)."""
        load = terms.load(a)
        given = inputs.at((step, stage))
        torque = drive.torque(q, v, given) + given.enabled * terms.added
        samples = ArmSamples(arm.joints, q, v, a, load)
        needed = load
        for effect in effects:
            needed = needed + effect.torques(samples)
        return np.asarray(needed - torque)

    return missing


def _inputs(
    sets: Sequence[ParameterSet], segments: Sequence[Segment], steps: int, h: float
) -> Inputs:
    """Returns the drives' inputs, (steps, stages, sets segments, joints) each."""
    after = h * (np.arange(steps)[:, None] + np.array(STAGES))
    delays, which = np.unique([s.delay for s in sets], return_inverse=True)
    lanes = {
        (number, delay): segment.inputs_at(segment.start + after, delay)
        for number, segment in enumerate(segments)
        for delay in delays
    }
    order = [lanes[n, delays[w]] for w in which for n in range(len(segments))]
    names = [f.name for f in dataclasses.fields(Inputs)]
    return Inputs(*(np.stack([getattr(i, n) for i in order], axis=2) for n in names))


def _stacked(
    sets: Sequence[tuple[ArmEffect, ...]], segments: int
) -> list[ArmTorqueEffect]:
    """Returns the effects of all sets with fields (sets segments,), for all lanes."""
    found = []
    for alternatives in zip(*sets, strict=True):
        first = alternatives[0]
        if not isinstance(first, ArmTorqueEffect):
            continue
        if all(effect.is_null for effect in alternatives):
            continue
        numbers = {
            f.name: np.repeat([getattr(e, f.name) for e in alternatives], segments)
            for f in dataclasses.fields(first)
            if isinstance(f.default, float)
        }
        found.append(dataclasses.replace(first, **numbers))
    return found


def positions_at(
    motion: Motion, h: float, after: Array, segment: NDArray[np.int64]
) -> Array:
    """Returns positions (sets, rows, joints) between steps, by Hermite's cubic.

    Args:
        motion: (steps + 1, sets, segments, joints).
        h: of a step [s].
        after: (rows,) times since the begin of each row's segment [s].
        segment: (rows,) numbers.
    """
    last = motion.q.shape[0] - 2
    step = np.clip((after / h).astype(np.int64), 0, last)
    s = (after / h - step)[:, None, None]
    q, v = ([a[step + k, :, segment] for k in (0, 1)] for a in (motion.q, motion.v))
    found = (
        (1.0 + 2.0 * s) * (1.0 - s) ** 2 * q[0]
        + s * (1.0 - s) ** 2 * h * v[0]
        + s**2 * (3.0 - 2.0 * s) * q[1]
        + s**2 * (s - 1.0) * h * v[1]
    )
    return np.asarray(found.swapaxes(0, 1))

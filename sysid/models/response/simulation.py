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
    FlangePayload,
)
from sysid.models.base import Array
from sysid.models.response.drive import Drive, Inputs
from sysid.models.response.gears import Gears
from sysid.models.response.integrator import (
    STAGES,
    Lanes,
    Missing,
    Motion,
    integrate,
)
from sysid.models.response.lane_effects import torques_in_lanes
from sysid.models.response.memories import Memories
from sysid.models.response.near_motion import Bodies, BodyTerms, Expansion
from sysid.models.response.segments import Segment

#: Effects that change the rigid bodies themselves.
ON_BODIES = (FlangePayload, ArmTilt)


@dataclass(frozen=True)
class Arm:
    """What all parameter sets share.

    Attributes:
        joints: their names.
        bodies: of the URDF.
    """

    joints: tuple[str, ...]
    bodies: Bodies


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


def simulate(
    arm: Arm,
    sets: Sequence[ParameterSet],
    segments: Sequence[Segment],
    steps: int,
    h: float,
) -> Motion:
    """Returns how the motors move: q and v of (steps + 1, sets, segments, joints).

    Args:
        arm: which.
        sets: simulated side by side.
        segments: the same for each set.
        steps: as many for each.
        h: of a step [s].
    """
    shape = (len(sets), len(segments), len(arm.joints))
    q, v, vd = (
        np.broadcast_to([getattr(s, name) for s in segments], shape).reshape(
            -1, shape[2]
        )
        for name in ("q", "v", "vd")
    )
    gears = Gears.of(arm.joints, [s.effects for s in sets]).repeated(len(segments))
    memories = Memories.of(arm.joints, [s.effects for s in sets], segments)
    of_lanes = (arm, gears, sets, segments, steps, h)
    terms, missing = _terms(*of_lanes), _missing(*of_lanes, memories)
    if gears.any:
        load, rate = _loads_at_begin(gears, (q, v, vd), h, terms, missing)
        q, v = gears.start(q, v, load, rate)
    motion = integrate(q, v, steps, h, terms, missing, memories.remember)
    motors = (gears.motors(x) for x in (motion.q, motion.v))
    return Motion(*(x.reshape(steps + 1, *shape) for x in motors))


def _loads_at_begin(
    gears: Gears,
    state: tuple[Array, Array, Array],
    h: float,
    terms: Callable[[Array, Array, int], BodyTerms],
    missing: Missing[BodyTerms],
) -> tuple[Array, Array]:
    """Returns the loads of the gears, and their rates (lanes, joints), at the begin.

    Loads are what the drives give, less friction: a measured acceleration is too noisy
    to say what the bodies need. It will do for the rate.

    Args:
        gears: of the lanes.
        state: (lanes, joints) positions, velocities and accelerations, as measured.
        h: of a step [s].
        terms, missing: of the lanes, see `integrate`.
    """
    q, v, vd = state
    needed, passed = [], []
    for stage, share in enumerate(STAGES):
        dt = share * h
        at, rates = (gears.with_links(x) for x in (q + dt * v, v + dt * vd))
        bodies = terms(at, rates, 0)
        short = missing(at, rates, gears.with_links(vd), bodies, 0, stage, slice(None))
        needed.append(bodies.load(vd))
        passed.append(needed[-1] - gears.motors(short))
    between = STAGES[1] - STAGES[0]
    rate = (needed[1] - needed[0]) / (between * h)
    return passed[0] - (passed[1] - passed[0]) * STAGES[0] / between, rate


def _terms(
    arm: Arm,
    gears: Gears,
    sets: Sequence[ParameterSet],
    segments: Sequence[Segment],
    steps: int,
    h: float,
) -> Callable[[Array, Array, int], BodyTerms]:
    """Returns what gives the rigid bodies of all lanes (sets segments, joints).

    Those are where the links are.
    """
    shape = (len(sets), len(segments), len(arm.joints))
    expansion = _expansion(arm.bodies, segments, steps, h)
    on_bodies = [
        [e for e in s.effects if isinstance(e, ON_BODIES) and not e.is_null]
        for s in sets
    ]
    is_loaded = np.array([bool(effects) for effects in on_bodies])[:, None]

    def terms(q: Array, v: Array, step: int) -> BodyTerms:
        """Returns those of coordinates and rates (lanes, joints + e) in a step."""
        q, v = (gears.links(x).reshape(shape) for x in (q, v))
        if expansion:
            found, far = expansion.at(step, q, v)
        else:
            found, far = BodyTerms.zeros(*shape), np.ones(shape[:2], dtype=bool)
        by_drake = far | is_loaded
        for n in np.flatnonzero(by_drake.any(axis=1)).tolist():
            own = (n, by_drake[n])
            found.put(own, arm.bodies.terms(q[own], v[own], on_bodies[n]))
        return found.flat()

    return terms


def _expansion(
    bodies: Bodies, segments: Sequence[Segment], steps: int, h: float
) -> Expansion | None:
    """Returns the rigid bodies near what was measured; None where that isn't known."""
    after = np.asarray(h * (np.arange(steps) + 0.5), np.float64)
    paths = [s.measured_at(s.start + after) for s in segments]
    known = [path for path in paths if path]
    if len(known) < len(paths):
        return None
    q, v = (np.stack(arrays, axis=1) for arrays in zip(*known, strict=True))
    return Expansion.along(bodies, q, v)


def _missing(
    arm: Arm,
    gears: Gears,
    sets: Sequence[ParameterSet],
    segments: Sequence[Segment],
    steps: int,
    h: float,
    memories: Memories,
) -> Missing[BodyTerms]:
    """Returns what gives the torques that are missing for accelerations."""
    inputs = _inputs(sets, segments, steps, h)
    drive = Drive(
        np.repeat([s.drive.stiffness for s in sets], len(segments), axis=0),
        np.repeat([s.drive.damping for s in sets], len(segments), axis=0),
        sets[0].drive.limit,
    )
    effects = torques_in_lanes([s.effects for s in sets], len(segments))

    def missing(
        q: Array,
        v: Array,
        a: Array,
        terms: BodyTerms,
        step: int,
        stage: int,
        lanes: Lanes,
    ) -> Array:
        """See Missing."""
        terms, given = terms.of(lanes), inputs.at((step, stage, lanes))
        load = terms.load(gears.links(a))
        motors = tuple(gears.motors(x) for x in (q, v, a))
        torque = drive.of(lanes).torque(motors[0], motors[1], given)
        needed = load - (torque + given.enabled * terms.added)
        for effect in effects:
            acting, own = effect.of(lanes)
            samples = ArmSamples(arm.joints, *(x[..., own, :] for x in (*motors, load)))
            needed[..., own, :] += acting.torques(samples)
        memories.add_torques(needed, motors[0], lanes)
        if not gears.any:
            return needed
        return np.concatenate([needed, gears.missing(q, a, load, lanes)], axis=-1)

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

"""Many short motions of an arm, integrated side by side.

Friction that changes its sign within a step is stiff, so that steps are implicit: the
two-stage SDIRK method of order two that is L-stable (Alexander 1977). What Drake gives
of the rigid bodies is taken at the middle of the step, where the motion before leads:
of second order, too.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid.models.base import Array

_GAMMA = 1.0 - np.sqrt(0.5)
#: When after a step's begin, in steps, its two stages are.
STAGES = (_GAMMA, 1.0)
_MOST_ITERATIONS = 50
_MOST_HALVINGS = 40
_DONE = 0.5  # share of the lanes that are done, from which on others go on without
_DESCENT = 0.1  # of the descent that is promised, at least
_CHANGE = 1e-7  # rad/s, for differences
_CLOSER = 0.01  # of what was missing; by less a step has found the slopes to be others
_SMALL = 1e-10  # rad/s: velocities are known so well

#: Numbers of lanes, increasing, or all of them.
Lanes = NDArray[np.intp] | slice
#: What the rigid bodies give, of whatever type.
Terms = TypeVar("Terms", contravariant=True)


class Missing(Protocol[Terms]):
    """Load and friction minus the drives' torque."""

    def __call__(
        self,
        q: Array,
        v: Array,
        a: Array,
        terms: Terms,
        step: int,
        stage: int,
        lanes: Lanes,
    ) -> Array:
        """Returns what is missing in some lanes (..., n, joints).

        Args:
            q, v, a: (..., n, joints) positions, velocities and accelerations.
            terms: rigid bodies, of all lanes.
            step, stage: of the step, and which.
            lanes: (n,) increasing numbers, or all.
        """
        ...


@dataclass(frozen=True)
class Motion:
    """Of many lanes, at the ends of steps: (steps + 1, lanes, joints) each."""

    q: Array
    v: Array


def integrate(
    q: Array,
    v: Array,
    steps: int,
    h: float,
    terms: Callable[[Array, Array, int], Terms],
    missing: Missing[Terms],
    at_end: Callable[[Array], None] = lambda _: None,
) -> Motion:
    """Returns how lanes move from where they begin; NaN where no step was found.

    Args:
        q, v: (lanes, joints) at the begin [rad, rad/s].
        steps: how many.
        h: of a step [s].
        terms: rigid bodies at (lanes, joints) positions and velocities, of a step.
        missing: see there.
        at_end: of a step, told where the lanes (lanes, joints) are.
    """
    a = np.zeros_like(q)
    path_q, path_v = [q], [v]
    for step in range(steps):
        middle = (q + 0.5 * h * v + 0.125 * h * h * a, v + 0.5 * h * a)
        of_step = terms(*middle, step)
        in_step = functools.partial(missing, terms=of_step, step=step)
        first = _stage(q, v, a, _GAMMA * h, functools.partial(in_step, stage=0))
        v_1 = v + _GAMMA * h * first
        rest = (1.0 - _GAMMA) * h
        q, v = q + rest * v_1, v + rest * first
        second = _stage(q, v, first, _GAMMA * h, functools.partial(in_step, stage=1))
        v = v + _GAMMA * h * second
        q = q + _GAMMA * h * v
        a = second
        at_end(q)
        path_q.append(q)
        path_v.append(v)
    return Motion(np.stack(path_q), np.stack(path_v))


def _stage(
    q: Array,
    v: Array,
    a: Array,
    dt: float,
    missing: Callable[..., Array],
) -> Array:
    """Returns accelerations a with which nothing is missing at the stage's end.

    There v + dt a and q + dt (v + dt a). By Newton's method; a step that does not
    bring the balance nearer is halved, lane by lane, since dry friction that has
    changed its sign leads far too far. Slopes that have served well serve again, and
    lanes that are done wait for no other.

    Args:
        q, v: (lanes, joints) that the stage starts from.
        a: (lanes, joints) to begin with.
        dt: of the stage [s].
        missing: see `Missing`, in this stage.
    """
    found, left = a.copy(), np.arange(len(a))
    lanes: Lanes = slice(None)

    def short(a: Array) -> Array:
        """Returns what is missing (..., lanes, joints) for accelerations."""
        end = v[lanes] + dt * a
        return missing(q[lanes] + dt * end, end, a, lanes=lanes)

    r, is_known = short(a), False
    for _ in range(_MOST_ITERATIONS):
        if not is_known:
            J = _slope(short, a, r, dt)
        size = np.linalg.norm(r, axis=1)
        change, r = _descent(short, a, r, J, dt)
        found[left] = a = a + change
        is_known = bool((np.linalg.norm(r, axis=1) <= _CLOSER * size).all())
        is_done = ~(dt * np.abs(change).max(axis=1) > _SMALL)
        if is_done.all():
            return found
        if is_done.sum() > _DONE * len(left):
            left, a, r, J = (x[~is_done] for x in (left, a, r, J))
            lanes, is_done = left, is_done[~is_done]
    found[left[~is_done]] = np.nan
    return found


def _descent(
    short: Callable[[Array], Array], a: Array, r: Array, J: Array, dt: float
) -> tuple[Array, Array]:
    """Returns Newton's change, halved in lanes that miss more by it, and what is left.

    How much they miss, the change says that the same slopes would ask for next
    (Deuflhard 1974): torques would not do, of which a gear's hardly change with twist.

    Args:
        short: what is missing (lanes, joints) for accelerations.
        a, r: accelerations, and what is missing for them.
        J: (lanes, joints, joints) slopes.
        dt: of the stage [s].
    """
    change = _newton(J, r)
    size, share = np.linalg.norm(change, axis=1), np.ones(len(a))
    most = dt * np.abs(change).max(axis=1)
    for _ in range(_MOST_HALVINGS):
        left = short(a + share[:, None] * change)
        asked = np.linalg.norm(_newton(J, left), axis=1)
        is_worse = asked > (1.0 - _DESCENT * share) * size
        is_worse &= share * most > _SMALL
        if not is_worse.any():
            break
        share = np.where(is_worse, 0.5 * share, share)
    return share[:, None] * change, left


def _newton(J: Array, r: Array) -> Array:
    """Returns the changes (lanes, joints) after which nothing is missing, by slopes."""
    return np.asarray(np.linalg.solve(J, -r[..., None])[..., 0], np.float64)


def _slope(short: Callable[[Array], Array], a: Array, r: Array, dt: float) -> Array:
    """Returns derivatives (lanes, joints, joints) of what is short, by differences."""
    change = _CHANGE / dt
    moved = a + change * np.eye(a.shape[1])[:, None, :]
    J: NDArray[np.float64] = np.moveaxis((short(moved) - r) / change, 0, -1)
    J[np.linalg.det(J) == 0.0] = np.nan  # that lane has failed, no other
    return J

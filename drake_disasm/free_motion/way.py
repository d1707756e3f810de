"""From where an arm stands to where a motion begins."""

import numpy as np
from pydrake.math import RigidTransform

from drake_disasm.common.spatial import rotation_from_vector
from drake_disasm.free_motion.rest_to_rest import PEAK_SPEED, shares
from drake_disasm.free_motion.table import MotionTable
from drake_disasm.stations import Station

_IN_PART, _OUT, _TURN_IN_PART = 0.02, 0.05, 0.3  # m/s, m/s, rad/s, at the bolt
_HEIGHT = 0.15  # m, above the part
_TURN = 0.3  # rad/s, of the fastest joint from there to the motion's begin
_REST = 0.5  # s, before the motion
_STEP = 0.02  # s, of the table


def with_way(station: Station, motion: MotionTable) -> tuple[MotionTable, float]:
    """Returns a motion with the way to it, and when the motion itself begins [s].

    The bolt goes the stages of its part's way and is lifted out; from there all joints
    go straight to where the motion begins. Each part begins and ends at rest. Only the
    way out of the part knows of anything to run into.

    Args:
        station: whose arm stands at the start of the task.
        motion: to be played afterwards.

    Raises:
        DisasmError: the arm can't go that way.
    """
    out = way_out(station)
    return _joined([*out, *_straight(out[-1], motion.q[0])], motion)


def way_out(station: Station) -> list[np.ndarray]:
    """Returns postures (joints,) by which the bolt is taken out and lifted.

    Args:
        station: whose arm stands at the start of the task.

    Raises:
        DisasmError: the arm can't go that way.
    """
    *inside, last_stage = station.scenario.part.stages
    moves = [(s.axis, s.end, _TURN_IN_PART if s.is_turn else _IN_PART) for s in inside]
    q, place = [station.start], np.zeros(6)
    for axis, end, speed in [*moves, (last_stage.axis, _HEIGHT, _OUT)]:
        for share in _shares(end, speed):
            place[axis] = share * end
            X_GB = RigidTransform(rotation_from_vector(place[3:]), place[:3])
            q.append(station.coordinates.solve(X_GB, q[-1]))
    return q


def with_straight_way(
    posture: np.ndarray, motion: MotionTable
) -> tuple[MotionTable, float]:
    """Returns a motion with the straight way to it, and when it begins itself [s].

    Args:
        posture: (joints,) in which the arm stands, with nothing on the way.
        motion: to be played afterwards.
    """
    return _joined([posture, *_straight(posture, motion.q[0])], motion)


def _straight(last: np.ndarray, first: np.ndarray) -> list[np.ndarray]:
    """Returns postures from one to another, and a rest there."""
    turn = float(np.abs(first - last).max())
    q = [last + share * (first - last) for share in _shares(turn, _TURN)]
    return q + [first] * round(_REST / _STEP)


def _joined(way: list[np.ndarray], motion: MotionTable) -> tuple[MotionTable, float]:
    """Returns a motion after the way to it, and when it begins itself [s]."""
    time = _STEP * np.arange(len(way))
    joined = MotionTable(
        np.concatenate([time, time[-1] + motion.time[1:]]),
        np.concatenate([way, motion.q[1:]]),
    )
    return joined, float(time[-1])


def _shares(length: float, speed: float) -> np.ndarray:
    """Returns the shares (n,) of a way that are done, by a quintic from rest to rest.

    Args:
        length: of the way.
        speed: greatest.
    """
    return shares(max(1, int(np.ceil(PEAK_SPEED * length / speed / _STEP))))

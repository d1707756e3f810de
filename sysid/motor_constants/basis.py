"""What motor constants can rest on: a payload that is known, or the URDF's masses."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs import Log
from sysid.models.arm_logs import arm_urdf, refuse_other_logs
from sysid.models.arm_motion import ArmMotion
from sysid.models.channel_grams import FAR_BETTER
from sysid.models.gravity_estimate import friction_columns
from sysid.models.regressor import ArmRegressor, base_set
from sysid.motor_constants.constants import (
    MotorConstants,
    has_currents,
    identified_constants,
)
from sysid.motor_constants.estimate import CurrentGrams

Array = NDArray[np.float64]

_ROUNDS = 3  # of the load on which friction depends: changes below 1 % after them


def constants_by_payload(
    logs: Sequence[Log], references: int, payload: float, urdf: str | None = None
) -> MotorConstants:
    """Returns constants that rest on the mass of a known payload at the flange.

    Bodies of the arm and the payload's centre and inertia are free.

    Args:
        logs: of joint motion with currents: without the payload first, then with it.
        references: number of the former.
        payload: its mass [kg].
        urdf: of the arm; by default the one named in the first log.

    Raises:
        DisasmError: a log has no currents, there is none with or without the payload,
            or the constants are not determined.
    """
    if not payload > 0.0:
        raise DisasmError(f"known payload {payload:g} kg: give a mass above zero")
    if not 0 < references < len(logs):
        raise DisasmError(
            "a known payload needs logs without it, by `reference`, and logs with it"
        )
    motion, current, by_log = _recorded(logs, urdf)
    loaded = by_log >= references
    of_load = motion.Y_payload * loaded[:, None, None]
    shared = np.concatenate([motion.Y, of_load[:, :, 1:]], axis=2)
    known = payload * of_load[:, :, 0]
    a, load = None, None
    for _ in range(_ROUNDS):
        own = _own_columns(motion, loaded, load)
        grams = CurrentGrams.of(known, shared, own, current)
        a = grams.fit(a)
        load = known + shared @ grams.theta(a)
    assert a is not None
    basis = f"a known payload of {payload:g} kg, which the verdict only repeats"
    return identified_constants(motion.joints, a, grams.half_widths(a), basis)


def constants_by_urdf(logs: Sequence[Log], urdf: str | None = None) -> MotorConstants:
    """Returns constants that rest on the masses and inertias of the URDF.

    Args:
        logs: of joint motion with currents.
        urdf: of the arm; by default the one named in the first log.

    Raises:
        DisasmError: a log has no currents, or no constant is determined.
    """
    motion, current, _ = _recorded(logs, urdf)
    known = motion.Y @ motion.nominal
    shared = np.empty((*known.shape, 0))
    own = _own_columns(motion, np.zeros(len(known), dtype=bool), known)
    grams = CurrentGrams.of(known, shared, own, current)
    a = grams.fit()
    # What the URDF explains by less than half is of other bodies than the URDF's.
    is_explained = grams.explained > FAR_BETTER
    reach = np.where(is_explained, grams.half_widths(a), np.inf)
    return identified_constants(
        motion.joints, a, reach, "the URDF's masses and inertias"
    )


def _recorded(
    logs: Sequence[Log], urdf: str | None
) -> tuple[ArmMotion, Array, NDArray[np.int64]]:
    """Returns the motion, currents (n, joints), and the number of each row's log."""
    refuse_other_logs(logs, "joint_motion", "inverse dynamics")
    if not has_currents(logs):
        raise DisasmError(
            f"{logs[0].folder}: has torques, or no currents: there are no motor "
            "constants to identify"
        )
    joints, path = logs[0].header.joints, arm_urdf(logs, urdf)
    arm = ArmRegressor(path, joints)
    episodes = [episode for log in logs for episode in log.episodes]
    motion = ArmMotion.of(arm, base_set(arm.random_regressor()), joints, episodes)
    current = np.concatenate([episode["current"] for episode in episodes])
    rows = [sum(episode.rows for episode in log.episodes) for log in logs]
    return motion, current, np.repeat(np.arange(len(logs)), rows)


def _own_columns(
    motion: ArmMotion, loaded: NDArray[np.bool_], load: Array | None
) -> Array:
    """Returns what is each joint's alone (n, joints, f): a rotor, offset and friction.

    Friction may differ with the payload: gears warm between recordings.

    Args:
        motion: of all logs.
        loaded: (n,) whether the payload is carried.
        load: (n, joints) of the gears, on which friction may depend; None if unknown.
    """
    friction = friction_columns(motion.v)
    if load is not None:
        dry = np.sign(motion.v) * np.abs(load)
        friction = np.concatenate([friction, dry[..., None]], axis=2)
    by_log = [friction * rows[:, None, None] for rows in (~loaded, loaded)]
    kept = [part for part in by_log if part.any()]
    return np.concatenate([*kept, motion.vd[..., None]], axis=2)

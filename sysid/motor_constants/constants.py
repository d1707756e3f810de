"""Motor constants of an arm's joints, and the torques that currents are by them."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs import Episode, Log
from drake_disasm.logs.refusal import refusal
from sysid.models.bookkeeping import Assumption

Interval = tuple[float, float]


@dataclass(frozen=True)
class MotorConstants:
    """Torque by current of each joint, seen at the joint: gears are in it.

    Attributes:
        joints: their names.
        values: (joints,) [N m/A]; N/A of a prismatic joint.
        basis: what they rest on, in words.
        intervals: (joints,) 95 %, of those that are identified; empty if given. None
            where a joint's motion does not determine its constant, and the mean of
            the others stands in for it.
    """

    joints: tuple[str, ...]
    values: tuple[float, ...]
    basis: str
    intervals: tuple[Interval | None, ...] = ()

    @property
    def text(self) -> str:
        """The constants, and what they rest on, in one sentence."""
        if not self.intervals:
            numbers = ", ".join(f"{value:.4g}" for value in self.values)
            return f"torques are motor currents times {numbers} N m/A, {self.basis}"
        parts, stand_ins = [], []
        every = zip(self.joints, self.values, self.intervals, strict=True)
        for joint, value, interval in every:
            if interval is None:
                stand_ins.append(f"{joint} ({value:.3g})")
            else:
                low, high = interval
                parts.append(f"{joint} {value:.4g} ({low:.4g} to {high:.4g})")
        text = (
            "torques are motor currents times motor constants [N m/A] that rest on "
            f"{self.basis}: {', '.join(parts)}"
        )
        if stand_ins:
            text += (
                f"; not identifiable at {', '.join(stand_ins)}, where the mean of the "
                "others stands in"
            )
        return text

    @property
    def assumption(self) -> Assumption:
        """What a model of the torques takes for granted."""
        return Assumption(
            self.text,
            "masses, friction and all else in N m are in proportion to them; their "
            "intervals take the constants for exact",
        )

    def to_mapping(self) -> dict[str, Any]:
        """Returns it as plain data."""
        intervals = self.intervals or (None,) * len(self.joints)
        rows = zip(self.joints, self.values, intervals, strict=True)
        return {
            "basis": self.basis,
            "unit": "N m/A",
            "joints": {
                joint: {"value": value, "interval_95": interval and list(interval)}
                for joint, value, interval in rows
            },
        }

    def torques(self, logs: Sequence[Log]) -> tuple[Log, ...]:
        """Returns logs with the torques that their currents are.

        Raises:
            DisasmError: a log has no currents, or is of other joints.
        """
        for log in logs:
            if log.header.joints != self.joints:
                where = log.folder / "log.yaml"
                raise refusal(where, "other joints", "fit it by itself")
        return tuple(
            dataclasses.replace(
                log, episodes=tuple(self._with_torques(e) for e in log.episodes)
            )
            for log in logs
        )

    def _with_torques(self, episode: Episode) -> Episode:
        currents = episode["current"]
        torques = {f"tau.{i}": k * currents[:, i] for i, k in enumerate(self.values)}
        columns = MappingProxyType({**episode.columns, **torques})
        return dataclasses.replace(episode, columns=columns)


def has_currents(logs: Sequence[Log]) -> bool:
    """Returns whether logs have motor currents in place of torques."""
    return all(
        "current" in episode and "tau" not in episode
        for log in logs
        if log.header.kind == "joint_motion"
        for episode in log.episodes
    ) and any(log.header.kind == "joint_motion" for log in logs)


def given_constants(joints: Sequence[str], values: Sequence[float]) -> MotorConstants:
    """Returns constants that are known.

    Args:
        joints: names.
        values: [N m/A], one for each joint, or one for all.

    Raises:
        DisasmError: there are more or fewer, or one is not above zero.
    """
    if len(values) == 1:
        values = list(values) * len(joints)
    if len(values) != len(joints):
        raise DisasmError(
            f"{len(values)} motor constants for {len(joints)} joints: give one for "
            f"each of {', '.join(joints)}, or one for all"
        )
    if any(not (math.isfinite(value) and value > 0.0) for value in values):
        raise DisasmError(
            f"motor constant {min(values):g}: give numbers above zero, in N m/A; a "
            "sign belongs into the map of import-log"
        )
    return MotorConstants(tuple(joints), tuple(map(float, values)), "as given")


def identified_constants(
    joints: Sequence[str], inverse: np.ndarray, reach: np.ndarray, basis: str
) -> MotorConstants:
    """Returns constants that are identified by their inverses.

    Args:
        joints: names.
        inverse: (joints,) current by torque [A/(N m)].
        reach: (joints,) half width of the inverses' 95 % intervals.
        basis: what they rest on.

    Raises:
        DisasmError: none is determined, or a current has the other sign.
    """
    reversed_ = [j for j, a, r in zip(joints, inverse, reach, strict=True) if a < -r]
    if reversed_:
        raise DisasmError(
            f"the current of {', '.join(reversed_)} has the other sign than the "
            "torque that it makes; give its `sign` in the map of import-log"
        )
    known = inverse > reach
    if not known.any():
        raise DisasmError(
            f"{basis} determines no motor constant: the motion takes too little "
            "torque beside friction; give them by `motor_constants`"
        )
    stand_in = float(np.exp(-np.log(inverse[known]).mean()))
    values = np.where(known, 1.0 / inverse, stand_in).tolist()
    intervals = [
        (float(1.0 / (a + r)), float(1.0 / (a - r))) if k else None
        for a, r, k in zip(inverse, reach, known, strict=True)
    ]
    return MotorConstants(tuple(joints), tuple(values), basis, tuple(intervals))

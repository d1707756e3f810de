"""What a runner says of a world."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

from diagnosis.worlds import World
from sysid.effect_selection.close_loop import ClosedLoop


@dataclasses.dataclass(frozen=True)
class Answer:
    """What was found out, and what it cost.

    Attributes:
        names: effects that are said to be there, beyond doubt.
        open: names that can't be ruled out beside these.
        is_unknown: whether something is said to be there that the library lacks.
        depends_on: what that depends on, or where it shows.
        robot_time: [s].
        experiments: that were performed, in words.
        force, torque: greatest in them [N, N m].
        cut_short: why experiments were, if they were.
        text: the verdict, or why there is none.
    """

    names: tuple[str, ...]
    open: tuple[str, ...] = ()
    is_unknown: bool = False
    depends_on: tuple[str, ...] = ()
    robot_time: float = 0.0
    experiments: tuple[str, ...] = ()
    force: float = 0.0
    torque: float = 0.0
    cut_short: tuple[str, ...] = ()
    text: str = ""

    @classmethod
    def of(cls, closed: ClosedLoop, **more: Any) -> "Answer":
        """Returns the answer of a verdict.

        Args:
            closed: the verdict.
            more: fields that it does not say.
        """
        found = closed.verdict
        ties = {tie.name for own in found.ties for tie in own}
        left = [
            quantity
            for own in found.predictable_residual
            for quantity in own.depends_on
        ]
        where = [finding.channel for finding in found.findings]
        return cls(
            names=found.confirmed,
            open=tuple(sorted({*found.ambiguous, *ties})),
            is_unknown=found.ending in ("unexplained", "partly"),
            depends_on=tuple(dict.fromkeys([*left, *where])),
            text=closed.text,
            **more,
        )

    @classmethod
    def of_plain(cls, plain: dict[str, Any]) -> "Answer":
        """Returns the answer of its fields as JSON has them."""
        fields: dict[str, Any] = {
            k: tuple(v) if isinstance(v, list) else v for k, v in plain.items()
        }
        return cls(**fields)


#: A world, a folder of one's own, and the robot time that may be used [s].
Runner = Callable[[World, Path, float], Answer]

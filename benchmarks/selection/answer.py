"""A case, an answer to it, and what a selector is."""

import dataclasses
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Self

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import write_text

#: What an answer may say of a log as a whole.
ENDINGS = ("none", "too short", "explained", "partly", "unexplained", "refused")
#: What the text of an answer begins with where the selector failed.
FAILED = "failed: "
GROUPS = ("null", "one", "three", "left out", "real whole", "real half")


@dataclasses.dataclass(frozen=True)
class Case:
    """A log in which effects are hidden, and what is known of it.

    Attributes:
        name: such as "joint/one/2x/white/JointDelay".
        logs: folders of the logs to explain.
        group: one of GROUPS.
        noise: kind of noise; "real" of real logs.
        held_out: folders of another recording, for the held-out error.
        urdf: of the arm, if it has one.
        hidden: names of the effects that were put in: "JointCoulombFriction.joint_2",
            "SensorDrift".
        values: true values of their parameters, by "name.field", SI.
        left_out: classes of effects that the library lacks.
        level: rms of each effect in its worst channel, in units of the noise.
        partner: of a half, the name of the other half.
        least_error: of the true model on the held-out recording, relative; 0: unknown.
    """

    name: str
    logs: tuple[str, ...]
    group: str
    noise: str = "real"
    held_out: tuple[str, ...] = ()
    urdf: str | None = None
    hidden: tuple[str, ...] = ()
    values: Mapping[str, float] = dataclasses.field(default_factory=dict)
    left_out: tuple[str, ...] = ()
    level: float = 0.0
    partner: str = ""
    least_error: float = 0.0

    @property
    def kind(self) -> str:
        """Where the log comes from: the first part of the name."""
        return self.name.partition("/")[0]

    @classmethod
    def read(cls, path: Path) -> Self:
        """Returns the case in a file."""
        return cls(**_tupled(_read(path)))

    def write(self, path: Path) -> None:
        """Writes the case to a file."""
        write_text(path, json.dumps(dataclasses.asdict(self), indent=1) + "\n")


@dataclasses.dataclass(frozen=True)
class Answer:
    """What a selector says of a case.

    Attributes:
        ending: one of ENDINGS.
        confirmed: names of effects that the log shows for certain.
        suggested: names of effects that lower the error and are not certain.
        ambiguous: of a name, rivals that explain as much.
        sizes: value and 95 % interval of parameters, by "name.field", SI.
        before, after: held-out error without and with the effects, relative: the norm
            of the error over that of what was measured. None: not given.
        seconds: of the processor, from reading the log to the answer.
        text: what else the selector says.
    """

    ending: str
    confirmed: tuple[str, ...] = ()
    suggested: tuple[str, ...] = ()
    ambiguous: Mapping[str, tuple[str, ...]] = dataclasses.field(default_factory=dict)
    sizes: Mapping[str, tuple[float, float, float]] = dataclasses.field(
        default_factory=dict
    )
    before: float | None = None
    after: float | None = None
    seconds: float = 0.0
    text: str = ""

    def __post_init__(self) -> None:
        """Refuses an ending that is none of ENDINGS."""
        if self.ending not in ENDINGS:
            raise DisasmError(
                f"answer: ending '{self.ending}' is unknown; give one of "
                f"{', '.join(ENDINGS)}"
            )

    @classmethod
    def of_plain(cls, content: Mapping[str, Any]) -> Self:
        """Returns the answer that `plain` made plain data of."""
        sets = {name: tuple(rivals) for name, rivals in content["ambiguous"].items()}
        sizes = {name: tuple(size) for name, size in content["sizes"].items()}
        return cls(**_tupled(content) | {"ambiguous": sets, "sizes": sizes})

    @property
    def plain(self) -> dict[str, Any]:
        """Plain data, for JSON."""
        return dataclasses.asdict(self)

    @property
    def is_named(self) -> bool:
        """Whether any effect is confirmed."""
        return bool(self.confirmed)


#: A selector; module `selection.NAME` has one as `select`.
Select = Callable[[Case], Answer]


def refusal(error: DisasmError) -> Answer:
    """Returns the answer of a selector that refused a log.

    "too short" if its message says so.
    """
    text = str(error)
    return Answer("too short" if "too short" in text else "refused", text=text)


def _read(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text())
    return content


def _tupled(content: Mapping[str, Any]) -> dict[str, Any]:
    """Returns plain data with tuples in place of lists."""
    return {k: tuple(v) if isinstance(v, list) else v for k, v in content.items()}

"""What a user may choose of an identification."""

from dataclasses import dataclass, field

import numpy as np

from drake_disasm.common.errors import DisasmError
from sysid.models.base import LogModel
from sysid.optimise.bees import BeesSettings, Propose

#: Methods of global search: the Bees Algorithm and NLopt's CRS2.
METHODS = ("bees", "nlopt")

#: Part of a search's evaluations with which SBPLX polishes its best point.
POLISH_SHARE = 0.25


@dataclass(frozen=True)
class SearchSettings:
    """How each method searches.

    Attributes:
        evaluations: of the global search, polish included.
        cycles: of the bees, instead; NLopt then gets as many evaluations.
        local_evaluations: of the local search on all rows; 0 leaves out Gauss-Newton
            and the local search, and searches globally on all rows (the thesis's way).
        bees: the colony.
        seed: of the searches.
        propose: chooses points in place of the bees' scouts, by a Gaussian process
            for example (`sysid.optimise.surrogate.propose`).
    """

    evaluations: int = 400
    cycles: int | None = None
    local_evaluations: int = 40
    bees: BeesSettings = field(default_factory=BeesSettings)
    seed: int = 0
    propose: Propose | None = None

    @property
    def budget(self) -> int:
        """Evaluations of the global search, whatever limits it."""
        if self.cycles is None:
            return self.evaluations
        bees = self.bees.initial + self.cycles * self.bees.per_cycle
        return int(np.ceil(bees / (1.0 - POLISH_SHARE)))


@dataclass(frozen=True)
class Settings:
    """What a user may choose; the defaults are those of `drake-disasm identify`.

    Attributes:
        methods: "bees", "nlopt", or both, which then check each other.
        search: how each of them searches.
        huber_delta: residual, in standard deviations, beyond which the loss is
            linear; infinite for least squares, None for the model's default.
        unidentifiable: "stop" or "freeze", what to do with parameters that the log
            does not determine.
        profiles: names of parameters whose profile likelihood is wanted.
    """

    methods: tuple[str, ...] = METHODS
    search: SearchSettings = field(default_factory=SearchSettings)
    huber_delta: float | None = None
    unidentifiable: str = "stop"
    profiles: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuses what no identification can do."""
        if not self.methods or set(self.methods) - set(METHODS):
            raise DisasmError(
                f"methods {self.methods}: give 'bees', 'nlopt', or both of them"
            )
        if self.huber_delta is not None and not self.huber_delta > 0.0:
            raise DisasmError("`huber_delta`: give a number above zero, or inf")
        if self.unidentifiable not in ("stop", "freeze"):
            raise DisasmError(
                f"unidentifiable '{self.unidentifiable}': give 'stop' or 'freeze'"
            )

    def huber_delta_of(self, model: LogModel) -> float:
        """Returns the Huber threshold, in standard deviations, for a model."""
        if self.huber_delta is None:
            return model.default_huber_delta
        return self.huber_delta

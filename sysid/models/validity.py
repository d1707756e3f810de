"""Whether a model's stated error holds for a log."""

import dataclasses

#: Share of rows beyond which the stated error does not hold: simulated logs of up to
#: 7.5 % leave at most 1.4 times that error at the truth, those of more up to 2.6 times
#: (docs/explanation/identification.md).
_LIMIT = 0.08


@dataclasses.dataclass(frozen=True)
class Validity:
    """How far predictions depend on what no reading shows.

    Attributes:
        share: of the rows, in which what is not known of how the grip gives moves the
            prediction of a channel by more than three times its stated error (noise
            and model error).
        give: by how much the grip gives within a step, at most [m].
        failure: why there is no prediction; empty: there is one.
    """

    share: float
    give: float
    failure: str = ""

    @property
    def holds(self) -> bool:
        """Whether residuals at the truth are about as large as stated."""
        return not self.failure and self.share <= _LIMIT

    def __str__(self) -> str:
        """Says what is the matter, and what to do; for a user."""
        if self.failure:
            return f"the model has no prediction of this log ({self.failure})"
        return (
            f"the grip gives by up to {1e3 * self.give:.2g} mm within a step; how far "
            "it gives as a step begins is not measured, and decides "
            f"{100.0 * self.share:.0f} % of the predictions (up to "
            f"{100.0 * _LIMIT:.0f} % the model is as good as stated); record at lower "
            "speeds, or with a stiffer grip"
        )

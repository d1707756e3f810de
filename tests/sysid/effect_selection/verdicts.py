"""Verdicts and held-out errors for tests of what is made of them."""

import numpy as np

from sysid.effect_selection.replication import Standing
from sysid.effect_selection.verdict import Verdict
from sysid.models import Channel
from sysid.residuals.held_out import HeldOut

ERRORS = HeldOut(
    np.array([[10.0], [-10.0]]),
    np.array([[11.0], [-11.0]]),
    np.array([[10.1], [-10.1]]),
    np.zeros(2, dtype=np.int64),
    (Channel("fx", "N", 0.1, "as given"),),
    "1 episode",
    100,
)


def made_verdict(ending, names=(), ties=(), values=(), **more) -> Verdict:
    """Returns a verdict whose effects gain half each, without ties unless given.

    Those with ties are ambiguous, others are confirmed; of what is unexplained all are
    suggested.
    """
    ties = ties or tuple(() for _ in names)
    placed = []
    for name, own in zip(names, ties, strict=True):
        status, votes, reason = "ambiguous" if own else "confirmed", 4, ""
        if ending == "unexplained":
            status, votes, reason = "suggested", 2, "2 of 4 parts of the log ask for it"
        placed.append(Standing(name, status, 0.5, votes, 4, (), reason))
    return Verdict(ending, tuple(placed), ties, tuple(values), **more)

"""Verdicts and held-out errors for tests of what is made of them."""

import numpy as np

from sysid.effect_selection.held_out import HeldOut
from sysid.effect_selection.verdict import Verdict
from sysid.models import Channel

ERRORS = HeldOut(
    np.array([[10.0], [-10.0]]),
    np.array([[11.0], [-11.0]]),
    np.array([[10.1], [-10.1]]),
    np.zeros(2, dtype=np.int64),
    (Channel("fx", "N", 0.1, "as given"),),
    "1 episode",
    100,
)


def made_verdict(
    ending,
    names=(),
    ties=(),
    values=(),
    dependence="",
    against=(),
    excess=0.0,
    findings=(),
    limits=(),
) -> Verdict:
    """Returns a verdict whose effects gain half each, without ties unless given."""
    return Verdict(
        ending,
        names,
        tuple(0.5 for _ in names),
        ties or tuple(() for _ in names),
        values,
        dependence,
        1.0,
        against,
        excess,
        findings,
        limits,
    )

"""Finds which physical effect a model lacks to explain its log.

`close_loop(model)` fits a model, tests effects of the library on what they explain of
rows that were not fitted, and adds those that are confirmed. From the top:

    close_loop                              the library call and its result
    search, refit_selection, prescreen      which effects: by linear accounts, by fits
    forward_selection                       the rule: loss, ambiguity, stopping
    replication                             confirmed, ambiguous or suggested
    linear_system, linear_account           a fit linearised with all candidates
    detection, contradictions               what could have shown; episodes that differ
    verdict, verdict_words, output          what is said in the end

Fits are made in `sysid.fitting`; `sysid.residuals` looks at what they leave.
"""

from sysid.effect_selection.close_loop import ClosedLoop, close_loop
from sysid.effect_selection.verdict import ParameterValue, Tie, Verdict
from sysid.fitting.settings import SelectionSettings

__all__ = [
    "ClosedLoop",
    "ParameterValue",
    "SelectionSettings",
    "Tie",
    "Verdict",
    "close_loop",
]

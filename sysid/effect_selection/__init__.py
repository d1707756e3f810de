"""Finds which physical effect a model lacks to explain its log.

`close_loop(model)` fits a model, tests effects of the library on what they explain of
rows that were not fitted, and adds those that are confirmed. From the top:

    close_loop                              the library call and its result
    search, refit_selection, prescreen      which effects: by linear accounts, by fits
    forward_selection                       the rule: loss, ambiguity, stopping
    replication                             confirmed, ambiguous or suggested
    linear_system, linear_account           a fit linearised with all candidates
    block_grams                             sufficient statistics of blocks of rows
    fitter, fit, fit_cache                  a model with chosen effects, fitted
    detection, whiteness, contradictions    what the log could show, and what is left
    verdict, verdict_words, output          what is said in the end
"""

from sysid.effect_selection.close_loop import ClosedLoop, close_loop
from sysid.effect_selection.settings import SelectionSettings
from sysid.effect_selection.verdict import ParameterValue, Tie, Verdict

__all__ = [
    "ClosedLoop",
    "ParameterValue",
    "SelectionSettings",
    "Tie",
    "Verdict",
    "close_loop",
]

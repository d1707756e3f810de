"""Finds which physical effect a model lacks to explain its log.

`close_loop(model)` fits a model, tests effects of the library on what they explain of
rows that were not fitted, and adds those that are confirmed. From the top:

    close_loop                          the library call and its result
    search, refit_search                which effect is added: by evidence, or by fits
    trial_comparison, simplification    which of their fits, and with how little in it
    survey, evidence, prescreen         how candidates are ranked
    fitter, fit, fit_cache              a model with chosen effects, fitted
    block_regression, significance      what blocks of rows gain, and whether by chance
    verdict, verdict_text, output       what is said in the end
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

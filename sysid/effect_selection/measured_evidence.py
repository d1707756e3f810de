"""The evidence for an effect by fits without and with it: its blocks, and the noise.

Signs and ranks of blocks can't tell of what shows in a few rows alone: a force that is
read too large where the bolt meets the end of the groove, once in an episode. Where the
noise is stated, the size of the change can.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from sysid.effect_selection.block_regression import blocks_of
from sysid.effect_selection.evidence import Evidence
from sysid.effect_selection.fit import Fit
from sysid.effect_selection.prewhitening import Prewhitening
from sysid.effect_selection.significance import gained_p
from sysid.effect_selection.survey import LinearSurvey

Array = NDArray[np.float64]


def measured_evidence(before: Fit, after: Fit, trial: Evidence, tests: int) -> Evidence:
    """Returns the evidence for what was added, by fits before and after.

    Each block is judged by what the fit after would cost it, were it fitted to all
    others; the p-value is of the prewhitened residuals, by short blocks, or of what
    exceeds the noise where that is stated, for as many tests as there are effects
    (Bonferroni). All blocks may gain by what makes up for the model's own error: where
    that is stated, an effect has to exceed it.
    """
    gains, total = _block_gains(before, after, before.blocks)
    filtered, settings = after.prewhitening, after.settings
    white = filtered(after.linearisation.residual)
    short = blocks_of(white, filtered.episode, settings, settings.max_test_blocks)
    of_white, _ = _block_gains(before, after, short, filtered)
    p = gained_p(of_white, settings)
    if after.noise_is_stated:
        exceeds = exceeds_noise_p(before, after, trial.parameter_count)
        p = exceeds if after.states_model_error else min(p, exceeds)
    return trial.measured(gains, total, min(1.0, tests * p))


def exceeds_noise_p(before: Fit, after: Fit, parameters: int) -> float:
    """Returns the p-value that noise alone makes a fit with more parameters so good.

    Args:
        before, after: fits to the same rows without and with the parameters.
        parameters: how many the second has more.
    """
    left = after.bounded_residual
    return _of_noise(after, before.bounded_residual - left, left, parameters)


def amplitude_p(fit: Fit, column: int) -> float:
    """Returns the p-value that noise alone makes one parameter what it is.

    By the linear account, with all other parameters as they are.
    """
    linear = fit.linearisation
    change = -linear.jacobian[..., column] * (linear.u - fit.null)[column]
    return _of_noise(fit, np.sqrt(linear.weights) * change, fit.bounded_residual, 1)


def linear_p(fit: Fit, survey: LinearSurvey, evidence: Evidence) -> float:
    """Returns the p-value that noise alone makes something so good, without a fit.

    Of all its amplitudes together, or of the best one for as many tests as there are:
    one that makes up for the model's error must not hide another that does not. With
    the weights of the fit, and without: what fits far rows has them count again.

    Args:
        fit: without it.
        survey: at that fit.
        evidence: for effects of the survey.
    """
    columns = np.concatenate([survey.groups[c.text] for c in evidence.candidates])
    linear = survey.linearisation
    sets = [columns, *(columns[i : i + 1] for i in range(len(columns)))]
    found = []
    for weights in (linear.weights, np.ones_like(linear.weights)):
        root = np.sqrt(weights)
        r = root * linear.residual
        for chosen in sets:
            J = root.reshape(-1, 1) * linear.flat_jacobian[:, chosen]
            step = np.linalg.lstsq(J, -r.reshape(-1), rcond=None)[0]
            change = -(J @ step).reshape(r.shape)
            p = _of_noise(fit, change, r - change, len(chosen))
            found.append(p * len(columns) / len(chosen))
    return min(1.0, *found)


def _of_noise(fit: Fit, change: Array, left: Array, parameters: int) -> float:
    """Returns the p-value that noise alone leads to a change of the residuals.

    The length of the residuals before, along the change, is a chi-squared variable by
    chance. It is shortened by what the model's own error could amount to, were it in
    each row of `model_error_reach` standard deviations and of the sign that the change
    has; and divided by what the rows that change are left with, row by row or block by
    block, where that is more than the stated noise.

    Args:
        fit: with the parameters.
        change: (rows, channels) of the residuals, by the parameters.
        left: (rows, channels) residuals with them.
        parameters: how many.
    """
    length = float(np.linalg.norm(change))
    if not length:
        return 1.0
    along = change / length
    share = fit.model.measurements.model_error_share
    off = fit.settings.model_error_reach * float(np.sum(np.abs(along) * share))
    score = max(float(np.sum(along * (left + change))) - off, 0.0)
    of_blocks = np.bincount(fit.blocks, np.sum(along * left, axis=1))
    left_over = max(float(np.sum((along * left) ** 2)), float(np.sum(of_blocks**2)))
    return float(chi2.sf(score**2 / max(1.0, left_over), parameters))


def _block_gains(
    before: Fit,
    after: Fit,
    blocks: NDArray[np.int64],
    filtered: Prewhitening | None = None,
) -> tuple[Array, float]:
    """Returns what each block gains (B,), and the loss of all before."""
    losses = before.regression(blocks, filtered).block_losses
    own = np.arange(len(after.theta))
    back = after.null - after.linearisation.u
    left = after.regression(blocks, filtered).held_out_losses(own, back)
    return losses - left, float(losses.sum())

"""All thresholds of effect selection, each with its unit and the reason for it."""

from dataclasses import dataclass

from sysid.thresholds import threshold as _setting

#: What was measured with all thresholds at their defaults: docs/results.
_NULL_LOGS = (
    "an effect is named in 18 of 1060 null logs of a sensor and in 3 of 700 of an arm "
    "(docs/results/false-alarms.md)"
)
_BLIND_LOGS = (
    "not alone; with the other defaults 351 of 375 hidden effects are named first "
    "(docs/results/verdicts-blind.md)"
)


@dataclass(frozen=True)
class SelectionSettings:
    """Thresholds of effect selection.

    Each field's metadata has its `unit` ("1" is a pure number), the `reason` for its
    default, and what was `measured` to choose it. "Loss" is the sum of the squared
    residuals in units of the noise, Huber's beyond `huber_delta`; "objective" is its
    root mean square: 1 is as good as the sensors. A gain is a share of the loss of
    blocks that were not fitted.
    """

    # When an effect is more than chance.
    alpha: float = _setting(
        0.05,
        "1",
        "family-wise error rate of a round; the usual 5 %",
        _NULL_LOGS,
    )
    sign_flips: int = _setting(
        4000,
        "draws",
        "a p-value of 0.05 is then known to 0.0035 (binomial standard deviation)",
    )
    min_gain: float = _setting(
        0.01,
        "share of the loss",
        "a smaller gain is of no use to a simulation, however significant",
        _NULL_LOGS,
    )
    min_block_share: float = _setting(
        0.8,
        "share of the blocks",
        "that get better by what is added to effects that are certain: 8 of 10, so "
        "that a few dominant blocks can't decide",
        _NULL_LOGS,
    )
    idle_block_gain: float = _setting(
        0.1,
        "of the blocks' mean absolute gain",
        "a contact effect does nothing to blocks in which the bolt touches nothing: "
        "blocks that change by less are not counted",
        _NULL_LOGS,
    )

    # How rows are grouped into blocks.
    min_blocks: int = _setting(
        8,
        "blocks",
        "signed ranks of fewer blocks can't reach a p-value below 0.05 with many "
        "candidates: of 8, the least is 2^-8 = 0.004",
    )
    max_blocks: int = _setting(
        40,
        "blocks",
        "more blocks cost time (one set of normal equations each) and gain no power "
        "to speak of",
    )

    # How a residual is prewhitened, to test whether a gain is chance.
    max_test_blocks: int = _setting(
        40,
        "blocks",
        "of the prewhitened residual; enough for 4000 different flips of their signs, "
        "and as long as the residual allows, for what the filter leaves of its "
        "correlation",
    )
    cell_power: float = _setting(
        0.9,
        "share of a channel's power",
        "means of so many rows are taken as keep this much of each channel: a residual "
        "that is sampled far too often has no noise at most frequencies",
        "of a real arm at 200 Hz, filtered at 8 Hz: friction is found in 3 s "
        "(docs/results/verdicts-real.md)",
    )
    cell_lengths: tuple[int, ...] = _setting(
        (2, 3, 5, 8, 12, 20, 30, 50, 80, 120, 200),
        "rows",
        "that a mean is taken of, about a factor of 1.6 apart",
    )
    min_cells: int = _setting(
        40, "cells", "as many as `max_test_blocks`, so that each block has one"
    )
    max_ar_order: int = _setting(
        30,
        "cells",
        "how far back the autoregressive model of a channel looks at most; Akaike's "
        "criterion chooses",
    )
    cells_per_ar_order: int = _setting(
        10, "cells", "per coefficient of an autoregressive model, at least"
    )
    ar_errors: float = _setting(
        2.0,
        "standard errors",
        "that are added to the first coefficient, and by which a residual's power that "
        "is not white may be off: noise that is taken for slower than it is costs "
        "power, noise that is taken for faster raises alarms",
        "AR(0.98) noise raised alarms in 26 of 60 logs with none, in 2 of 60 with 2, "
        "before `noise_safety`; with white noise upon it the first round accepted an "
        "effect in 20 of 40 where rows with white noise were not averaged, and in none",
    )
    whitened_per_parameter: int = _setting(
        10,
        "values per parameter",
        "of fewer an ordinary fit takes up much of what is slow, and noise passes for "
        "faster than it is: the filter is then made again (`whitening_steps`), which "
        "costs power to find offsets",
        "with 7 the first round accepts an effect in 15 of 20 sieve null logs of an "
        "arm (3 s), with 14 (10 s) in 0 of 24",
    )
    whitening_steps: int = _setting(
        2,
        "times",
        "that the filter is made again of what generalised least squares by the last "
        "leaves (Cochrane and Orcutt 1949)",
        "an effect is accepted in 2 of 20 sieve null logs with one, two or four",
    )
    noise_safety: float = _setting(
        1.5,
        "times",
        "the noise that is left when the best candidate is fitted is taken for so much "
        "larger: that candidate was chosen, and has taken some noise along",
        _NULL_LOGS,
    )

    # The linear account of a residual, block by block.
    reweighting_steps: int = _setting(
        3,
        "iterations",
        "of the iteratively reweighted least squares with Huber's weights; chosen for "
        "the time that they take, since every candidate needs them",
    )
    outlier_deltas: float = _setting(
        10.0,
        "huber_delta",
        "rows missed by more lose their influence altogether: there contact is made "
        "or broken, and a derivative is meaningless",
        _BLIND_LOGS,
    )
    leverage_quantile: float = _setting(
        0.95,
        "quantile of the rows",
        "no row may have more leverage than 95 % of them have: where contact makes "
        "and breaks, single derivatives are huge",
        _BLIND_LOGS,
    )
    min_new_column: float = _setting(
        1e-3,
        "share of a column's norm",
        "what the model's own parameters reproduce to 0.1 % is not a new effect but "
        "rounding of finite differences",
    )

    # Ranking of candidates.
    parsimony_tolerance: float = _setting(
        0.05,
        "of the best gain",
        "the candidate with the fewest amplitudes is taken if it gains at most this "
        "much less than the best, or where the model states an error of its own, "
        "leaves at most this much more; chosen as a few per cent",
        _BLIND_LOGS,
    )
    tie_parsimony_tolerance: float = _setting(
        0.1,
        "of the best gain",
        "wider for a rival that the blocks can't distinguish from the best: which of "
        "the two is named is a matter of which is simpler, not of a tenth of a gain",
    )
    stroke_share: float = _setting(
        0.05,
        "of a joint's travel",
        "by less it does not turn back: noise of a rest is no reversal",
    )
    tie_min_gain: float = _setting(
        0.5,
        "of the best gain",
        "what gains less than half is no rival, even where too few blocks decide",
    )
    pair_pool: int = _setting(
        8,
        "candidates",
        "28 pairs at most, which cost no simulation; more pairs cost power, since "
        "p-values count all pairs",
        "the pairs' p-values were corrected after a pair of the best eight was named "
        "in one of twelve null logs of an arm (commit 42272a1)",
    )
    max_trials: int = _setting(
        4,
        "effects per round",
        "the most promising are fitted until one is confirmed (all, where fits "
        "decide); chosen for the time that fits take",
        _BLIND_LOGS,
    )
    min_amplitude_gain: float = _setting(
        0.005,
        "share of the loss",
        "an amplitude that gains less takes up what the model does a little "
        "differently from the device",
        "without it the groove turned in docs/guides/close-loop.md came with a shift "
        "of 66 micrometres that nobody had put in",
    )
    curve_step_width: float = _setting(
        0.1,
        "of the covariate's range",
        "steepness of the step in a dependence curve: sharp enough for friction that "
        "changes sign, smooth enough for a regression",
    )

    # Whether there is enough data.
    min_rows: int = _setting(
        10,
        "rows",
        "fewer rows make no blocks; chosen as the shortest log",
    )
    rows_per_parameter: int = _setting(
        2, "rows per parameter", "so that half of the rows can be held out"
    )
    max_block_excess: float = _setting(
        1.0,
        "of a block's fitted loss",
        "half of the blocks then cost twice as much when they are not fitted: each "
        "shows something else (Akaike's final prediction error at as many parameters "
        "as a third of the independent data)",
        "distinguishes short logs from correlated residuals in commit 4d1afab; "
        "the length of the correlation did not",
    )
    max_extrapolation: int = _setting(
        20,
        "times the log",
        "an estimate of how many more rows are needed means nothing beyond that",
    )

    # What would have been found.
    detection_power: float = _setting(
        0.8, "1", "probability with which an effect at its limit of detection is found"
    )

    # What a channel's residual shows by itself.
    channel_alpha: float = _setting(
        0.001,
        "1",
        "of one check of one channel: there are two dozen of them in a verdict",
    )
    max_channel_rise: float = _setting(
        0.1,
        "of a channel's loss, or of its noise's if that is more",
        "an effect that costs a channel more than that, significantly, is wrong "
        "however much the others gain",
    )
    max_rise_per_gain: float = _setting(
        0.001,
        "of the loss that an effect takes off all channels",
        "a channel that stays within its stated noise is not harmed by so little more: "
        "joints move each other",
        "friction of two joints that took 70 % off the objective was rejected for a "
        "wrist that went from 0.45 to 0.64 times its noise",
    )
    max_undoubled_per_gain: float = _setting(
        0.005,
        "of the loss that an effect takes off all channels",
        "nor is a channel beyond its noise that is not doubled by so little more",
        "rotors of six joints that took 97 % off the loss were rejected for a wrist "
        "that went from 4 to 5 times its noise; the others came down from 20 to 40",
    )
    noticeable: float = _setting(
        0.3,
        "times the noise, if that is stated",
        "lines below it are what a solver leaves, and of no consequence",
        "poses of simulated logs have residuals of a thousandth of the noise, periodic "
        "with the strokes",
    )
    noticeable_row: float = _setting(
        3.0,
        "times the noise and the model's own error, if they are stated",
        "a row within three standard deviations is as it was said to be, however small "
        "all others are",
        "where a bolt leaves the stop the cell's arm is off by two, 0.1 elsewhere",
    )
    outlying_alpha: float = _setting(
        0.003,
        "1",
        "that the largest row of a channel is beyond what the tail says; of twelve "
        "channels with heavy tails one is in 4 % of the logs",
    )
    outlying_row: float = _setting(
        4.0,
        "times what nine of ten rows are below",
        "fewer is no outlier, whatever the tail: 6.6 standard deviations of normal "
        "noise",
    )
    line_alpha: float = _setting(
        1e-4,
        "1",
        "of all frequencies of one channel; stricter than `channel_alpha`, since the "
        "spectrum around a line is taken for smooth",
    )
    line_power: float = _setting(
        0.2,
        "share of a channel's power",
        "a line with less is no reason to doubt a verdict",
    )
    line_neighbours: int = _setting(
        8, "frequencies", "on either side, that a line is compared with"
    )

    # Episodes that contradict each other.
    contradiction_max_episodes: int = _setting(
        12,
        "episodes",
        "with more, one alone hardly shows, and it is imprecision rather than a "
        "contradiction",
    )
    contradiction_min_gain: float = _setting(
        0.2,
        "share of the loss",
        "far beyond what a common model leaves",
        _NULL_LOGS,
    )
    contradiction_min_block_share: float = _setting(
        0.8,
        "share of the blocks",
        "the same 8 of 10 as for an effect; here blocks without a change count",
    )
    contradiction_parsimony_tolerance: float = _setting(
        0.1,
        "of the best gain",
        "wider than for effects: which parameter differs matters less than that one "
        "does",
    )

    # How a model with effects is fitted.
    fit_iterations: int = _setting(
        8, "iterations", "a guard: `fit_min_progress` usually ends a fit before"
    )
    fit_min_progress: float = _setting(
        1e-3,
        "of the objective",
        "an iteration that gains less ends the fit; a tenth of `min_gain`",
    )
    costly_fit_iterations: int = _setting(
        6, "iterations", "fewer, where one evaluation takes seconds"
    )
    costly_fit_min_progress: float = _setting(
        0.02,
        "of the objective",
        "where one evaluation takes seconds, an iteration must gain twice `min_gain`",
        "reaches the bottom of the README example's valley (commit 3afb199)",
    )
    fits_begun_again: int = _setting(
        3,
        "fits",
        "after each, steps begin where the wrench says without the sensor's effects as "
        "they are by then; at most, with shapes held and then with them",
    )
    bound_tolerance: float = _setting(
        1e-6,
        "of a parameter's range",
        "an amplitude that ends within this of a bound is at the bound: unphysical",
    )

    # Refit search: where effects are not linear, fits decide.
    noise_level: float = _setting(
        1.0,
        "objective",
        "a residual as large as the noise: nothing is left to fit",
    )
    max_linear_objective: float = _setting(
        5.0,
        "objective",
        "beyond five times the noise the linear account is not asked: the bolt is "
        "inside the model's wall, and the derivative is the wall's stiffness",
        "a groove turned by 3 degrees is found only by fits (tests/sysid/"
        "effect_selection/test_twin_logs.py); one by 2 degrees, 7.5 times the noise, "
        "was named a step of the sensor first",
    )
    search_rows: int = _setting(
        250,
        "rows",
        "a hundred evaluations of a model that takes seconds for all rows then take "
        "minutes; so do hundreds of fits far from the data",
        "130 s from 883 transitions to the verdict (docs/results/identification.md)",
    )
    refit_min_linear_gain: float = _setting(
        0.02,
        "share of the loss",
        "a candidate with less, by the linear account, is not worth a fit",
        _BLIND_LOGS,
    )
    refit_max_linear_p: float = _setting(
        0.5,
        "p-value",
        "where the model states its own error: what does not come near to exceeding it "
        "in the linear account is not worth minutes of fits",
    )
    refit_max_pairs: int = _setting(
        3,
        "pairs per round",
        "fitted where no effect passes alone; chosen for the time that they take",
    )
    refit_min_progress: float = _setting(
        0.005,
        "share of the loss",
        "a second fit of the same effects that gains less is the same fit",
    )
    clearly_needed_gain: float = _setting(
        0.5,
        "share of the loss without the effect",
        "what more than halves the loss is needed: no fit without it is made",
    )
    refit_tie_margin: float = _setting(
        0.25,
        "of the loss that is left",
        "a rival whose fit ends within this of the best is a tie",
        _BLIND_LOGS,
    )
    prescreen_rows: int = _setting(
        120,
        "rows",
        "there is one such fit for each effect, so it must be cheap",
    )
    prescreen_scan: tuple[float, ...] = _setting(
        (0.5, 0.2, 0.08, 0.032, 0.0128),
        "of the range on either side of null",
        "amplitudes at which a fit may begin, a factor of 2.5 apart: downhill from "
        "null ends where contact does",
        "a groove turned by 3 degrees is found from them",
    )
    prescreen_below_gain: float = _setting(
        0.8,
        "of the loss",
        "what explains less of it, and leaves more than noise, may stand for another "
        "effect that is not linear at null",
        "a groove that is offset to two sides by 30 um was named a bend",
    )
    prescreen_max_loss_ratio: float = _setting(
        2.0,
        "of the least loss of the prescreening fits",
        "effects whose prescreening fit leaves more are not fitted to all rows",
    )

    # Errors on rows that were not fitted.
    held_out_folds: int = _setting(
        10, "folds", "contiguous tenths, the usual number for cross-validation"
    )
    bootstrap_draws: int = _setting(
        2000, "draws", "ends of a 95 % interval then rest on 50 draws each"
    )
    held_out_rcond: float = _setting(
        1e-6,
        "of the largest singular value",
        "directions that a fold's other rows do not fix stay where they are",
    )

    model_error_reach: float = _setting(
        1.0,
        "standard deviations",
        "by which the model itself may be off in all rows at once, in the direction of "
        "an effect: what is less is none of a log that states such an error",
        "in four logs of the cell with nothing hidden, no effect gained more than 0.07 "
        "of them would explain (seeds 3000 to 3060)",
    )

    # Whether the arm scatters about its commands.
    max_objective_at_noise: float = _setting(
        1.2,
        "objective",
        "beyond it there is more than noise, where channels state their noise",
        _BLIND_LOGS,
    )
    scatter_step: float = _setting(
        2e-5,
        "m",
        "of the derivatives by where a step led: the encoders' repeatability",
    )
    scatter_rounds: int = _setting(
        8,
        "iterations",
        "derivatives are taken anew where steps likely led",
    )
    scatter_min_progress: float = _setting(
        0.01,
        "of scatter_scale",
        "an iteration that changes the standard deviations by less is the last",
    )
    scatter_draws: int = _setting(
        8,
        "trials",
        "in an iteration, of where a step led that is missed by far: a wall between "
        "hides it from the derivatives",
        "with none, 29 micrometres along x where there are none; with 8, 2 "
        "(tests/sysid/effect_selection/test_twin_logs.py)",
    )
    scatter_missed: float = _setting(
        2.0,
        "of the channels' number",
        "a step that loses more is missed by far: noise alone loses 1 on average",
    )
    scatter_edge_share: float = _setting(
        0.02,
        "share of the rows",
        "so many may lie beyond an edge of the contact that no derivative sees",
        "with all rows counted, scatter stays hidden in a few logs (commit ee1786c)",
    )
    scatter_folds: int = _setting(8, "folds", "as many as `min_blocks`")
    scatter_scale: float = _setting(
        1e-4, "m", "the unit of the search: the repeatability that arms declare"
    )
    scatter_min_ratio: float = _setting(
        1e-3,
        "of scatter_scale",
        "a standard deviation of less is none: far below the encoders' 2e-5 m",
    )
    scatter_min_axis: float = _setting(
        0.15,
        "of the axis that scatters most",
        "contact is not linear: of six logs that scatter along one axis alone the "
        "others got 0.03 to 0.11 of it",
    )
    scatter_max_ratio: float = _setting(
        1e3, "of scatter_scale", "end of the search, beyond any arm that still works"
    )
    scatter_alpha: float = _setting(
        0.01,
        "1",
        "family-wise p below which where steps led depends on something; stricter "
        "than `alpha`, since many covariates are asked of each axis",
    )

    # What a flexible learner finds in what is left.
    learner_rows: int = _setting(
        1500, "rows", "more are thinned out evenly: a channel then takes half a second"
    )
    learner_folds: int = _setting(
        5, "folds", "the usual number; contiguous, so that time can't be read off"
    )
    learner_lags: tuple[int, ...] = _setting(
        (1, 4, 16), "rows", "back in time, at which quantities are seen, too"
    )
    learner_trees: int = _setting(
        50, "trees", "at `learner_rate`: about what 100 do at scikit-learn's rate, 0.1"
    )
    learner_rate: float = _setting(
        0.15, "1", "shrinkage of each tree; scikit-learn's default is 0.1"
    )
    learner_leaves: int = _setting(
        8, "leaves of a tree", "interactions of up to three quantities"
    )
    learner_leaf_rows: int = _setting(
        20, "rows", "in a leaf, scikit-learn's default: noise averages out"
    )
    learner_importance: float = _setting(
        0.25,
        "of what the most important quantity is worth",
        "what is worth less is not listed among what a channel depends on",
    )
    min_undecided: float = _setting(
        0.2,
        "of the loss that is left",
        "an effect that gains so much in nearly all blocks is not passed over, even if "
        "too few blocks decide; chosen as twice `min_left_over`",
    )
    min_left_over: float = _setting(
        0.1,
        "of a channel's mean squared residual",
        "what a learner explains of rows that it did not see; less is said nothing of: "
        "about the square of `noticeable`",
    )

    residual_model_rows: int = _setting(
        5000, "rows", "more are thinned out evenly: a channel then takes a second"
    )
    min_residual_model_gain: float = _setting(
        0.1, "of the held-out error", "a residual model that gains less is not offered"
    )

    # The verdict.
    min_explained_share: float = _setting(
        0.75,
        "share of what could be explained",
        "effects must explain three quarters of it, or the ending is unexplained",
        "19 of 25 effects that are not in the library end unexplained "
        "(docs/results/verdicts-blind.md)",
    )
    max_listed: int = _setting(
        3, "items", "of anything in the text of a verdict, which has three lines"
    )


#: The defaults.
DEFAULT_SETTINGS = SelectionSettings()

"""All thresholds of effect selection, each with its unit and the reason for it."""

from dataclasses import dataclass

from sysid.thresholds import threshold as _setting

_ABLATION = (
    "chosen on real recordings; halved and doubled on eight logs of the judge: "
    "docs/results/effect-selection.md"
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

    # Which effects lower the held-out loss.
    min_gain: float = _setting(
        0.05,
        "share of the held-out loss",
        "an effect that gains less is not selected: names of smaller ones differ from "
        "one half of a recording to the other",
        _ABLATION,
    )
    alpha: float = _setting(
        0.05,
        "1",
        "level of each test, and share of the confirmed effects that may be there by "
        "chance; the usual 5 %",
        _ABLATION,
    )
    blocks: int = _setting(
        48,
        "blocks of rows",
        "contiguous; folds and parts are made of them",
        _ABLATION,
    )
    folds: int = _setting(
        8,
        "folds",
        "contiguous, each predicted by a fit to the others, and left out by the "
        "jackknife: longer than noise stays correlated",
        _ABLATION,
    )
    reweightings: int = _setting(
        2,
        "times",
        "channels are divided by what is left of them without effects, then with those "
        "that are selected so",
        _ABLATION,
    )
    max_steps: int = _setting(
        20, "effects", "a guard: `min_gain` ends the selection before", _ABLATION
    )

    # Which effects can't be told apart.
    ambiguity_margin: float = _setting(
        0.1,
        "of gain or remainder, the less in each fold and channel",
        "two effects that differ by less are about as good; the one with fewer "
        "coefficients is chosen",
        _ABLATION,
    )
    ambiguity_least: float = _setting(
        0.5,
        "of the best gain",
        "an effect that gains less is not ambiguous with the best, however few folds "
        "decide",
        _ABLATION,
    )

    # Which are confirmed.
    parts: int = _setting(
        4,
        "parts of the log",
        "each is left out in turn, and the others have to select an effect, but for "
        "one part, which may be the only one in which it shows",
        _ABLATION,
    )
    # How a model with effects is fitted.
    fit_iterations: int = _setting(
        8,
        "iterations",
        "a guard: `fit_min_progress` usually ends a fit before",
        _ABLATION,
    )
    fit_min_progress: float = _setting(
        1e-3, "of the objective", "an iteration that gains less ends the fit", _ABLATION
    )
    costly_fit_iterations: int = _setting(
        6, "iterations", "fewer, where one evaluation takes seconds"
    )
    costly_fit_min_progress: float = _setting(
        0.02, "of the objective", "where one evaluation takes seconds"
    )
    fits_begun_again: int = _setting(
        3,
        "fits",
        "after each, steps begin where the wrench says without the sensor's effects as "
        "they are by then",
    )

    # Where the model is not linear in its effects, fits decide.
    trials: int = _setting(
        8,
        "effects",
        "that gain most by the linear account are fitted, and the fits compared",
    )
    search_rows: int = _setting(
        250,
        "rows",
        "a hundred evaluations of a model that takes seconds for all rows then take "
        "minutes; so do hundreds of fits far from the data",
    )
    max_linear_objective: float = _setting(
        5.0,
        "objective",
        "beyond five times the noise the linear account is not asked: the bolt is "
        "inside the model's wall, and the derivative is the wall's stiffness",
    )
    prescreen_rows: int = _setting(
        120, "rows", "there is one such fit for each effect, so it must be cheap"
    )
    prescreen_scan: tuple[float, ...] = _setting(
        (0.5, 0.2, 0.08, 0.032, 0.0128),
        "of the range on either side of null",
        "amplitudes at which a fit may begin, a factor of 2.5 apart: downhill from "
        "null ends where contact does",
    )

    # Where the noise, and the model's own error, are stated.
    noise_level: float = _setting(
        1.0,
        "objective",
        "a residual as large as the noise: nothing is left to fit",
    )
    max_objective_at_noise: float = _setting(
        1.2,
        "objective",
        "beyond it there is more than noise, where channels state their noise",
        _ABLATION,
    )
    model_error_reach: float = _setting(
        1.0,
        "standard deviations",
        "by which the model itself may be off in all rows at once, in the direction of "
        "an effect: what is less is none of a log that states such an error",
    )

    # Whether nothing is missing.
    detection_power: float = _setting(
        0.8,
        "1",
        "probability with which an effect of the detection limit is found",
        _ABLATION,
    )
    min_detectable: float = _setting(
        0.9,
        "share of the kinds of effects",
        "that a log must be able to show for a verdict of nothing missing",
    )
    max_relative_error: float = _setting(
        0.25,
        "of what was measured",
        "a held-out error that is more is said in the verdict, whatever passed",
        _ABLATION,
    )

    # What is said of what is left.
    min_left_over: float = _setting(
        0.1,
        "of a channel's mean squared residual",
        "what a flexible learner explains of rows that it did not see",
        _ABLATION,
    )


#: The defaults.
DEFAULT_SETTINGS = SelectionSettings()

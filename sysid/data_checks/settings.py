"""All thresholds of the checks of the data, each with its unit and the reason."""

from dataclasses import dataclass

from drake_disasm.logs.importing.repeats import COARSE, FEWEST
from sysid.models.rate_factors import MOST_TURN
from sysid.thresholds import threshold

_FALSE_ALARMS = "false alarms: docs/guides/identify.md"


@dataclass(frozen=True)
class DataSettings:
    """Thresholds of the checks of the data; metadata as of `SelectionSettings`."""

    # Readings at rest.
    rest_window: float = threshold(
        0.5,
        "s",
        "a row is compared with those so near in time; an arm takes longer from one "
        "pose to the next, its sensor to settle",
    )
    rest_rate: float = threshold(
        0.02,
        "rad/s",
        "one degree a second is rest: encoders resolve less, and centripetal loads are "
        "a thousandth of gravity's",
    )
    rest_angle: float = threshold(
        2e-3, "rad", "the noise of an orientation that two rows may differ by"
    )

    # Contact in readings at rest.
    contact_angle: float = threshold(
        0.02,
        "rad",
        "between directions of gravity in S: they change a weight by a fiftieth",
    )
    contact_share: float = threshold(
        0.1,
        "of the variance of the forces",
        "what a sensor does fast at one orientation is far less than a load's weight",
    )
    contact_noise: float = threshold(
        2.0,
        "times the noise from row to row",
        "white noise is one, with t's 3 degrees of freedom one and a half",
    )
    contact_rows: int = threshold(
        30, "rows", "that others have the orientation of: fewer tell no spread"
    )
    contact_most_rows: int = threshold(
        1500, "rows", "that are compared with each other, in pairs"
    )

    # Time.
    time_deviation: float = threshold(
        0.5, "of the median step", "a step that is longer or shorter by half jumps"
    )
    time_mads: float = threshold(
        10.0,
        "median absolute deviations",
        "in a log that is not evenly sampled long steps are usual",
    )
    period_deviation: float = threshold(
        0.1, "of the stated period", "clocks of one device differ by far less"
    )

    # Derivatives.
    derivative_share: float = threshold(
        0.5,
        "of what the derivative says",
        "half is far beyond any smoothing: real filtered logs reach 0.2 inside",
    )
    derivative_mads: float = threshold(
        10.0,
        "median absolute deviations",
        "for each joint: beyond noise and the trapezoidal rule's error",
    )
    derivative_rows: int = threshold(
        5, "rows", "fewer are the corners that an impact makes, or a spike"
    )

    # Channels that don't change.
    dead_channel_change: float = threshold(
        10.0,
        "times the noise",
        "a channel that never changes is dead if the model expects so much change",
    )
    dead_channel_rows: int = threshold(
        5, "rows", "of fewer, two equal values of a coarse channel are chance"
    )
    stuck_rows: int = threshold(
        FEWEST, "rows", "a value that is repeated less often may be chance of a quantum"
    )
    stuck_share: float = threshold(
        COARSE,
        "of the other rows",
        "where more of them repeat the one before, the channel is coarse, not stuck",
    )
    quantum_noise: float = threshold(
        2.0,
        "times the noise",
        "rounding to finer steps adds less than a third of the noise's variance",
    )

    # wrench against ft_sensor.
    processing_noise: float = threshold(
        6.0, "times the noise", "below it a fit would not notice"
    )
    processing_share: float = threshold(
        0.1,
        "of the range of the channel",
        "thesis's small-angle equations and a payload that is not known differ less",
    )

    # Units.
    unit_band: float = threshold(
        3.0,
        "factor",
        "a scale so near to 1000, or to 180 / pi, is that of a wrong unit: a model's "
        "own scale is never so far off 1",
    )
    unit_correlation: float = threshold(
        0.9, "1", "of measured and expected, for their scale to mean anything"
    )
    longest_lever: float = threshold(
        3.0, "m", "from the sensor to the centre of mass of what an arm carries"
    )
    greatest_payload: float = threshold(2000.0, "kg", "no arm carries more")
    pose_reach: float = threshold(
        20.0, "times the task's travel", "a bolt is never so far from its groove"
    )
    most_turn: float = threshold(
        MOST_TURN, "rad or m", "half of an arm's joints never go so far: three turns"
    )

    # Axes and delays.
    least_signal: float = threshold(
        3.0,
        "times the noise",
        "rms of a channel that axes or delays are judged by",
    )
    least_change: float = threshold(
        0.1, "of a channel's size", "a channel that is changed less stays as it is"
    )
    explained: float = threshold(
        0.4,
        "of the error as it is",
        "mean error that other axes, or a shift, must lower it to: far better, since "
        "physical effects shift and turn a little, too",
        _FALSE_ALARMS,
    )
    explained_share: float = threshold(
        0.6,
        "of the mean size of the channel",
        "what is left with other axes must be less: else these explain nothing either",
    )
    most_shift: int = threshold(5, "rows", "a channel that is later is noticed at once")

    # Spikes.
    spike_alpha: float = threshold(
        1e-3,
        "1",
        "that the largest row of a column is beyond what its tail says",
        _FALSE_ALARMS,
    )
    least_spike: float = threshold(
        10.0,
        "times what nine of ten rows are below",
        "less is no spike, however light the tail: 16 standard deviations",
        _FALSE_ALARMS,
    )
    spike: float = threshold(
        25.0,
        "times what nine of ten rows are below",
        "more is a spike, however heavy the tail, which several spikes make heavier: "
        "with t's 3 degrees of freedom one row in 10^5 is beyond it",
        _FALSE_ALARMS,
    )
    spike_noise: float = threshold(
        5.0, "times the noise", "a log without noise has rows beyond anything"
    )
    most_spikes: float = threshold(
        0.05, "of the rows", "more are no spikes but how the channel is"
    )

    # Cost.
    most_rows: int = threshold(
        4000, "rows", "of a linear model, that axes and delays are judged by"
    )


#: The defaults.
DEFAULT_DATA_SETTINGS = DataSettings()

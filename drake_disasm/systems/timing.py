"""When the MDP's systems act within a period."""

#: The MDP's systems act this long after each multiple of the period [s]. The plant
#: steps at those multiples too, but k * 0.1 and 40 k * 0.0025 differ in the last bit
#: for some k, so without the delay some periods would hold a plant step more than
#: others. It is far above rounding and far below a plant step.
SAMPLING_DELAY = 1e-6


def boundary(steps: int, period: float) -> float:
    """Returns the time [s] between the plant's last step and the MDP's next act.

    What is read there is what the policy will see, and the last step's reward.
    """
    return steps * period + SAMPLING_DELAY / 2

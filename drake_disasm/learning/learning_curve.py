"""Learning curves: reward and success against episodes, over seeds."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.common.files import write_figure
from drake_disasm.learning.statistics import (
    bootstrap_interval,
    interquartile_mean,
    moving_mean,
)
from drake_disasm.mdp import Outcome

_WINDOW = 10  # episodes that the curves are smoothed over

#: Rows of `episodes.csv` of each seed of one training.
Seeds = Sequence[Sequence[Mapping[str, Any]]]


def plot_learning_curves(trainings: Mapping[str, Seeds], path: Path) -> None:
    """Draws reward and success rate against episodes, and writes a PNG.

    Lines are interquartile means over the seeds of the mean over the last ten
    episodes, bands their bootstrap 95 % intervals, and for a single training the
    thin lines are its seeds. Each is drawn as far as all of its seeds have come.

    Args:
        trainings: label to the episodes of each seed.
        path: of the PNG.

    Raises:
        DisasmError: it can't be written.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(
        2, 1, sharex=True, figsize=(8, 7), layout="constrained"
    )
    for number, (label, seeds) in enumerate(trainings.items()):
        rewards = _curves([[s["reward"] for s in episodes] for episodes in seeds])
        success = _curves(
            [
                [100.0 * (s["outcome"] == Outcome.SUCCESS.label) for s in e]
                for e in seeds
            ]
        )
        colour = f"C{number}"
        name = f"{label} ({len(seeds)} seed{'s' if len(seeds) > 1 else ''})"
        _draw(axes[0], rewards, name, colour, thin=len(trainings) == 1)
        _draw(axes[1], success, name, colour, thin=len(trainings) == 1)
    _label(axes)
    write_figure(path, figure)
    pyplot.close(figure)


def _label(axes: Any) -> None:
    axes[0].set_ylabel("episodic reward")
    axes[1].set_ylabel("successful episodes [%]")
    axes[1].set_xlabel("episode")
    axes[1].set_ylim(-3, 103)
    axes[0].set_title(
        f"mean of the last {_WINDOW} episodes: interquartile mean over seeds, "
        "95 % bootstrap interval",
        fontsize="medium",
    )
    axes[0].legend(loc="best")
    for axis in axes:
        axis.grid(alpha=0.3)


def _curves(values: Sequence[Sequence[float]]) -> np.ndarray:
    """Returns (seeds, episodes), up to the shortest training."""
    length = min(len(row) for row in values)
    return np.stack([moving_mean(row[:length], _WINDOW) for row in values])


def _draw(axis: Any, curves: np.ndarray, label: str, colour: str, thin: bool) -> None:
    episodes = np.arange(1, curves.shape[1] + 1)
    if thin and len(curves) > 1:
        axis.plot(episodes, curves.T, color=colour, alpha=0.25, linewidth=0.7)
    if len(curves) > 1:
        low, high = bootstrap_interval(curves, np.random.default_rng(0))
        axis.fill_between(episodes, low, high, color=colour, alpha=0.2, linewidth=0)
    axis.plot(episodes, interquartile_mean(curves), color=colour, label=label)

"""Figures of a factorial design: main effects, and interactions of two factors."""

import itertools
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from drake_disasm.common.files import write_figure
from sysid.studies.factorial import Runs, level_averages


def plot_main_effects(sets: Mapping[str, Runs], path: Path) -> None:
    """Draws the average response by level of each factor, and writes a PNG.

    Bars are 95 % intervals of the averages, from the spread at each level.

    Args:
        sets: runs of the same factors, by what the legend calls them.
        path: of the PNG.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    factors = list(next(iter(sets.values())).levels)
    figure, axes = pyplot.subplots(
        1, len(factors), sharey=True, figsize=(2.6 * len(factors), 3.4),
        layout="constrained", squeeze=False,
    )  # fmt: skip
    for label, runs in sets.items():
        for axis, own in zip(axes[0], level_averages(runs), strict=True):
            count = len(runs.response) / len(own.levels)
            axis.errorbar(
                [f"{level:g}" for level in own.levels],
                own.average,
                1.96 * own.spread / np.sqrt(count),
                marker="o",
                capsize=3,
                label=label,
            )
            axis.set_title(own.factor, fontsize="medium")
            axis.grid(alpha=0.3)
    axes[0, 0].set_ylabel("average P")
    axes[0, 0].legend()
    write_figure(path, figure)
    pyplot.close(figure)


def plot_interactions(runs: Runs, path: Path) -> None:
    """Draws the average response by two factors at a time, and writes a PNG.

    Lines that are not parallel show an interaction.

    Args:
        runs: of a design of two factors or more.
        path: of the PNG.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    pairs = list(itertools.combinations(runs.levels, 2))
    columns = min(3, len(pairs))
    rows = -(-len(pairs) // columns)
    figure, axes = pyplot.subplots(
        rows, columns, sharey=True, figsize=(3.4 * columns, 3.0 * rows),
        layout="constrained", squeeze=False,
    )  # fmt: skip
    for axis in axes.flat[len(pairs) :]:
        axis.set_visible(False)
    for axis, (across, line) in zip(axes.flat, pairs, strict=False):
        for level in np.unique(runs.levels[line]):
            own = runs.levels[line] == level
            steps = np.unique(runs.levels[across])
            means = [
                runs.response[own & (runs.levels[across] == step)].mean()
                for step in steps
            ]
            text = [f"{step:g}" for step in steps]
            axis.plot(text, means, marker="o", label=f"{level:g}")
        axis.set_xlabel(across)
        axis.legend(title=line, fontsize="small", title_fontsize="small")
        axis.grid(alpha=0.3)
    for axis in axes[:, 0]:
        axis.set_ylabel("average P")
    write_figure(path, figure)
    pyplot.close(figure)

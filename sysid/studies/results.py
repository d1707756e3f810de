"""Tables of all that was measured, and cells: rates, means and their intervals."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from drake_disasm.learning.statistics import wilson_interval
from sysid.studies.runner import SeedResult, read_test
from sysid.studies.study import PolicyTest, Table

_BEYOND = 1e6  # in whatever unit: no figure of a study is so large


def rate(successes: int, trials: int) -> str:
    """Returns a rate with Wilson's 95 % interval."""
    if trials == 0:
        return "-"
    low, high = (100.0 * end for end in wilson_interval(successes, trials))
    return f"{successes}/{trials} ({low:.0f} to {high:.0f} %)"


def decimals(value: float, digits: int) -> str:
    """Returns a number with so many decimals, or its order if it is out of all bounds.

    It is where a twin's contact throws the bolt away.
    """
    return f"{value:.{digits}f}" if abs(value) < _BEYOND else f"{value:.1e}"


def mean_of(values: Sequence[float], digits: int = 1) -> str:
    """Returns mean and standard deviation, if there are any values."""
    if not len(values):
        return "-"
    mean = float(np.mean(values))
    spread = float(np.std(values, ddof=1)) if len(values) > 1 else 0.0
    return f"{decimals(mean, digits)} ± {decimals(spread, digits)}"


def mean_interval(values: Sequence[float]) -> tuple[float, tuple[float, float]]:
    """Returns the mean of two values or more, and its 95 % interval by Student's t."""
    mean, count = float(np.mean(values)), len(values)
    half = float(stats.t.ppf(0.975, count - 1) * np.std(values, ddof=1))
    half /= math.sqrt(count)
    return mean, (mean - half, mean + half)


def paired_difference(one: Mapping[int, float], other: Mapping[int, float]) -> str:
    """Returns the mean of one less the other, and its 95 % interval by Student's t.

    Args:
        one, other: figures by seed; those that both have are compared.
    """
    d = [one[seed] - other[seed] for seed in one if seed in other]
    if len(d) < 2:
        return "-"
    mean, (low, high) = mean_interval(d)
    return f"{mean:+.2f} ({low:+.2f} to {high:+.2f}; {len(d)})"


def aligned(cells: Sequence[Sequence[str]]) -> list[str]:
    """Returns the rows of a table for a terminal, columns aligned to the right."""
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return [
        "  ".join(text.rjust(width) for text, width in zip(row, widths, strict=True))
        for row in cells
    ]


def instability_index(results: Sequence[SeedResult]) -> tuple[float, int]:
    """Returns the index I_s, and of how many trainings (thesis, eq. 3.5).

    I_s = sum over trainings of sigma_i / N_i: the standard deviation of the episodic
    reward in validation, and the number of episodes that succeed. A training without
    any has no N_i and is left out; the second number says how many are not.
    """
    own = [r.validation for r in results if r.validation["successes"]]
    return sum(v["instability"] / v["successes"] for v in own), len(own)


def every_seed(results: Sequence[SeedResult]) -> Table:
    """Returns a table of what each seed of each treatment came to."""
    rows = []
    for r in results:
        training = r.figures.get("training")
        rows.append(
            [
                r.treatment.folder,
                str(r.seed),
                str(r.figures.get("first_success") or "-"),
                decimals(training["performance"], 2) if training else "-",
                *_greedy_cells(r.validation),
            ]
        )
    columns = ("treatment", "seed", "first success", "P", *_GREEDY_COLUMNS)
    return Table("Every seed", columns, rows)


def every_test(tests: Sequence[PolicyTest], folder: Path) -> Table:
    """Returns a table of what each policy does in a test, of those that are finished.

    Args:
        tests: of policies.
        folder: of the study.
    """
    rows = [
        [str(test.path.relative_to(folder).with_suffix("")), *_greedy_cells(figures)]
        for test in tests
        if (figures := read_test(test.path)) is not None
    ]
    note = "By the file of its figures, which says what acts where."
    return Table("Every test of a policy", ("test", *_GREEDY_COLUMNS), rows, note)


def _greedy_cells(figures: Mapping[str, Any]) -> list[str]:
    """Returns the cells of greedy episodes' figures, as in `_GREEDY_COLUMNS`."""
    names = ("performance", "instability", "mean_force", "peak_force")
    return [
        f"{figures['successes']}/{figures['episodes']}",
        *(decimals(figures[name], 2) for name in names),
        decimals(figures["steps"], 1),
    ]


_GREEDY_COLUMNS = (
    "greedy success",
    "greedy reward",
    "its spread",
    "mean force [N]",
    "peak force [N]",
    "steps",
)

"""Full factorial designs: averages and ranges of levels, analysis of variance.

The thesis has averages and ranges alone (table 5.3) and names interactions as future
work; both come from the same rows.
"""

import csv
import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.text import clipped

_MOST_BYTES = 10_000_000


@dataclasses.dataclass(frozen=True)
class Runs:
    """What was measured in each run of a design.

    Attributes:
        levels: (n,) of each factor, by its name.
        response: (n,) measured.
    """

    levels: Mapping[str, np.ndarray]
    response: np.ndarray


@dataclasses.dataclass(frozen=True)
class LevelAverages:
    """A factor's main effect.

    Attributes:
        factor: its name.
        levels, average, spread: (k,) each level, mean and standard deviation of the
            response at it.
    """

    factor: str
    levels: np.ndarray
    average: np.ndarray
    spread: np.ndarray

    @property
    def range(self) -> float:
        """Largest difference between averages (table 5.3)."""
        return float(np.ptp(self.average))


@dataclasses.dataclass(frozen=True)
class Source:
    """A row of the analysis of variance.

    Attributes:
        factors: one for a main effect, two for an interaction, none for the residual.
        sum_of_squares: of the response.
        freedom: degrees of freedom.
        F, p: of the F test against the residual; NaN for that itself.
    """

    factors: tuple[str, ...]
    sum_of_squares: float
    freedom: float
    F: float
    p: float


def level_averages(runs: Runs) -> list[LevelAverages]:
    """Returns the averages of each factor's levels."""
    found = []
    for factor, levels in runs.levels.items():
        known = np.unique(levels)
        own = [runs.response[levels == level] for level in known]
        average = np.array([values.mean() for values in own])
        spread = np.array([values.std(ddof=1) for values in own])
        found.append(LevelAverages(factor, known, average, spread))
    return found


def analysis_of_variance(runs: Runs) -> list[Source]:
    """Returns the variance that main effects and two-way interactions explain.

    Sums of squares are of type II; a factor with one level is left out. In a balanced
    design they add up.

    Raises:
        DisasmError: statsmodels is not installed, or there are too few runs.
    """
    try:
        import pandas
        from statsmodels.formula.api import ols
        from statsmodels.stats.anova import anova_lm
    except ImportError:
        raise DisasmError(
            "analysis of variance needs statsmodels; "
            "pip install 'drake_disasm[studies]'"
        ) from None
    names = [name for name, own in runs.levels.items() if len(np.unique(own)) > 1]
    if not names:
        return []
    frame = pandas.DataFrame({n: runs.levels[n] for n in names} | {"y": runs.response})
    fitted = ols("y ~ (" + " + ".join(f"C({n})" for n in names) + ") ** 2", frame).fit()
    if fitted.df_resid < 1:
        raise DisasmError(
            f"analysis of variance: {len(frame)} runs are too few; study more seeds"
        )
    table = anova_lm(fitted, typ=2)
    return [
        Source(
            tuple(n for n in names if f"C({n})" in label.split(":")),
            float(row["sum_sq"]),
            float(row["df"]),
            float(row["F"]),
            float(row["PR(>F)"]),
        )
        for label, row in table.iterrows()
    ]


def read_runs(path: Path, factors: Sequence[str]) -> Runs:
    """Returns the runs in a CSV file with a row for each combination.

    Columns are named as the factors, in any order, or by what they end in; those whose
    names begin with "performance" are replications of the response.

    Raises:
        DisasmError: it can't be read, or has no such columns.
    """
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise DisasmError(f"{path}: is larger than {_MOST_BYTES} bytes")
        with path.open(newline="") as file:
            rows = list(csv.DictReader(file))
        columns = list(rows[0]) if rows else []
        replications = [c for c in columns if c.startswith("performance")]
        missing = [name for name in factors if name not in columns]
        if missing or not replications:
            raise DisasmError(
                f"{path}: has no column {', '.join(missing) or 'performance...'}; it "
                f"needs {', '.join(factors)} and performance_1 ..."
            )
        each = [(row, float(row[c])) for row in rows for c in replications]
        levels = {n: np.array([float(row[n]) for row, _ in each]) for n in factors}
        return Runs(levels, np.array([value for _, value in each]))
    except (OSError, UnicodeDecodeError, ValueError, TypeError, csv.Error) as error:
        raise DisasmError(f"{path}: can't be read: {clipped(str(error))}") from None

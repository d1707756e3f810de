"""Averages, ranges and analysis of variance of a full factorial."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from sysid.studies.factorial import (
    Runs,
    analysis_of_variance,
    level_averages,
    read_runs,
)
from tests.refusals import refused

_TABLE_A1 = Path(__file__).parents[3] / "../shared/reference/table_a1.csv"
_COLUMNS = ("batch_size", "tau", "actor_learning_rate", "critic_learning_rate")


def _design(interaction: float, noise: float) -> Runs:
    """Returns 3 x 3 x 2 runs, four of each: y = 2 a + interaction a b + noise."""
    random = np.random.default_rng(7)
    rows = list(itertools.product((-1, 0, 1), (-1, 0, 1), (0, 1), range(4)))
    a, b, c, _ = np.array(rows, dtype=float).T
    y = 2.0 * a + interaction * a * b + noise * random.standard_normal(len(a))
    return Runs({"a": a, "b": b, "c": c}, y)


@pytest.mark.skipif(not _TABLE_A1.exists(), reason="../shared is not there")
def test_the_thesis_table_gives_its_printed_averages_and_ranges() -> None:
    runs = read_runs(_TABLE_A1, _COLUMNS)
    found = {own.factor: own for own in level_averages(runs)}
    assert len(runs.response) == 243
    assert found["batch_size"].average == pytest.approx([-5.02, -6.88, -6.29], abs=6e-3)
    assert found["tau"].average == pytest.approx([-9.23, -4.77, -4.19], abs=6e-3)
    ranges = [found[name].range for name in _COLUMNS]
    assert ranges == pytest.approx([1.87, 5.04, 18.09, 12.72], abs=6e-3)


def test_only_what_is_there_is_significant() -> None:
    p = {s.factors: s.p for s in analysis_of_variance(_design(0.0, 1.0))}
    assert p["a",] < 1e-6
    assert min(p["b",], p["c",], p["a", "b"], p["a", "c"]) > 0.01
    p = {s.factors: s.p for s in analysis_of_variance(_design(1.5, 1.0))}
    assert p["a", "b"] < 1e-6


def test_sums_of_squares_of_a_balanced_design_add_up() -> None:
    runs = _design(0.7, 0.5)
    sources = analysis_of_variance(runs)
    total = np.sum((runs.response - runs.response.mean()) ** 2)
    assert sum(s.sum_of_squares for s in sources) == pytest.approx(total)
    a = next(s for s in sources if s.factors == ("a",))
    [own] = [each for each in level_averages(runs) if each.factor == "a"]
    between = len(runs.response) / 3 * np.sum((own.average - runs.response.mean()) ** 2)
    assert a.sum_of_squares == pytest.approx(between) and a.freedom == 2


def test_a_factor_with_one_level_is_left_out() -> None:
    runs = _design(0.0, 1.0)
    runs = Runs({**runs.levels, "c": np.zeros(len(runs.response))}, runs.response)
    assert {n for s in analysis_of_variance(runs) for n in s.factors} == {"a", "b"}


@pytest.mark.parametrize(("text", "said"), [
    ("a,performance_1\n1,2\n", "has no column b"),
    ("a,b\n1,2\n", "has no column performance"),
    ("a,b,performance\n1,x,2\n", "could not convert"),
    ("", "has no column"),
    ("a,b,performance\n0,0,0\n0,1,1\n1,0,2\n1,1,3\n", "4 runs are too few"),
])  # fmt: skip
def test_a_table_that_does_not_fit_is_refused(tmp_path, text, said):
    path = tmp_path / "runs.csv"
    path.write_text(text)
    with refused(said):
        analysis_of_variance(read_runs(path, ("a", "b")))

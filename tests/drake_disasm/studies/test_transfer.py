"""The transfer study: who trains where, and what is made of the results."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import pytest
from scipy import stats

from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.evaluation import Evaluation
from drake_disasm.learning.experiment import Experiment
from drake_disasm.learning.hyperparameters import preset
from drake_disasm.learning.run import write_episodes
from drake_disasm.learning.warm_start import check_start
from drake_disasm.scenario import load_scenario
from drake_disasm.studies.transfer import (
    TransferStudy,
    paired_differences,
    results,
    table,
    write_results,
)
from drake_disasm.task.episode import EpisodeSummary


def _study(folder: Path) -> TransferStudy:
    before, after, real = (
        load_scenario("removal", [f"name={name}"]) for name in ("A", "B", "hidden")
    )
    common = Experiment(before, "twin", "best", preset("best"))
    return TransferStudy(before, after, real, "cell", common, 60, 0.5, folder)


def test_each_part_trains_where_it_should(tmp_path: Path) -> None:
    parts = _study(tmp_path).experiments()
    where = {name: (e.scenario.name, e.station) for name, e in parts.items()}
    assert where == {
        "twin_before": ("A", "twin"),
        "twin_after": ("B", "twin"),
        "untrained": ("hidden", "cell"),
        "from_before": ("hidden", "cell"),
        "from_after": ("hidden", "cell"),
    }
    assert {n: Path(e.start).name for n, e in parts.items() if e.start} == {
        "from_before": "twin_before",
        "from_after": "twin_after",
    }
    assert {n for n, e in parts.items() if e.config.demonstrations} == {
        "from_before",
        "from_after",
    }
    assert [e.config.episodes for e in parts.values()] == [150, 150, 60, 60, 60]


def test_nobody_goes_on_from_a_training_that_is_not_finished(tmp_path: Path) -> None:
    part = _study(tmp_path).experiments()["from_after"]
    with pytest.raises(DisasmError, match="twin_after: has not finished seed 0"):
        check_start(part, [0])


#: An evaluation's names; counts are whole numbers.
FIGURES = {f.name: 0.0 for f in dataclasses.fields(Evaluation)} | {"truly_out": 0}


def _finish(folder: Path, seed: int, P: float, **files: Any) -> None:
    """Leaves behind what a finished training does."""
    folder = folder / f"seed_{seed:03d}"
    folder.mkdir(parents=True)
    figures = FIGURES | {"performance": P, "successes": 3, "episodes": 4}
    result = {"seed": seed, "first_success": 2, "training": figures}
    result["validation"] = figures | {"performance": P + 1.0, "successes": 4}
    for name, content in {"result": result, **files}.items():
        (folder / f"{name}.json").write_text(json.dumps(content))
    episodes = [EpisodeSummary(i, {"progress": P}) for i in range(4)]
    write_episodes(folder / "episodes.csv", episodes)


def test_the_table_counts_finished_seeds_alone(tmp_path: Path) -> None:
    greedy = FIGURES | {"performance": -7.0, "successes": 1, "episodes": 4}
    for seed, P in ((0, 1.0), (1, 2.0)):
        _finish(tmp_path / "untrained", seed, P)
    _finish(tmp_path / "from_after", 0, 5.0, deployed=greedy)
    (tmp_path / "from_after/seed_001").mkdir()
    (tmp_path / "from_after/seed_001/deployed.json").write_text(json.dumps(greedy))
    rows = results(tmp_path)
    assert [(r["folder"], r["P"], r["deployed"]) for r in rows] == [
        ("untrained", [1.0, 2.0], []),
        ("from_after", [5.0], [-7.0]),
    ]
    lines = table(rows).splitlines()
    assert "1.5" in lines[1] and "1.0, 2.0" in lines[1] and "75 %" in lines[1]
    assert "-7.0, 25 %" in lines[2] and "6.0, 100 %" in lines[2]
    assert write_results(tmp_path, {}) == table(rows)
    assert (tmp_path / "transfer.png").stat().st_size > 0


def test_nothing_finished_is_said(tmp_path: Path) -> None:
    assert "no training in the stand-in is finished" in write_results(tmp_path, {})


def _row(folder: str, **P: float) -> dict[str, Any]:
    seeds = [int(name[1:]) for name in P]
    return {"folder": folder, "label": folder, "seeds": seeds, "P": list(P.values())}


def test_what_closing_the_loop_adds_is_compared_seed_by_seed() -> None:
    rows = [
        _row("untrained", s0=5.0),
        _row("from_before", s0=10.0, s1=40.0, s2=20.0, s7=99.0),
        _row("from_after", s2=23.0, s0=12.0, s1=44.0),
    ]
    [found] = paired_differences(rows)  # one seed is no pair of seeds
    assert found.against == "from_before" and set(found.seeds) == {0, 1, 2}
    expected = stats.ttest_1samp([2.0, 4.0, 3.0], 0.0).confidence_interval(0.95)
    assert found.mean == pytest.approx(3.0)
    assert found.interval == pytest.approx((expected.low, expected.high))
    assert "+3.0 (95 %: +0.5 to +5.5; 3 seeds in pairs)" in found.text


def test_without_the_closed_branch_there_is_no_difference() -> None:
    assert paired_differences([_row("from_before", s0=1.0, s1=2.0)]) == []

"""Studies: their levels, what they train, and the same bits whatever does the work."""

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.studies import STUDIES
from sysid.studies.report import as_text, write_report
from sysid.studies.runner import open_study, run_study
from sysid.studies.study import Study, StudyOptions
from tests.refusals import refused

_ORIGIN = {"command": "python tools/study.py", "commit": "abc", "date": "today"}


def _study(name: str, **changes: Any) -> Study:
    """Returns a study of seconds."""
    options: dict[str, Any] = {
        "seeds": (0, 1),
        "episodes": 2,
        "validation": 2,
        "changes": ("hidden=[8]",),
        "overrides": ("task.steps=4",),
        "compiled": False,
        "provenance": _ORIGIN,
    }
    return STUDIES[name](StudyOptions(**(options | changes)))


def small_precision(levels: tuple[str, ...] = ("0", "0.0003"), **changes: Any) -> Study:
    """Returns two trainings at each of two imprecisions."""
    return _study("precision", levels={"agent": ["ddpg"], "psi": levels}, **changes)


def bits(folder: Path) -> dict[str, str]:
    """Returns a hash of each policy's parameters and each training's episodes."""
    found = {}
    for path in folder.rglob("policy.npz"):
        with np.load(path) as arrays:
            own = [arrays[k] for k in sorted(arrays) if arrays[k].dtype == "f4"]
            data = b"".join(array.tobytes() for array in own)
        found[str(path.relative_to(folder))] = hashlib.sha256(data).hexdigest()
    for path in folder.rglob("episodes.csv"):
        text = hashlib.sha256(path.read_bytes()).hexdigest()
        found[str(path.relative_to(folder))] = text
    return found


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study") / "out"
    _run(small_precision(), folder)
    return folder


def _run(study: Study, folder: Path, workers: int = 1) -> None:
    open_study(study, folder, resume=False)
    run_study(study, folder, workers)


@pytest.mark.parametrize("name", sorted(STUDIES.keys() - {"twin_transfer"}))
def test_a_study_trains_all_combinations_of_its_levels(name: str) -> None:
    study = _study(name)
    first = next(study.stages(Path("nowhere")))
    count = np.prod([len(factor.levels) for factor in study.factors])
    assert len({t.folder for t in first.treatments}) == count
    for treatment in first.treatments:
        own, levels = treatment.experiment, dict(treatment.levels)
        assert levels.pop("psi", own.scenario.imprecision) == own.scenario.imprecision
        agent = levels.pop("agent", "")
        assert own.preset == "best" or agent in ("", own.config.algorithm)
        for factor, level in levels.items():
            assert getattr(own.config, factor) == level


def test_the_hyperparameter_study_is_the_thesis_s_of_243_trainings() -> None:
    study = STUDIES["hyperparameters"](StudyOptions(seeds=(0, 1, 2)))
    [stage] = study.stages(Path("nowhere"))
    assert len(stage.treatments) * len(stage.seeds) == 243
    config = stage.treatments[0].experiment.config
    assert (config.episodes, config.schedule) == (100, "every_step")
    # What is not studied is refused.
    for levels, word in (({"psi": ["0.3"]}, "psi=0.3"), ({"phi": ["0"]}, "phi")):
        with refused(word, "stud"):
            STUDIES["precision"](StudyOptions((0,), levels))


def test_a_report_has_every_seed_and_the_command(done: Path) -> None:
    policies = sorted(path.parent.name for path in done.glob("pooled/*/policy.npz"))
    assert policies == ["seed_000", "seed_001"]
    assert not list(done.glob("pooled/*/log"))  # it never acted
    tables = write_report(small_precision(), done, _ORIGIN)
    assert "thesis: DDPG" in as_text(tables[0]) and "70 %" in as_text(tables[0])
    for kind in ("md", "html"):
        text = (done / f"report.{kind}").read_text()
        assert "python tools/study.py" in text and "Commit abc" in text
        for treatment in ("agent_ddpg__psi_0.0003", "pooled"):
            assert treatment in text
    rows = (done / "results.csv").read_text().splitlines()[1:]
    assert [row[:9] for row in rows][-2:] == ["pooled,0,", "pooled,1,"]
    assert len(rows) == 6
    assert (done / "curves_ddpg.png").read_bytes().startswith(b"\x89PNG")
    # Which command it is of, and which began the folder.
    assert "begun" not in (done / "report.md").read_text()
    own = {"command": "python tools/study.py --resume", "commit": "def", "date": "now"}
    write_report(small_precision(provenance=own), done, _ORIGIN)
    assert "begun at commit abc, today, by" in (done / "report.md").read_text()


def test_a_study_resumes_with_more_seeds_and_changes_nothing_else(done: Path) -> None:
    before, study = bits(done), small_precision(seeds=(0, 1, 2))
    with refused("resume"):
        open_study(study, done, resume=False)
    assert open_study(study, done, resume=True)["provenance"] == _ORIGIN
    stage = next(study.stages(done))
    assert list(stage.seeds) == [0, 1, 2]
    run_study(small_precision(), done)
    assert bits(done) == before
    with refused("'precision', not 'base"):
        open_study(_study("baselines"), done, resume=True)
    with refused("another episodes (2, not 3)"):
        open_study(small_precision(episodes=3), done, resume=True)


def test_policies_are_judged_on_robots_of_other_precision(tmp_path: Path) -> None:
    levels = {"agent": ["td3"], "psi": ["0", "0.0005"]}
    study = _study("precision_transfer", levels=levels, episodes=1)
    _run(study, tmp_path / "out")
    tables = write_report(study, tmp_path / "out", _ORIGIN)
    assert [row[:2] for row in tables[0].rows] == [["td3", "0"], ["td3", "0.5"]]
    assert all("(" in cell for row in tables[0].rows for cell in row[2:])
    assert tables[2].rows[0][2].startswith("0/4")
    more, less = tables[3].rows[0][1:]
    assert "to" in more and "to" in less  # two seeds make an interval
    # No policy is tested again at its own precision: that is its validation.
    rows = (tmp_path / "out" / "tests.csv").read_text().splitlines()[1:]
    tested = {row.split(",")[0] for row in rows}
    own = "agent_td3__psi_0.0005/seed_000"
    assert f"{own}/tests/psi_0" in tested
    assert f"{own}/tests/psi_0.0005" not in tested
    values = [
        json.loads(path.read_text())["validation"]["performance"]
        for path in sorted(
            (tmp_path / "out/agent_td3__psi_0.0005").rglob("result.json")
        )
        if path.parent.name.startswith("seed_")
    ]
    assert tables[0].rows[1][4].startswith(f"{np.mean(values):.1f}")


def test_classical_control_stands_beside_every_agent(tmp_path: Path) -> None:
    study = _study(
        "baselines", levels={"agent": ["ddpg"], "psi": ["0"]}, seeds=(0,),
        overrides=("task.steps=70", "task.success=travelled"), validation=1, episodes=1,
    )  # fmt: skip
    _run(study, tmp_path / "out")
    [table] = study.tables(tmp_path / "out")
    rows = {row[0]: row for row in table.rows}
    assert list(rows) == ["straight", "admittance", "ddpg"]
    assert rows["admittance"][2].startswith("1/1")
    assert rows["ddpg"][1] == "1"


def test_factors_are_analysed_as_the_thesis_s(tmp_path: Path) -> None:
    levels = {"batch": ["100"], "critic_rate": ["0.005"]}
    levels |= {"tau": ["0.1", "0.9"], "actor_rate": ["0.005", "0.5"]}
    study = _study("hyperparameters", levels=levels, validation=1, episodes=1)
    _run(study, tmp_path / "out")
    averages, variance, best, spent = study.tables(tmp_path / "out")
    assert ["tau", "0.1"] in [list(row[:2]) for row in averages.rows]
    expected = {"tau", "actor_rate", "tau x actor_rate", "residual"}
    assert {row[0] for row in variance.rows} == expected
    assert len(best.rows) == 4 and len(spent.rows) == 3
    for picture in study.pictures(tmp_path / "out"):
        picture.draw(tmp_path / picture.name)
        assert (tmp_path / picture.name).read_bytes().startswith(b"\x89PNG")

"""The study of what closing the loop is worth: who trains where, and its tables."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_disasm.common.files import write_text
from drake_disasm.common.progress import ignore_progress
from drake_disasm.effects import GroovePose, SensorBias
from drake_disasm.learning import learning_curve
from drake_disasm.learning.evaluation import Evaluation
from drake_disasm.learning.experiment import seed_folder
from drake_disasm.logs import read_log
from drake_disasm.mdp import REWARD_TERMS
from drake_disasm.policies import load_policy
from drake_disasm.scenario import dump_scenario, load_scenario, validate
from sysid.acceptance.corrected_twin import CorrectedTwin, refused_verdict
from sysid.studies import twin_transfer
from sysid.studies.closed_twin import ClosedTwin, with_effects
from sysid.studies.mismatches import MISMATCHES
from sysid.studies.precision import PrecisionStudy
from sysid.studies.report import write_report
from sysid.studies.results import mean_of, paired_difference
from sysid.studies.runner import run_study
from sysid.studies.study import StudyOptions
from sysid.studies.twin_transfer import TwinTransferStudy, _name_on_twin, file_of
from tests.refusals import refused

NOMINAL = load_scenario("chapter3")


def test_the_task_is_the_studys_whatever_the_robots_log_was_for(tmp_path: Path) -> None:
    make_robot(tmp_path, "tilted")
    levels = {"mismatch": ["tilted"], "agent": ["ddpg"], "branch": ["closed"]}
    options = StudyOptions(seeds=(0,), levels=levels, overrides=("task.reward.w_f=4",))
    stages = TwinTransferStudy(options).stages(tmp_path)
    [training] = next(s for s in stages if s.treatments).treatments
    scenario = training.experiment.scenario
    assert scenario.task.reward.w_f == 4.0 and scenario.effects == [GroovePose(rz=0.05)]


def study(**levels: list[str]) -> TwinTransferStudy:
    return TwinTransferStudy(StudyOptions(seeds=(0, 1, 2), levels=levels))


def make_robot(folder: Path, name: str) -> None:
    """Leaves behind what a finished `ClosedTwin` does."""
    folder = folder / "robots" / name
    folder.mkdir(parents=True)
    for twin, rz in (("identified", 0.0), ("scenario", 0.05), ("intervals", 0.06)):
        scenario = with_effects(NOMINAL, (GroovePose(rz=rz),) if rz else ())
        write_text(folder / f"{twin}.yaml", dump_scenario(scenario))
    value = {"value": 0.05, "unit": "rad", "interval_95": [0.04, 0.06]}
    result = refused_verdict("") | {
        "ending": "explained",
        "sentence": "The model lacks a groove that is turned.",
        "provisional": True,
        "parameters": {"GroovePose.rz": value | {"is_at_bound": False}},
    }
    (folder / "result.json").write_text(json.dumps(result))


def test_robots_come_first_and_common_twins_are_trained_once(tmp_path: Path) -> None:
    two = study(mismatch=["tilted", "biased"], agent=["ddpg", "best"])
    stages = list(two.stages(tmp_path))
    assert [each.folder.name for each in stages[0].preparations] == ["tilted", "biased"]
    assert not stages[1].treatments  # nothing is known of the robots yet
    make_robot(tmp_path, "tilted")
    make_robot(tmp_path, "biased")
    trainings = next(s for s in two.stages(tmp_path) if s.treatments).treatments
    assert len(trainings) == 2 * (2 + 2 * 4)  # agents; common twins, and two robots'
    by_folder = {each.folder: each.experiment for each in trainings}
    assert len(by_folder) == len(trainings)
    twin = by_folder["mismatch_tilted__agent_ddpg__branch_closed"].scenario
    assert twin.effects == [GroovePose(rz=0.05)]
    truth = by_folder["mismatch_biased__agent_ddpg__branch_truth"].scenario
    assert truth.effects == [SensorBias(fx=3.0)]
    nominal = by_folder["mismatch_any__agent_best__branch_nominal"].scenario
    assert not nominal.effects and not nominal.randomisation
    assert by_folder["mismatch_any__agent_best__branch_wide"].scenario.randomisation


def test_every_twin_and_robot_is_within_bounds(tmp_path: Path) -> None:
    for name, mismatch in MISMATCHES.items():
        make_robot(tmp_path, name)
        validate(with_effects(NOMINAL, mismatch.effects))
    trainings = study(agent=["ddpg"])._trainings(tmp_path)
    for each in trainings:
        validate(each.experiment.scenario)  # raises
    assert len(trainings) == 2 + 4 * len(MISMATCHES)


FIGURES = {f.name: 0.0 for f in dataclasses.fields(Evaluation)} | {"truly_out": 0}


def leave_figures(
    folder: Path, branch: str, seed: int, P: float, successes: int
) -> None:
    levels: dict[str, Any] = {"mismatch": "tilted", "agent": "ddpg", "branch": branch}
    figures = {"performance": P, "successes": successes, "episodes": 2}
    said = {"accepted": seed != 1, "nominal": {"outcome": "SUCCESS"}}
    for path, content in (
        (file_of("tests", folder, levels, seed), FIGURES | figures),
        (file_of("accepted", folder, levels, seed), said),
    ):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(content))
    own = seed_folder(folder / _name_on_twin(levels), seed)
    own.mkdir(parents=True, exist_ok=True)
    result = {"seed": seed, "validation": FIGURES, "training": FIGURES}
    (own / "result.json").write_text(json.dumps(result | {"first_success": 1}))


def test_tables_compare_seed_by_seed(tmp_path: Path) -> None:
    make_robot(tmp_path, "tilted")
    for seed, (before, after) in enumerate([(1.0, 4.0), (2.0, 4.0), (0.0, 4.0)]):
        leave_figures(tmp_path, "nominal", seed, before, seed % 2)
        leave_figures(tmp_path, "closed", seed, after, 2)
    one = study(mismatch=["tilted"], agent=["ddpg"], branch=["nominal", "closed"])
    found, success, accepted, reward, gain, more = one.tables(tmp_path)
    assert accepted.rows[0][2:] == ["0/4 (0 to 49 %)", "4/4 (51 to 100 %)"]
    assert "GroovePose.rz 0.05 (0.04 to 0.06)" in found.rows[0][2]
    assert found.rows[0][3].startswith("provisional: The model lacks")
    assert success.rows == [["tilted", "ddpg", "1/6 (3 to 56 %)", "6/6 (61 to 100 %)"]]
    assert reward.rows[0][2:] == ["1.0 ± 1.0", "4.0 ± 0.0"]
    assert gain.rows[0][2] == "+3.00 (+0.52 to +5.48; 3)"
    assert more.rows[0][2].startswith("+0.83 (")
    assert paired_difference({0: 1.0, 1: 2.0}, {1: 1.0}) == "-"  # it needs pairs


def test_learning_on_the_robot_follows_the_twin_or_nothing(tmp_path: Path) -> None:
    make_robot(tmp_path, "tilted")
    levels = {"mismatch": ["tilted"], "agent": ["ddpg"]}
    branches = ["untrained", "closed"]
    options = StudyOptions((0,), levels | {"branch": branches}, robot_episodes=60)
    *twins, there = TwinTransferStudy(options).stages(tmp_path)
    assert len([t for stage in twins for t in stage.treatments]) == 1
    new, closed = (treatment.experiment for treatment in there.treatments)
    assert not new.start and new.config.demonstrations == 0.0
    assert Path(closed.start) == tmp_path / twins[1].treatments[0].folder
    assert closed.config.demonstrations == 0.5
    for each in (new, closed):
        assert each.station == "cell" and each.config.episodes == 60
        assert each.scenario.effects == list(MISMATCHES["tilted"].effects)
    with refused("no robot", "'precision'"):
        PrecisionStudy(StudyOptions((0,), robot_episodes=3))


def test_agents_arrive_and_learn_and_the_report_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All of it, on a twin in the robot's place."""
    monkeypatch.setattr(twin_transfer, "_STATION", "twin")
    monkeypatch.setattr(TwinTransferStudy, "draws", 1)
    monkeypatch.setattr(learning_curve, "plot_learning_curves", lambda *_: None)
    make_robot(tmp_path, "tilted")
    small = StudyOptions(
        seeds=(0, 1),
        levels={
            "mismatch": ["tilted"],
            "agent": ["ddpg"],
            "branch": ["untrained", "nominal", "closed"],
        },
        episodes=2,
        validation=1,
        changes=("hidden=[4]", "batch=4", "exploration=0.0002"),
        overrides=("task.steps=3",),
        compiled=False,
        provenance={"command": "study", "commit": "c", "date": "d"},
    )
    tests = TwinTransferStudy(small)
    run_study(tests, tmp_path)
    test = tmp_path / "tests/tilted/ddpg__closed/seed_001.json"
    arrived = test.read_bytes()
    learning = TwinTransferStudy(dataclasses.replace(small, robot_episodes=2))
    run_study(learning, tmp_path)  # more may be asked for afterwards
    assert test.read_bytes() == arrived
    tables = {t.title: t for t in write_report(learning, tmp_path, small.provenance)}
    rows = (tmp_path / "tests.csv").read_text()
    for own in ("nominal/seed_000", "closed/seed_001"):
        assert f"tests/tilted/ddpg__{own},0/1," in rows
    assert "ddpg__untrained" not in rows
    [row] = tables["P, learning on the robot"].rows
    for branch, cell in zip(("untrained", "nominal", "closed"), row[2:], strict=True):
        name = f"robot__mismatch_tilted__agent_ddpg__branch_{branch}"
        rewards = []
        for seed in (0, 1):
            own = tmp_path / name / f"seed_{seed:03d}"
            log = read_log(own / "log")
            assert len(log.episodes) == 2 and log.header.scenario is not None
            rewards.append(np.mean([_reward(episode) for episode in log.episodes]))
            start = load_policy(own / "policy.npz").description.provenance.get("start")
            assert bool(start) == (branch != "untrained")
        assert cell == mean_of(rewards)
    assert tables["P that closing the loop adds"].rows[0][2:] != ["-", "-"]
    assert (tmp_path / "robot_tilted_ddpg.png").read_bytes().startswith(b"\x89PNG")


def _reward(episode: Any) -> float:
    return float(sum(np.nansum(episode[f"reward.{term}"]) for term in REWARD_TERMS))


@pytest.mark.slow
def test_a_robots_log_gives_twins_that_know_it(tmp_path: Path) -> None:
    robot = ClosedTwin(
        folder=tmp_path / "turned",
        nominal=NOMINAL,
        robot=with_effects(NOMINAL, (GroovePose(ry=0.1),)),
        station="twin",
        seed=0,
        time_budget=600.0,
    )
    robot(ignore_progress)
    assert robot.is_finished and not (robot.folder / "fits").exists()
    sentence, values = robot.found
    assert "turned" in sentence
    assert any(value.startswith("GroovePose.ry 0.1") for value in values)
    effects = robot.twin("closed").effects
    assert any(type(effect) is GroovePose for effect in effects)
    assert robot.twin("intervals").randomisation
    accepting = CorrectedTwin.read(robot.folder)
    assert accepting.scenario.effects == effects and accepting.over_intervals
    assert robot.twin("identified").contact.model == "impact"

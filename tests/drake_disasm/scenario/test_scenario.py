"""Scenarios: strict, checked, overridable, and each refusal in one line."""

from pathlib import Path

import numpy as np
import pytest

from drake_disasm.common.resources import models_dir
from drake_disasm.mdp import action_bounds
from drake_disasm.scenario import (
    Scenario,
    dump_scenario,
    load_scenario,
    scenario_from_mapping,
    scenario_to_mapping,
)
from drake_disasm.stations import CellStation
from tests.refusals import refused

SHIPPED = sorted(path.stem for path in (models_dir() / "scenarios").glob("*.yaml"))


CHAPTERS = ("chapter3", "chapter4", "chapter5")


@pytest.mark.parametrize("name", CHAPTERS[:2])
def test_variants_of_a_chapter_have_its_task(name: str) -> None:
    chapter, impedance = load_scenario(name), load_scenario(f"{name}_impedance")
    stiff = load_scenario(f"{name}_stiff")
    assert impedance.task == stiff.task == chapter.task
    compliance = [s.gripper.compliance for s in (chapter, impedance, stiff)]
    assert compliance == ["adaptive", "adaptive", "rigid"]
    assert chapter.arm.control == "position"
    assert impedance.arm.control == "cartesian_impedance"


def test_old_names_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert load_scenario("sliding") == load_scenario("chapter3")
    monkeypatch.chdir(tmp_path)
    Path("sliding").write_text("name: mine")
    assert load_scenario("sliding").name == "mine"


@pytest.mark.parametrize("name", SHIPPED)
def test_round_trips(name: str, tmp_path: Path) -> None:
    scenario = load_scenario(name)
    (tmp_path / "dump.yaml").write_text(dump_scenario(scenario))
    assert load_scenario(str(tmp_path / "dump.yaml")) == scenario
    assert scenario_from_mapping(scenario_to_mapping(scenario)) == scenario


def test_chapters_differ_as_the_thesis_says() -> None:
    sliding, removal = (load_scenario(name).task for name in CHAPTERS[:2])
    assert load_scenario("chapter5").task == removal
    assert (sliding.success, removal.success) == ("travelled", "removed")
    for task in (sliding, removal):
        assert action_bounds(task) == pytest.approx([0.003] * 3 + [np.pi / 180] * 3)
    ours = sliding.reward
    assert [ours.w_dis, ours.w_f, ours.w_t, ours.w_y] == [0.6, 0.2, 0.2, 0.0]
    assert [ours.f_max, ours.t_max, sliding.steps] == [30.0, 5.0, 100]
    ours = removal.reward
    assert [ours.w_dis, ours.w_f, ours.w_t, ours.w_y] == [1.6, 0.3, 0.3, 5.0]
    assert [ours.f_max, ours.t_max, removal.steps] == [20.0, 5.0, 100]


def test_missing_scenarios_and_models_are_named() -> None:
    with refused("remval", "'removal'"):
        load_scenario("remval")
    url = "package://disasm_models/nothing.urdf"
    scenario = load_scenario("removal", [f"gripper.model={url}"])
    with refused("nothing.urdf is missing", "model"):
        CellStation(scenario)


def test_defaults_are_valid(tmp_path: Path) -> None:
    assert _loaded(tmp_path, "name: removal") == Scenario()


OLD = """\
name: old
twin: {mass: 3.0, stiffness: [550, 550, 550, 410, 280, 2000]}
effects:
  - !GroovePose {ry: 0.01}
randomisation:
  - {parameter: twin.mass, low: 2, high: 3}
  - {parameter: part.clearance, low: 0.0003, high: 0.0006}
"""


def _loaded(folder: Path, text: str) -> Scenario:
    path = folder / "own.yaml"
    path.write_text(text)
    return load_scenario(str(path))


def test_an_older_scenario_keeps_its_grip_and_what_it_says_of_it(tmp_path):
    scenario = _loaded(tmp_path, OLD)
    assert scenario.gripper.compliance == "rigid"
    assert scenario.effects[0].ry == 0.01
    assert [r.parameter for r in scenario.randomisation] == ["part.clearance"]
    text = OLD + "gripper: {hold: weld, compliance: adaptive}\n"
    scenario = _loaded(tmp_path, text)
    assert scenario.gripper.hold == "weld"
    assert scenario.gripper.compliance == "adaptive"


def test_an_older_logs_scenario_is_read() -> None:
    mapping = scenario_to_mapping(load_scenario("removal_turned"))
    mapping["twin"] = {"mass": 2.0}
    del mapping["gripper"]["compliance"]
    scenario = scenario_from_mapping(mapping)
    assert scenario.gripper.compliance == "rigid"
    assert scenario.effects == load_scenario("removal_turned").effects


def test_an_unknown_section_is_still_refused(tmp_path: Path) -> None:
    with refused("twins"):
        _loaded(tmp_path, OLD.replace("twin:", "twins:"))

"""Scenarios: strict, checked, overridable, and each refusal in one line."""

from pathlib import Path

import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.resources import models_dir
from drake_disasm.effects import GrooveFriction, GroovePose
from drake_disasm.scenario import (
    Scenario,
    dump_scenario,
    load_scenario,
    scenario_from_mapping,
    scenario_to_mapping,
)
from drake_disasm.stations import CellStation

SHIPPED = sorted(path.stem for path in (models_dir() / "scenarios").glob("*.yaml"))


def test_the_three_of_the_issue_are_shipped() -> None:
    assert {"sliding", "removal", "removal_turned"} <= set(SHIPPED)


@pytest.mark.parametrize("name", SHIPPED)
def test_round_trips(name: str, tmp_path: Path) -> None:
    scenario = load_scenario(name)
    (tmp_path / "dump.yaml").write_text(dump_scenario(scenario))
    assert load_scenario(str(tmp_path / "dump.yaml")) == scenario
    assert scenario_from_mapping(scenario_to_mapping(scenario)) == scenario


def test_chapters_differ_as_the_thesis_says() -> None:
    sliding, removal = load_scenario("sliding").task, load_scenario("removal").task
    assert (sliding.success, removal.success) == ("travelled", "removed")
    ours = sliding.reward
    assert [ours.w_dis, ours.w_f, ours.w_t, ours.w_y] == [0.6, 0.2, 0.2, 0.0]
    assert [ours.f_max, ours.t_max, sliding.steps] == [30.0, 5.0, 100]
    ours = removal.reward
    assert [ours.w_dis, ours.w_f, ours.w_t, ours.w_y] == [1.6, 0.3, 0.3, 5.0]
    assert [ours.f_max, ours.t_max, removal.steps] == [20.0, 5.0, 100]


def test_overrides() -> None:
    scenario = load_scenario(
        "removal_turned",
        ["lock.clearance=3e-4", "effects.0.ry=0.01", "gripper.hold=weld"],
    )
    assert scenario.lock.clearance == 3e-4
    assert scenario.effects == [GroovePose(ry=0.01)]
    assert scenario.gripper.hold == "weld"
    replaced = load_scenario("removal", ["effects=[!GrooveFriction {coefficient: 1}]"])
    assert replaced.effects == [GrooveFriction(coefficient=1.0)]


def test_missing_scenario_suggests_a_name() -> None:
    with pytest.raises(DisasmError, match=r"remval.*'removal'"):
        load_scenario("remval")


@pytest.mark.parametrize("part", ["arm", "gripper", "ft_sensor"])
def test_missing_model_names_file_and_key(part: str) -> None:
    url = "package://disasm_models/nothing.urdf"
    scenario = load_scenario("removal", [f"{part}.model={url}"])
    with pytest.raises(DisasmError, match=r"nothing\.urdf is missing.*`model`"):
        CellStation(scenario)


def test_defaults_are_valid(tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text("name: removal")
    assert load_scenario(str(tmp_path / "s.yaml")) == Scenario()

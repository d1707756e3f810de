"""Scenarios of the time when the twin's springs were written by hand."""

from pathlib import Path

import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.scenario import (
    load_scenario,
    scenario_from_mapping,
    scenario_to_mapping,
)

OLD = """\
name: old
twin: {mass: 3.0, stiffness: [550, 550, 550, 410, 280, 2000]}
effects:
  - !GroovePose {ry: 0.01}
randomisation:
  - {parameter: twin.mass, low: 2, high: 3}
  - {parameter: lock.clearance, low: 0.0003, high: 0.0006}
"""


def _loaded(folder: Path, text: str):
    path = folder / "old.yaml"
    path.write_text(text)
    return load_scenario(str(path))


def test_an_older_scenario_keeps_its_grip_and_what_it_says_of_it(
    tmp_path: Path,
) -> None:
    scenario = _loaded(tmp_path, OLD)
    assert scenario.gripper.compliance == "rigid"
    assert scenario.effects[0].ry == 0.01
    assert [r.parameter for r in scenario.randomisation] == ["lock.clearance"]
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
    with pytest.raises(DisasmError, match="twins"):
        _loaded(tmp_path, OLD.replace("twin:", "twins:"))

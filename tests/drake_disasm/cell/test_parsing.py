"""Model files: found, read, and refused in one line."""

from pathlib import Path

import pytest
from pydrake.multibody.plant import MultibodyPlant

from drake_disasm.cell.parsing import add_model
from drake_disasm.common.resources import model_path
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import CellStation
from tests.refusals import refusal

HEX_E = "package://disasm_models/hex_e/hex_e.urdf"
GRIPPER = "package://disasm_models/gripper_2f140/gripper_2f140.urdf"


@pytest.mark.parametrize(
    "url", ["", "/nowhere/a.urdf", "package://other/a.urdf", "package://disasm_models/"]
)
def test_missing_file_is_named(url: str) -> None:
    message = refusal(model_path, url)
    assert url in message and "is missing" in message and "`model` key" in message


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("text.urdf", "hello"),
        ("half.urdf", "<robot name='a'><link"),
        ("world.sdf", '<sdf version="1.7"><world name="w"/></sdf>'),
        ("note.txt", "hello"),
    ],
)
def test_file_that_is_no_model_is_refused(name, content, tmp_path: Path) -> None:
    (tmp_path / name).write_text(content)
    plant = MultibodyPlant(0.0)
    assert name in refusal(add_model, plant, str(tmp_path / name))


@pytest.mark.parametrize(
    ("key", "url"), [("arm", HEX_E), ("ft_sensor", GRIPPER), ("gripper", HEX_E)]
)
def test_model_of_another_device_is_refused(key: str, url: str) -> None:
    """It lacks the frames that this place in the cell needs."""
    scenario = load_scenario("removal", [f"{key}.model={url}"])
    assert url in refusal(CellStation, scenario)

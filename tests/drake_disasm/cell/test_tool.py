"""What hangs on the sensor: masses, and where the bolt is held."""

from pathlib import Path

import numpy as np
import pytest

from drake_disasm.cell.tool import Tool
from drake_disasm.common.resources import models_dir
from drake_disasm.common.spatial import weight_wrench
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.stations import CellStation
from tests.drake_disasm.conftest import QUIET
from tests.refusals import refused


@pytest.fixture(scope="module")
def tool(quiet_scenario: Scenario) -> Tool:
    """The default scenario's tool."""
    return Tool.from_models(quiet_scenario)


def test_mass_and_first_moment_are_those_of_the_parts(tool: Tool) -> None:
    """Sensor at 25 mm, gripper at 50 + 70 mm, by their sheets; bolt by the scenario."""
    assert tool.mass == pytest.approx(0.347 + 1.025 + 0.2)
    assert tool.M_F.get_mass() == tool.mass
    assert tool.M_F.IsPhysicallyValid()
    grip = tool.X_SB @ np.array([0, 0.00125 + 0.003 + 0.015, 0])
    moment = 0.347 * 0.025 + 1.025 * (0.050 + 0.070) + 0.2 * grip[2]
    np.testing.assert_allclose(
        tool.mass * tool.p_SoScm_S, [0, 0, moment], rtol=1e-3, atol=1e-9
    )


def test_bolt_points_back_at_the_robot(tool: Tool) -> None:
    """y_B, out of the plate, is -z_S; x_B is -x_S; a right-handed frame."""
    R_SB = tool.X_SB.rotation().matrix()
    np.testing.assert_allclose(R_SB.T @ [0, 0, -1], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(R_SB.T @ [-1, 0, 0], [1, 0, 0], atol=1e-12)
    assert np.linalg.det(R_SB) == pytest.approx(1.0)


def test_fingertips_end_above_the_plate(tool: Tool) -> None:
    """Each millimetre of gap brings the bolt a millimetre farther from the sensor."""
    scenario = load_scenario("removal", ["gripper.fingertip_gap=0.004"])
    farther = Tool.from_models(scenario).X_SB.translation() - tool.X_SB.translation()
    np.testing.assert_allclose(farther, [0, 0, 0.004 - 0.0015], atol=1e-12)
    assert tool.X_FB.IsNearlyEqualTo(tool.X_SB, 1e-12)  # S is on the flange's face


HAND = "package://disasm_models/panda_hand/panda_hand.urdf"


def test_another_hand_holds_the_bolt_by_its_own_pads() -> None:
    """Of the Panda's hand: 0.76 kg, pads of 18.5 mm, whose middle is at 103.4 mm."""
    scenario = load_scenario("panda_removal", [f"gripper.model={HAND}"])
    tool = Tool.from_models(scenario)
    assert tool.mass == pytest.approx(0.347 + 0.76 + 0.2)
    tip = 0.0185 / 2 + 0.0015 + scenario.part.lip_thickness / 2
    assert tool.X_TB.translation() == pytest.approx([0, 0, tip])
    assert tool.X_SB.translation() == pytest.approx([0, 0, 0.050 + 0.1034 + tip])


def test_another_hand_in_the_cell_presses_with_the_grip_force() -> None:
    station = CellStation(load_scenario("panda_removal", [f"gripper.model={HAND}"]))
    context = station.settled([])
    opening, rate = station.GetOutputPort("gripper.state_measured").Eval(context)
    pressed = 0.5 * station.scenario.gripper.finger_stiffness
    force = pressed * (opening - station.grip_command)
    assert force == pytest.approx(60.0, rel=0.05)
    assert abs(rate) < 1e-3
    X_GB = station.GetOutputPort("bolt_pose").Eval(context)
    assert np.linalg.norm(X_GB.translation()) < 1e-4


@pytest.mark.parametrize(("overrides", "words"), [
    ([f"gripper.model={HAND}", "part.grip_size=[0.02, 0.03, 0.05]",
      "gripper.fingers=[left_finger_joint, left_finger_joint]"],
     ["gripper.model", "two sliding fingers"]),
    (["gripper.fingers=[left_finger, right_finger_joint]"],
     ["gripper.fingers", "did you mean 'left_finger_joint'?"]),
    (["gripper.model=package://disasm_models/ur5e/ur5e.urdf"],
     ["no link or frame 'gripper_base'"]),
])  # fmt: skip
def test_a_gripper_that_can_not_hold_is_refused(
    overrides: list[str], words: list[str]
) -> None:
    with refused(*words):
        Tool.from_models(load_scenario("removal", overrides))


def test_a_grip_wider_than_the_fingers_open_is_refused(tmp_path: Path) -> None:
    text = (models_dir() / "panda_hand" / "panda_hand.urdf").read_text()
    narrow = tmp_path / "narrow.urdf"
    narrow.write_text(text.replace('upper="0.04"', 'upper="0.005"'))
    with refused("gripper.model", "opens to 0.01 m", "0.012 m wide"):
        Tool.from_models(load_scenario("removal", [f"gripper.model={narrow}"]))


def _sensor_frame_at(xyz: str, rpy: str, folder: Path) -> str:
    """Writes the sensor's model with its sensing frame moved; returns the file."""
    text = (models_dir() / "hex_e" / "hex_e.urdf").read_text()
    frame = '<frame name="sensor" link="hex_e" xyz="0 0 0" rpy="0 0 0"/>'
    assert frame in text
    moved = f'<frame name="sensor" link="hex_e" xyz="{xyz}" rpy="{rpy}"/>'
    file = folder / "hex_e.urdf"
    file.write_text(text.replace(frame, moved))
    return str(file)


@pytest.mark.parametrize(
    ("xyz", "rpy"), [("0.01 0 0.02", "0 0 0"), ("0 0 0", "0.2 0 1.5")]
)
def test_wrench_is_at_the_sensing_frame_of_the_model(xyz, rpy, tmp_path) -> None:
    """The URDF calls that frame a parameter to calibrate: the reading follows it."""
    model = _sensor_frame_at(xyz, rpy, tmp_path)
    station = CellStation(load_scenario("removal", [QUIET, f"ft_sensor.model={model}"]))
    R_WS = station.X_WG.rotation() @ station.X_SB.rotation().inverse()
    g_W = np.array([0, 0, -9.81])
    expected = weight_wrench(
        station.payload_mass, station.p_SoScm_S, R_WS.matrix(), g_W
    )
    reading = station.reading_at_zeroing(station.settled([]))
    np.testing.assert_allclose(reading, expected, atol=2e-3)

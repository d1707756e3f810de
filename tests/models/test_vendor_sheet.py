"""Holds the models against the vendors' sheets (see models/SOURCES.md)."""

from __future__ import annotations

import json
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from pydrake.multibody.parsing import PackageMap, Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Frame

MODELS = Path(__file__).parents[2] / "models"
URDFS = [
    *("bench/bench", "gripper_2f140/gripper_2f140", "hex_e/hex_e", "iiwa14/iiwa14"),
    *("ur5e/ur5e", "panda/panda", "panda_hand/panda_hand"),
]
JOINTS = range(7)

# LBR iiwa 14 R820, joints 1 to 7.
POSITION_DEG = [170, 120, 170, 120, 170, 120, 175]
VELOCITY_DEG = [85, 85, 100, 75, 130, 135, 135]
ACCELERATION = [8.57, 8.57, 8.74, 11.36, 12.23, 15.72, 15.72]
EFFORT = [320, 320, 176, 176, 110, 40, 40]
GEAR_RATIO = [160, 160, 160, 160, 100, 160, 160]
ROTOR_INERTIA = [1.321e-4] * 5 + [4.54e-5] * 2


def parse(name: str) -> MultibodyPlant:
    """A finalised plant with one model, its root link welded to the world."""
    plant = MultibodyPlant(0.0)
    parser = Parser(plant)
    parser.SetStrictParsing()
    parser.package_map().Add("disasm_models", str(MODELS))
    (instance,) = parser.AddModels(str(MODELS / f"{name}.urdf"))
    root = plant.get_body(plant.GetBodyIndices(instance)[0])
    plant.WeldFrames(plant.world_frame(), root.body_frame())
    plant.Finalize()
    return plant


@pytest.fixture(scope="module")
def iiwa() -> MultibodyPlant:
    return parse("iiwa14/iiwa14")


@pytest.fixture(scope="module")
def gripper() -> MultibodyPlant:
    return parse("gripper_2f140/gripper_2f140")


def origin(plant: MultibodyPlant, frame: Frame, q: np.ndarray) -> np.ndarray:
    """The origin of `frame` in the world at positions `q`, (3,), m."""
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    return frame.CalcPoseInWorld(context).translation()


def total_mass(plant: MultibodyPlant) -> float:
    """The mass of all the plant's bodies, kg."""
    return plant.CalcTotalMass(plant.CreateDefaultContext())


def joint_origins(iiwa: MultibodyPlant, q: np.ndarray) -> dict[int, np.ndarray]:
    """The origins of the frames of links 0 to 7, m."""
    frames = (iiwa.GetFrameByName(f"iiwa_link_{i}") for i in range(8))
    return {i: origin(iiwa, frame, q) for i, frame in enumerate(frames)}


def test_iiwa_joints_and_actuators(iiwa: MultibodyPlant) -> None:
    position, velocity = np.deg2rad(POSITION_DEG), np.deg2rad(VELOCITY_DEG)
    np.testing.assert_allclose(iiwa.GetPositionUpperLimits(), position, rtol=1e-10)
    np.testing.assert_allclose(iiwa.GetPositionLowerLimits(), -position, rtol=1e-10)
    np.testing.assert_allclose(iiwa.GetVelocityUpperLimits(), velocity, rtol=1e-10)
    np.testing.assert_allclose(iiwa.GetAccelerationUpperLimits(), ACCELERATION)
    for i in JOINTS:
        assert iiwa.GetJointByName(f"iiwa_joint_{i + 1}").default_damping() == 0.5
    np.testing.assert_array_equal(iiwa.MakeActuationMatrix(), np.eye(7))
    for i in JOINTS:
        actuator = iiwa.GetJointActuatorByName(f"iiwa_joint_{i + 1}")
        assert actuator.effort_limit() == EFFORT[i]
        reflected = ROTOR_INERTIA[i] * GEAR_RATIO[i] ** 2
        assert actuator.default_reflected_inertia() == pytest.approx(reflected)


def test_iiwa_mass_and_link_lengths(iiwa: MultibodyPlant) -> None:
    assert total_mass(iiwa) == pytest.approx(29.9, abs=1e-9)
    q = np.zeros(7)
    at = joint_origins(iiwa, q)
    flange = origin(iiwa, iiwa.GetFrameByName("iiwa_link_ee"), q)
    heights = np.diff([0, at[2][2], at[4][2], at[6][2], flange[2]])
    np.testing.assert_allclose(heights, [0.360, 0.420, 0.400, 0.126], atol=1e-12)
    np.testing.assert_allclose(flange[:2], 0, atol=1e-12)
    at = joint_origins(iiwa, np.array([0.3, -0.7, 1.1, 1.3, -0.4, 0.9, 2.0]))
    assert np.linalg.norm(at[4] - at[2]) == pytest.approx(0.420)
    assert np.linalg.norm(at[6] - at[4]) == pytest.approx(0.400)


def test_iiwa_elbows_turn_the_right_way(iiwa: MultibodyPlant) -> None:
    """Joints 2 and 6 lean the arm to +x at +90 degrees, joint 4 to -x."""
    leaning = {2: [0.946, 0, 0.360], 4: [-0.526, 0, 0.780], 6: [0.126, 0, 1.180]}
    for joint, expected in leaning.items():
        q = np.pi / 2 * np.eye(7)[joint - 1]
        flange = origin(iiwa, iiwa.GetFrameByName("iiwa_link_ee"), q)
        np.testing.assert_allclose(flange, expected, atol=1e-12)


def test_hex_mass_and_height() -> None:
    hex_e = parse("hex_e/hex_e")
    assert total_mass(hex_e) == pytest.approx(0.347)
    tool = origin(hex_e, hex_e.GetFrameByName("tool_side"), np.zeros(0))
    np.testing.assert_allclose(tool, [0, 0, 0.050], atol=1e-12)
    assert hex_e.HasFrameNamed("sensor")


def test_gripper_mass_stroke_and_pads(gripper: MultibodyPlant) -> None:
    assert total_mass(gripper) == pytest.approx(1.025)
    p_WGcm = gripper.CalcCenterOfMassPositionInWorld(gripper.CreateDefaultContext())
    np.testing.assert_allclose(p_WGcm, [0, 0, 0.07], atol=5e-4)
    left = gripper.GetFrameByName("left_finger")
    right = gripper.GetFrameByName("right_finger")
    upper = gripper.GetPositionUpperLimits()
    stroke = origin(gripper, left, upper) - origin(gripper, right, upper)
    np.testing.assert_allclose(stroke, [0, 0.140, 0], atol=1e-12)
    np.testing.assert_array_equal(gripper.GetPositionLowerLimits(), 0)
    np.testing.assert_array_equal(gripper.GetVelocityUpperLimits(), 0.125)
    for side in ("left", "right"):
        actuator = gripper.GetJointActuatorByName(f"{side}_finger_actuator")
        assert actuator.effort_limit() == 125
    tcp = origin(gripper, gripper.GetFrameByName("tcp"), np.zeros(2))
    for side in ("left", "right"):
        frame = gripper.GetFrameByName(f"{side}_finger")
        np.testing.assert_allclose(origin(gripper, frame, np.zeros(2)), tcp)
    assert 0.233 <= tcp[2] + 0.065 / 2 <= 0.2441


#: A frame of the vendor's, and what the springs of adaptive fingers move.
MASSLESS = {"iiwa_link_ee", "tool0", "panda_link8", "finger_carriage"}


@pytest.mark.parametrize("name", URDFS)
def test_inertias_are_physically_valid(name: str) -> None:
    plant = parse(name)
    for index in range(1, plant.num_bodies()):
        body = plant.get_body(BodyIndex(index))
        inertia = body.default_spatial_inertia()
        assert inertia.IsPhysicallyValid(), body.name()
        assert body.default_mass() > 0 or body.name() in MASSLESS, body.name()


@pytest.mark.parametrize("name", URDFS)
def test_uris_resolve(name: str) -> None:
    packages = PackageMap.MakeEmpty()
    packages.AddPackageXml(str(MODELS / "package.xml"))
    assert packages.GetPath("disasm_models")
    for mesh in ET.parse(MODELS / f"{name}.urdf").iter("mesh"):
        path = packages.ResolveUrl(mesh.get("filename"))
        document = json.loads(Path(path).read_text())
        for buffer in document["buffers"]:
            size = (Path(path).parent / buffer["uri"]).stat().st_size
            assert size == buffer["byteLength"]


def test_meshes_are_what_the_script_makes(tmp_path: Path) -> None:
    copy = tmp_path / "make_meshes.py"
    copy.write_text((MODELS / "make_meshes.py").read_text())
    subprocess.run([sys.executable, str(copy)], check=True)
    for made in (tmp_path / "iiwa14" / "meshes").iterdir():
        kept = MODELS / "iiwa14" / "meshes" / made.name
        assert made.read_bytes() == kept.read_bytes(), made.name

"""Arms that no station can take are refused with what their file lacks."""

import copy
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from pydrake.lcm import DrakeLcm
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant

from drake_disasm.cell.arm_drives import AssumedDrivesWarning
from drake_disasm.cell.arm_model import ArmModel, add_arm, arm_joints
from drake_disasm.cell.parsing import movable_joints
from drake_disasm.common.resources import model_path
from drake_disasm.free_motion.cell_urdf import cell_urdf
from drake_disasm.scenario import ArmConfig, Scenario, load_scenario
from drake_disasm.stations import STATIONS, CellStation, Station, make_station
from drake_disasm.stations.hardware_config import HardwareConfig
from tests.refusals import refused

IIWA = "package://disasm_models/iiwa14/iiwa14.urdf"
_DRAKE = "http://drake.mit.edu"

Element = ElementTree.Element


def written(folder: Path, change: Callable[[Element], object]) -> str:
    """Returns the path of the iiwa's URDF after a change to its tree."""
    ElementTree.register_namespace("drake", _DRAKE)
    tree = ElementTree.parse(model_path(IIWA))
    change(tree.getroot())
    path = folder / "arm.urdf"
    tree.write(path)
    return str(path)


def _joint(root: Element, number: int) -> Element:
    return root.findall("joint")[number - 1]


def _drop(root: Element, path: str, numbers: slice = slice(None)) -> None:
    """Takes elements out of the tree, wherever they are."""
    gone = root.findall(path)[numbers]
    for parent in list(root.iter()):
        for child in list(parent):
            if child in gone:
                parent.remove(child)


def _rename(root: Element, old: str, new: str) -> None:
    for element in root.iter():
        for key, value in element.attrib.items():
            if value == old:
                element.set(key, new)


def _six_joints(root: Element) -> None:
    _joint(root, 3).set("type", "fixed")
    _drop(root, "transmission", slice(2, 3))


def _five_joints(root: Element) -> None:
    _six_joints(root)
    _joint(root, 5).set("type", "fixed")
    _drop(root, "transmission", slice(3, 4))


def _with_finger(root: Element) -> None:
    """Adds a sliding finger to the flange, with a drive."""
    ElementTree.SubElement(root, "link", name="finger")
    joint = copy.deepcopy(_joint(root, 7))
    joint.set("name", "finger_joint")
    joint.set("type", "prismatic")
    joint.find("parent").set("link", "iiwa_link_ee")
    joint.find("child").set("link", "finger")
    root.append(joint)
    drive = copy.deepcopy(root.findall("transmission")[6])
    drive.find("joint").set("name", "finger_joint")
    drive.find("actuator").set("name", "finger_joint")
    root.append(drive)


def _apart(root: Element) -> None:
    """Leaves the base without the arm, which begins on another link."""
    ElementTree.SubElement(root, "link", name="stand")
    _joint(root, 1).find("parent").set("link", "stand")


def _mounted(root: Element, on: str) -> None:
    """Fixes the base half a metre above and before another link."""
    ElementTree.SubElement(root, "link", name=on)
    joint = ElementTree.SubElement(root, "joint", name="mount", type="fixed")
    ElementTree.SubElement(joint, "parent", link=on)
    ElementTree.SubElement(joint, "child", link="iiwa_link_0")
    ElementTree.SubElement(joint, "origin", xyz="0.5 0 0.5", rpy="0 0 1")


def _driven_twice(root: Element) -> None:
    again = copy.deepcopy(root.findall("transmission")[4])
    again.find("actuator").set("name", "again")
    root.append(again)


def _out_of_order(root: Element) -> None:
    first = root.find("transmission")
    root.remove(first)
    root.append(first)


UNFIT = {
    "five joints": (_five_joints, ["model: ", "5 driven", "iiwa_joint_4", "6 or more"]),
    "a finger": (_with_finger, ["model: ", "(finger_joint)", "arm.joints"]),
    "a rail": (
        lambda root: _joint(root, 1).set("type", "prismatic"),
        ["model: ", "prismatic", "iiwa_joint_1", "revolute"],
    ),
    "another base": (
        lambda root: _rename(root, "iiwa_link_0", "iiwa_link_00"),
        ["base: ", "'iiwa_link_0';", "did you mean 'iiwa_link_00'"],
    ),
    "another flange": (
        lambda root: _rename(root, "iiwa_link_ee", "tool0"),
        ["flange: ", "'iiwa_link_ee'", "did you mean", "iiwa_link_7"],
    ),
    "a base apart": (_apart, ["flange: ", "'iiwa_link_0'", "no joints", "stands"]),
    "no effort": (
        lambda root: _joint(root, 4).find("limit").set("effort", "0"),
        ["model: ", "effort limit of iiwa_joint_4;", "<limit>"],
    ),
    "two drives": (_driven_twice, ["model: ", "two drives of iiwa_joint_5;", "one"]),
    "no masses": (
        lambda root: _drop(root, "link/inertial"),
        ["model: ", "mass", "<inertial>"],
    ),
    "a follower": (
        lambda root: ElementTree.SubElement(
            _joint(root, 3), "mimic", joint="iiwa_joint_1"
        ),
        ["model: ", "follows", "<mimic>"],
    ),
}


@pytest.mark.parametrize("kind", UNFIT)
def test_what_a_model_lacks_is_named_with_the_remedy(kind: str, tmp_path: Path) -> None:
    change, words = UNFIT[kind]
    url = written(tmp_path, change)
    with refused(f"arm.{words[0]}", url, *words[1:]):
        add_arm(MultibodyPlant(0.0), ArmConfig(model=url))


@pytest.mark.parametrize(("section", "words"), [
    ({"joints": ["iiwa_joint_8"]}, ["arm.joints", "did you mean 'iiwa_joint_7'?"]),
    ({"joints": ["finger_joint"]}, ["arm.joints", "not between 'iiwa_link_0' and"]),
    ({"joints": ["iiwa_joint_2", "iiwa_joint_1"]},
     ["arm.joints", "[iiwa_joint_1, iiwa_joint_2]"]),
    ({"joints": [f"iiwa_joint_{i}" for i in range(1, 6)]}, ["5 driven", "6 or more"]),
    ({"posture": [0.1] * 6}, ["arm.posture", "6 values", "7 joints", "[one] for all"]),
    ({"stiffness": []}, ["arm.stiffness", "0 values", "7 joints"]),
    ({"base": "finger", "flange": "iiwa_link_0"}, ["arm.flange", "'finger'"]),
])  # fmt: skip
def test_a_section_that_does_not_fit_the_model_is_refused(
    section: dict[str, object], words: list[str], tmp_path: Path
) -> None:
    arm = ArmConfig(model=written(tmp_path, _with_finger), **section)
    if "joints" not in section:
        arm.joints = [f"iiwa_joint_{i}" for i in range(1, 8)]
    with refused(*words):
        add_arm(MultibodyPlant(0.0), arm)


def _added(arm: ArmConfig) -> tuple[MultibodyPlant, ArmModel]:
    plant = MultibodyPlant(0.0)
    model = add_arm(plant, arm)
    plant.Finalize()
    return plant, model


def test_joints_that_are_not_listed_are_held_at_zero(tmp_path: Path) -> None:
    names = [f"iiwa_joint_{i}" for i in (1, 2, 4, 5, 6, 7)]
    url = written(tmp_path, _with_finger)
    own = {"joints": names, "posture": [0.1], "stiffness": [1e4]}
    plant, model = _added(ArmConfig(model=url, **own))
    assert model.joints == tuple(names)
    assert set(model.held) == {"iiwa_joint_3", "finger_joint"}
    assert plant.num_positions() == plant.num_actuators() == 6
    assert not model.has_assumed_drives


@pytest.mark.parametrize("on", ["world", "table"])
def test_the_base_stands_where_the_file_fixes_it(on: str, tmp_path: Path) -> None:
    """On the world as the file says; a table goes where the base is at the origin."""
    url = written(tmp_path, lambda root: _mounted(root, on))
    plant, model = _added(ArmConfig(model=url))
    X_WBase = model.base.CalcPoseInWorld(plant.CreateDefaultContext())
    expected = RigidTransform(RollPitchYaw(0.0, 0.0, 1.0), [0.5, 0.0, 0.5])
    assert X_WBase.IsNearlyEqualTo(
        expected if on == "world" else RigidTransform(), 1e-12
    )
    text = cell_urdf(load_scenario("removal", [f"arm.model={url}"]))
    (tmp_path / "cell.urdf").write_text(text)
    plant, _ = _added(ArmConfig(model=str(tmp_path / "cell.urdf")))
    context = plant.CreateDefaultContext()
    bench = plant.GetFrameByName("bench").CalcPoseInWorld(context)
    assert bench.IsNearlyEqualTo(RigidTransform(), 1e-12)


_INCOMPLETE = {
    "no drives": (
        lambda root: _drop(root, "transmission"), "no drive of iiwa_joint_1, iiwa",
    ),
    "a drive missing": (
        lambda root: _drop(root, "transmission", slice(3, 4)),
        "no drive of iiwa_joint_4 and no rotor inertia of iiwa_joint_4;",
    ),
    "no rotor": (
        lambda root: _drop(root, f".//{{{_DRAKE}}}rotor_inertia", slice(1, 2)),
        "states no rotor inertia of iiwa_joint_2;",
    ),
    "a rotor without a gear": (
        lambda root: [
            each.set("value", "0") for each in root.iter(f"{{{_DRAKE}}}gear_ratio")
        ],
        "states no rotor inertia of iiwa_joint_1, iiwa_joint_2",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", _INCOMPLETE)
def test_drives_that_a_file_leaves_out_are_assumed_and_said_once(
    kind: str, tmp_path: Path
) -> None:
    change, words = _INCOMPLETE[kind]
    arm = ArmConfig(model=written(tmp_path, change))
    with pytest.warns(AssumedDrivesWarning) as said:
        plant, model = _added(arm)
        _added(arm)
    assert len(said) == 1
    assert words in str(said[0].message)
    assert model.has_assumed_drives
    stated, _ = _added(ArmConfig())
    np.testing.assert_array_equal(plant.MakeActuationMatrix(), np.eye(7))
    for name in model.joints:
        drive, known = (p.GetJointActuatorByName(name) for p in (plant, stated))
        assert drive.effort_limit() == known.effort_limit()
        inertia = drive.default_reflected_inertia()
        if name in str(said[0].message):
            assert inertia == pytest.approx(0.01 * known.effort_limit())
        else:
            assert inertia == known.default_reflected_inertia()


def test_the_cells_urdf_states_the_drives_that_are_assumed(tmp_path: Path) -> None:
    url = written(tmp_path, lambda root: _drop(root, "transmission"))
    with pytest.warns(AssumedDrivesWarning):
        text = cell_urdf(load_scenario("removal", [f"arm.model={url}"]))
    (tmp_path / "cell.urdf").write_text(text)
    plant, model = _added(ArmConfig(model=str(tmp_path / "cell.urdf")))
    assert not model.has_assumed_drives
    drive = plant.GetJointActuatorByName("iiwa_joint_1")
    assert drive.default_reflected_inertia() == pytest.approx(3.2)


def test_drives_may_stand_in_any_order(tmp_path: Path) -> None:
    plant, model = _added(ArmConfig(model=written(tmp_path, _out_of_order)))
    np.testing.assert_array_equal(plant.MakeActuationMatrix(), np.eye(7))
    assert not model.has_assumed_drives
    drive = plant.GetJointActuatorByName("iiwa_joint_1")
    assert drive.default_reflected_inertia() == pytest.approx(1.321e-4 * 160**2)


def _made(name: str, scenario: Scenario) -> Station:
    options = {"config": HardwareConfig(), "lcm": DrakeLcm("memq://")}
    return make_station(name, scenario, **options if name == "hardware" else {})


@pytest.mark.parametrize("name", STATIONS)
def test_every_station_refuses_in_the_same_words(name: str, tmp_path: Path) -> None:
    scenario = load_scenario("removal")
    scenario.arm.model = written(tmp_path, _five_joints)
    with refused("arm.model: ", scenario.arm.model, "5 driven", "6 or more"):
        _made(name, scenario)
    with refused("arm.model: ", "5 driven"):
        cell_urdf(scenario)


@pytest.mark.parametrize("change", ["name=lbr", "six joints"])
def test_hardware_takes_an_iiwa_alone(change: str, tmp_path: Path) -> None:
    scenario = load_scenario("removal")
    if change == "six joints":
        scenario.arm.model = written(tmp_path, _six_joints)
        scenario.arm.posture, scenario.arm.stiffness = [0.5], [1e4]
    else:
        scenario.arm.name = "lbr"
    with refused("arm.name: hardware drives an arm called iiwa", "`station` cell"):
        _made("hardware", scenario)


def test_a_mesh_that_is_missing_is_named_with_the_remedy(tmp_path: Path) -> None:
    def elsewhere(root: Element) -> None:
        root.find(".//mesh").set("filename", "package://iiwa_description/a.stl")

    url = written(tmp_path, elsewhere)
    with refused(url, "iiwa_description", "relative to the model's folder"):
        _made("cell", load_scenario("removal", [f"arm.model={url}"]))


def test_hardware_alone_needs_limits(tmp_path: Path) -> None:
    """A guard made of an infinite limit would never trip."""

    def endless(root: Element) -> None:
        _joint(root, 7).set("type", "continuous")
        for key in ("lower", "upper"):
            del _joint(root, 7).find("limit").attrib[key]

    scenario = load_scenario("removal")
    scenario.arm.model = written(tmp_path, endless)
    assert isinstance(_made("cell", scenario), CellStation)
    with refused("arm.model: ", "position limit of joint 'iiwa_joint_7'", "<limit>"):
        _made("hardware", scenario)


def test_a_file_may_list_its_joints_in_any_order(tmp_path: Path) -> None:
    def shuffled(root: Element) -> None:
        first = _joint(root, 1)
        root.remove(first)
        root.append(first)
        _drop(root, "link/visual")

    scenario = load_scenario("removal")
    scenario.arm.model = url = written(tmp_path, shuffled)
    assert arm_joints(scenario.arm) == movable_joints(url) == movable_joints(IIWA)
    cell = CellStation(scenario)
    q = cell.plant.GetPositions(
        cell.part_context(cell.plant, cell.CreateDefaultContext()), cell.arm_instance
    )
    np.testing.assert_allclose(q, cell.start, atol=1e-9)

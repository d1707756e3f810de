"""Arms that no station can take are refused with what their file lacks."""

import copy
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from pydrake.lcm import DrakeLcm
from pydrake.multibody.plant import MultibodyPlant

from drake_disasm.cell.parsing import add_arm, arm_joints, movable_joints
from drake_disasm.common.resources import model_path
from drake_disasm.free_motion.cell_urdf import cell_urdf
from drake_disasm.scenario import Scenario, load_scenario
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


def _apart(root: Element) -> None:
    """Leaves the base without the arm, which begins on another link."""
    ElementTree.SubElement(root, "link", name="stand")
    _joint(root, 1).find("parent").set("link", "stand")


def _on_world(root: Element) -> None:
    ElementTree.SubElement(root, "link", name="world")
    joint = ElementTree.SubElement(root, "joint", name="mount", type="fixed")
    ElementTree.SubElement(joint, "parent", link="world")
    ElementTree.SubElement(joint, "child", link="iiwa_link_0")


def _driven_twice(root: Element) -> None:
    again = copy.deepcopy(root.findall("transmission")[4])
    again.find("actuator").set("name", "again")
    root.append(again)


def _out_of_order(root: Element) -> None:
    first = root.find("transmission")
    root.remove(first)
    root.append(first)


UNFIT = {
    "six joints": (_six_joints, ["6 movable", "iiwa_joint_4", "7", "give"]),
    "eight joints": (
        lambda root: _joint(root, 8).set("type", "continuous"),
        ["8 movable", "iiwa_joint_ee", 'type="fixed"'],
    ),
    "a rail": (
        lambda root: _joint(root, 1).set("type", "prismatic"),
        ["prismatic", "iiwa_joint_1", "revolute"],
    ),
    "another base": (
        lambda root: _rename(root, "iiwa_link_0", "base_link"),
        ["iiwa_link_0", "base_link", "rename", "fixed joint"],
    ),
    "another flange": (
        lambda root: _rename(root, "iiwa_link_ee", "tool0"),
        ["iiwa_link_ee", "tool0", "rename", "fixed joint"],
    ),
    "a base apart": (_apart, ["iiwa_joint_1", "iiwa_link_0", "put the base"]),
    "a mount": (_on_world, ["'mount'", "world", "out"]),
    "no drives": (
        lambda root: _drop(root, "transmission"),
        ["no drive", "iiwa_joint_1", "iiwa_joint_7", "<transmission>"],
    ),
    "a drive missing": (
        lambda root: _drop(root, "transmission", slice(3, 4)),
        ["no drive of iiwa_joint_4;", "<transmission>"],
    ),
    "no effort": (
        lambda root: _joint(root, 4).find("limit").set("effort", "0"),
        ["no drive of iiwa_joint_4;", "effort limit"],
    ),
    "two drives": (_driven_twice, ["two drives of iiwa_joint_5;", "keep one"]),
    "drives out of order": (_out_of_order, ["iiwa_joint_7, iiwa_joint_1", "order"]),
    "no rotor": (
        lambda root: _drop(root, f".//{{{_DRAKE}}}rotor_inertia", slice(1, 2)),
        ["rotor inertia of iiwa_joint_2;", "<drake:rotor_inertia", "gear_ratio"],
    ),
    "a rotor without a gear": (
        lambda root: [
            each.set("value", "0") for each in root.iter(f"{{{_DRAKE}}}gear_ratio")
        ],
        ["rotor inertia of iiwa_joint_1", "<drake:gear_ratio"],
    ),
    "no masses": (lambda root: _drop(root, "link/inertial"), ["mass", "<inertial>"]),
    "a follower": (
        lambda root: ElementTree.SubElement(
            _joint(root, 3), "mimic", joint="iiwa_joint_1"
        ),
        ["follows", "<mimic>"],
    ),
}


@pytest.mark.parametrize("kind", UNFIT)
def test_what_a_model_lacks_is_named_with_the_remedy(kind: str, tmp_path: Path) -> None:
    change, words = UNFIT[kind]
    url = written(tmp_path, change)
    with refused("arm.model: ", url, *words):
        add_arm(MultibodyPlant(0.0), url)


def _made(name: str, scenario: Scenario) -> Station:
    options = {"config": HardwareConfig(), "lcm": DrakeLcm("memq://")}
    return make_station(name, scenario, **options if name == "hardware" else {})


@pytest.mark.parametrize("name", STATIONS)
def test_every_station_refuses_in_the_same_words(name: str, tmp_path: Path) -> None:
    scenario = load_scenario("removal")
    scenario.arm.model = written(tmp_path, _six_joints)
    with refused("arm.model: ", scenario.arm.model, "6 movable", "7"):
        _made(name, scenario)
    with refused("arm.model: ", "6 movable"):
        cell_urdf(scenario)


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
    assert arm_joints(url) == movable_joints(url) == movable_joints(IIWA)
    cell = CellStation(scenario)
    q = cell.plant.GetPositions(
        cell.part_context(cell.plant, cell.CreateDefaultContext()), cell.iiwa
    )
    np.testing.assert_allclose(q, cell.start, atol=1e-9)

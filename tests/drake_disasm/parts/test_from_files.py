"""A part of two model files: what is read, and what is refused."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.parts import ContactConfig, FromFiles
from drake_disasm.scenario import load_scenario
from tests.refusals import refused

PLUG = Path(__file__).parents[3] / "examples/plug"
TONGUE = '<box size="0.016 0.015 0.008"/>'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the example's files."""
    shutil.copytree(PLUG, tmp_path / "plug")
    return tmp_path / "plug"


def _edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_bodies_are_those_of_the_files() -> None:
    part = load_scenario(str(PLUG / "plug.yaml")).part
    assert isinstance(part, FromFiles)
    assert part.M_moved_B.get_mass() == pytest.approx(0.2)
    np.testing.assert_allclose(part.M_moved_B.get_com(), [0, 0.018, 0])
    assert set(part.moved_solids) == {"tongue", "grip"}
    assert part.grip_width == pytest.approx(0.012)
    assert part.bottom == pytest.approx(-0.016)
    assert part.touch_radius == pytest.approx(0.008)


def test_friction_is_the_environments_and_stiffness_the_files() -> None:
    part = load_scenario(str(PLUG / "plug.yaml")).part
    environment = part.environment(ContactConfig(friction=0.37))
    tongue = part.moved_materials(environment, 1e-3)["tongue"]
    assert tongue.GetProperty("material", "coulomb_friction").static_friction() == 0.37
    assert tongue.GetProperty("hydroelastic", "hydroelastic_modulus") == 4e7


FAULTS = {
    "overlap": ("plug.urdf", TONGUE, TONGUE.replace("0.008", "0.009"), "overlap"),
    "no grip": ("plug.urdf", 'name="grip"', 'name="handle"', "named 'grip'"),
    "one name": ("plug.urdf", 'name="tongue"', 'name="wall_left"', "rename one"),
    "a turn": ("plug.yaml", "way: y", "way: yv", "ends with a turn"),
    "at the start": ("plug.yaml", "[0.012, 0.012]", "[0.0, 0.0]", "0.0001"),
    "no file": ("plug.yaml", "socket.urdf", "sockt.urdf", "part.fixed"),
    "no XML": ("socket.urdf", "<link", "<lnik", "can't be read"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_one_line(folder: Path, fault: str) -> None:
    name, old, new, words = FAULTS[fault]
    _edit(folder / name, old, new)
    with refused(words):
        load_scenario(str(folder / "plug.yaml"))


def test_a_body_without_mass_is_refused(folder: Path) -> None:
    text = (folder / "plug.urdf").read_text()
    before, _, rest = text.partition("<inertial>")
    (folder / "plug.urdf").write_text(before + rest.partition("</inertial>")[2])
    with refused("part.moved: ", "states no mass"):
        load_scenario(str(folder / "plug.yaml"))


def test_an_open_mesh_is_refused(folder: Path) -> None:
    corners = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
    lines = [f"v {0.01 * x} {0.01 * y - 0.03} {0.01 * z}" for x, y, z in corners]
    faces = ["f 1 3 2", "f 1 2 4", "f 1 4 3"]
    (folder / "open.obj").write_text("\n".join([*lines, *faces]))
    _edit(folder / "plug.urdf", TONGUE, '<mesh filename="open.obj"/>')
    with refused("not watertight", "3 edges"):
        load_scenario(str(folder / "plug.yaml"))
    (folder / "open.obj").write_text("\n".join([*lines, *faces, "f 2 3 4"]))
    assert load_scenario(str(folder / "plug.yaml")).part.touch_radius > 0.0


def test_a_file_that_has_changed_is_read_again(folder: Path) -> None:
    scenario = load_scenario(str(folder / "plug.yaml"))
    assert scenario.part.M_moved_B.get_mass() == pytest.approx(0.2)
    _edit(folder / "plug.urdf", '<mass value="0.2"/>', '<mass value="0.3"/>')
    assert scenario.part.M_moved_B.get_mass() == pytest.approx(0.3)

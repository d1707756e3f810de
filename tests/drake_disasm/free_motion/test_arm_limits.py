"""Limits that a URDF states, and what an arm's links may hit."""

import numpy as np
import pytest

from drake_disasm.free_motion.arm_limits import CollisionFreeSpace, JointLimits
from drake_disasm.free_motion.fourier import FourierMotion
from tests.refusals import refused
from tests.sysid.models.arm import JOINTS, write_two_link_arm

_IIWA = "package://disasm_models/iiwa14/iiwa14.urdf"
_IIWA_JOINTS = tuple(f"iiwa_joint_{i}" for i in range(1, 8))

# Two rods of 0.4 m in the plane z = 1 m, and a post at x = 0 that the second can hit.
_ROD = """<link name="{0}"><inertial><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
<collision><origin xyz="{1}"/><geometry><sphere radius="0.05"/></geometry></collision>
</link>"""
_HINGE = """<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/>
<origin xyz="{3}"/><axis xyz="{4}"/>
<limit lower="-3" upper="3" velocity="2" effort="50"/></joint>
<transmission name="{0}_drive"><type>transmission_interface/SimpleTransmission</type>
<joint name="{0}"/><actuator name="{0}_motor"/></transmission>"""


@pytest.fixture
def folding(tmp_path) -> str:
    """An arm whose second rod's end meets its base's sphere if folded."""
    path = tmp_path / "folding.urdf"
    parts = [
        '<robot name="folding">',
        _ROD.format("post", "0 0 1"),
        _ROD.format("upper", "0.2 0 0"),
        _ROD.format("lower", "0.4 0 0"),
        _HINGE.format("shoulder", "post", "upper", "0 0 1", "0 0 1"),
        _HINGE.format("elbow", "upper", "lower", "0.4 0 0", "0 1 0"),
        "</robot>",
    ]
    path.write_text("".join(parts))
    return str(path)


def test_limits_are_those_of_the_urdf_less_the_margin(folding):
    limits = JointLimits.of_urdf(_IIWA, _IIWA_JOINTS, 5.0, 0.1)
    assert limits.upper[1] == pytest.approx(2.0944 - 0.1 * 2.0 * 2.0944, abs=1e-3)
    assert limits.lower == pytest.approx(-limits.upper)
    assert limits.effort[0] == pytest.approx(0.9 * 320.0)
    assert limits.acceleration[0] == pytest.approx(0.9 * 8.57)  # it states them
    limits = JointLimits.of_urdf(folding, JOINTS, 5.0, 0.1)
    assert limits.acceleration == pytest.approx(np.full(2, 4.5))


def test_a_limit_that_the_urdf_lacks_is_named(tmp_path):
    arm = write_two_link_arm(tmp_path / "two.urdf")  # it has no transmission
    with refused("effort limit of joint 'shoulder'", "<trans"):
        JointLimits.of_urdf(str(arm), JOINTS, 5.0, 0.1)


def test_a_motion_grows_up_to_its_first_limit_and_not_beyond(folding):
    limits = JointLimits.of_urdf(folding, JOINTS, 5.0, 0.1)
    random = np.random.default_rng(1)
    centre = np.array([0.5, -1.0])
    a, b = random.normal(size=(2, 2, 4))
    motion = FourierMotion(centre, a, b, 10.0).at_rest()
    time = np.linspace(0.0, 10.0, 400)
    q, v, vd = motion.scaled(limits.largest(centre, *motion.states(time))).states(time)
    within = np.max(np.stack([
        np.maximum((q - centre) / (limits.upper - centre),
                   (centre - q) / (centre - limits.lower)).max(axis=0),
        np.abs(v).max(axis=0) / limits.velocity,
        np.abs(vd).max(axis=0) / limits.acceleration,
    ]), axis=0)  # fmt: skip
    assert np.all(within <= 1.0) and np.all(within > 0.8)


def test_clearance_is_the_distance_of_links_that_no_joint_connects(folding):
    limits = JointLimits.of_urdf(folding, JOINTS, 5.0, 0.0)
    workspace = CollisionFreeSpace(folding, JOINTS, limits)
    assert workspace.has_geometry
    straight, folded = np.zeros(2), np.array([0.0, 3.0])
    far, near = workspace.clearance(np.stack([straight, folded]))
    assert far == pytest.approx(0.8 - 0.1, abs=1e-3)
    # The lower rod's sphere is 0.4 m from the elbow, turned by 3 rad about y.
    x, z = 0.4 + 0.4 * np.cos(3.0), -0.4 * np.sin(3.0)
    assert near == pytest.approx(np.hypot(x, z) - 0.1, abs=1e-3)
    assert near < 0.0
    # The height is that of moving links alone: its base stands at z = 0.
    assert workspace.height(np.zeros((1, 2)))[0] == pytest.approx(1.0)


def test_an_iiwa_that_folds_is_found_though_its_urdf_filters_that():
    limits = JointLimits.of_urdf(_IIWA, _IIWA_JOINTS, 5.0, 0.0)
    workspace = CollisionFreeSpace(_IIWA, _IIWA_JOINTS, limits)
    folded = np.array([0.0, 2.09, 0.0, -2.09, 0.0, 2.09, 0.0])
    upright, close = workspace.clearance(np.stack([np.zeros(7), folded]))
    assert upright > close


def test_links_that_are_always_near_leave_room_for_a_motion():
    """A UR5e's first and third wrist are 18 mm apart in every posture."""
    urdf = "package://disasm_models/ur5e/ur5e.urdf"
    joints = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
    joints = tuple(f"{name}_joint" for name in joints)
    limits = JointLimits.of_urdf(urdf, joints, 5.0, 0.1)
    stretched = np.array([[0.0, -1.57, 0.0, -1.57, 0.0, 0.0]])
    for clearance, is_near in ((0.0, True), (0.02, False)):
        workspace = CollisionFreeSpace(urdf, joints, limits, clearance)
        assert (workspace.clearance(stretched)[0] < 0.02) == is_near

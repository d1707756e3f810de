"""Units of what acts at a prismatic joint."""

import numpy as np

from drake_disasm.effects import JointCoulombFriction, JointViscousFriction
from sysid.fitting.candidates import Candidate, extended
from sysid.models.joint_motion import JointMotionModel
from sysid.models.joint_units import prismatic_unit
from tests.sysid.models.arm import write_motion_log

_CART = """<robot name="cart"><link name="rail"/>
  <link name="slide"><inertial><mass value="3"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="arm"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <joint name="x" type="prismatic"><parent link="rail"/><child link="slide"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" velocity="1" effort="9"/></joint>
  <joint name="turn" type="revolute"><parent link="slide"/><child link="arm"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="1" effort="9"/></joint>
</robot>
"""


def test_each_unit_has_its_own_at_a_prismatic_joint():
    rotary = ["N m", "N m s/rad", "rad/s", "kg m^2", "1/(N m)", "1", "s"]
    prismatic = ["N", "N s/m", "m/s", "kg", "1/N", "1", "s"]
    assert [prismatic_unit(unit) for unit in rotary] == prismatic


def test_a_models_channels_and_parameters_have_the_units_of_their_joints(tmp_path):
    urdf = tmp_path / "cart.urdf"
    urdf.write_text(_CART)
    columns = {k: np.random.default_rng(0).normal(size=(50, 2)) for k in ("q", "v")}
    columns |= {"vd": columns["q"], "tau": columns["v"], "time": 0.01 * np.arange(50)}
    log = write_motion_log(tmp_path / "log", urdf, columns, ("x", "turn"))
    model = JointMotionModel([log])
    assert [c.unit for c in model.measurements.channels] == ["N", "N m"]
    chosen = [
        Candidate.of(kind(joint=joint))
        for kind in (JointCoulombFriction, JointViscousFriction)
        for joint in ("x", "turn")
    ]
    found, _ = extended(model, chosen, with_shapes=True)
    units = {p.name: p.unit for p in found.parameters if p.path}
    assert units == {
        "JointCoulombFriction.x.size": "N",
        "JointCoulombFriction.x.creep": "m/s",
        "JointCoulombFriction.turn.size": "N m",
        "JointCoulombFriction.turn.creep": "rad/s",
        "JointViscousFriction.x.coefficient": "N s/m",
        "JointViscousFriction.turn.coefficient": "N m s/rad",
    }

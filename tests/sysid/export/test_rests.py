"""Torques at rest: masses and first moments alone are identified, and written."""

import numpy as np

from drake_disasm.effects import JointCoulombFriction
from drake_disasm.logs import LogHeader, LogWriter, flat_columns, read_log
from drake_disasm.scenario import Scenario
from sysid.export import make_exports
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import DEFAULT_SETTINGS
from sysid.models.joint_torque_static import JointTorqueStaticModel
from sysid.models.regressor import ArmRegressor
from sysid.workers import Workers
from tests.sysid.export.arms import Closed, changed, two_links
from tests.sysid.models.arm import JOINTS


def test_an_arm_known_at_rest_keeps_what_rest_does_not_show(tmp_path):
    urdf = two_links(tmp_path / "arm.urdf")
    generator = np.random.default_rng(0)
    q = generator.uniform(-2.0, 2.0, (60, 2))
    arm = ArmRegressor(urdf, JOINTS)
    pi = changed(arm.inertia, 0.1)
    tau = ArmRegressor(urdf, JOINTS, None, None).regressor(q, 0 * q, 0 * q) @ pi
    tau += 1.5 * np.sign(np.diff(q, axis=0, prepend=q[:1])) * [0.0, 1.0]
    tau += 1e-4 * generator.normal(size=tau.shape)
    columns = {"order": np.arange(60.0), "q": q, "tau": tau}
    header = LogHeader("joint_torque_static", "hold", {}, joints=JOINTS, urdf=urdf)
    with LogWriter(tmp_path / "log", header) as writer:
        writer.write_episode(flat_columns("joint_torque_static", columns))
    scenario = Scenario(effects=[JointCoulombFriction("elbow", 1.5)])
    model = JointTorqueStaticModel([read_log(tmp_path / "log")], None, scenario)
    fit = Fitter.of(model, Workers(1), np.inf, DEFAULT_SETTINGS).fit(())
    exports = make_exports(Closed(fit), ["urdf", "sdf"])
    assert exports.arm.bodies.is_exact
    assert max(trip.share for trip in exports.trips.values()) < 1e-6

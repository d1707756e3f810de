"""Files that are read again, and refusals with nothing written."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.effects import (
    FlangePayload,
    JointCoulombFriction,
    JointDahlFriction,
    JointStribeckFriction,
    JointViscousFriction,
    RotorInertia,
)
from drake_disasm.scenario import load_scenario
from sysid.export import make_exports, refuse_export, write
from sysid.export.identified_arm import PAYLOAD, IdentifiedArm
from sysid.models.joint_motion import JointMotionModel
from tests.refusals import refused
from tests.sysid.export.arms import IIWA, IIWA_JOINTS, Closed, fitted, two_links
from tests.sysid.models.arm import JOINTS

ON_TWO = (
    JointViscousFriction("elbow", 0.7),
    JointCoulombFriction("elbow", 1.1),
    JointDahlFriction("shoulder", 0.9, 0.01),
    JointStribeckFriction("shoulder", 0.4),
    RotorInertia("shoulder", 0.2),
    FlangePayload(0.8, 0.02, -0.03, 0.1),
)


@pytest.fixture
def closed(tmp_path) -> Closed:
    """A small arm with other bodies than its URDF's, friction and a payload."""
    urdf = two_links(tmp_path / "arm.urdf")
    return fitted(tmp_path / "log", urdf, JOINTS, ON_TWO)


def test_urdf_and_sdf_give_the_verdicts_torques(closed, tmp_path):
    exports = make_exports(closed, ["urdf", "sdf"])
    assert exports.arm.bodies.is_exact
    assert {kind: trip.share < 1e-6 for kind, trip in exports.trips.items()} == {
        "urdf": True,
        "sdf": True,
    }
    assert exports.trips["urdf"].left_out > 0.01  # Stribeck's friction
    exports.write(tmp_path)
    assert PAYLOAD in (tmp_path / "arm_identified.urdf").read_text()
    notes = (tmp_path / "export.md").read_text()
    assert "friction that falls with speed | shoulder | size = 0.4" in notes
    scenario = load_scenario(str(tmp_path / "arm_identified_effects.yaml"))
    assert [type(e) for e in scenario.effects] == [type(e) for e in ON_TWO]


@pytest.mark.parametrize("kind", ["urdf", "sdf", "mjcf"])
def test_an_iiwa_is_read_again(kind, tmp_path):
    if kind == "mjcf":
        pytest.importorskip("mujoco")
    effects = [JointCoulombFriction(IIWA_JOINTS[3], 1.1), FlangePayload(1.0, 0.0, 0.1)]
    exports = make_exports(fitted(tmp_path, IIWA, IIWA_JOINTS, effects), [kind])
    assert exports.arm.bodies.is_exact
    assert exports.trips[kind].share < (1e-5 if kind == "mjcf" else 1e-6)


def test_mujoco_compiles_the_same_torques(closed):
    pytest.importorskip("mujoco")
    exports = make_exports(closed, ["mjcf"])
    assert exports.trips["mjcf"].share < 1e-5
    text = exports.files["arm_identified.xml"].decode()
    assert 'armature="0.2"' in text and 'frictionloss="1.1"' in text
    assert 'damping="0.7"' in text


@pytest.mark.parametrize(
    "change",
    [(b'damping="0.7"', b'damping="0.8"'), (b'friction="1.1"', b'friction="1.2"')],
)
def test_a_file_that_says_something_else_is_not_written(change, closed, monkeypatch):
    honest = write.urdf_bytes

    def wrong(arm: IdentifiedArm) -> bytes:
        return honest(arm).replace(*change)

    monkeypatch.setattr(write, "urdf_bytes", wrong)
    with refused("arm_identified.urdf, read again, differs by", "not written"):
        make_exports(closed, ["urdf"])


def test_base_parameters_that_no_body_has_are_refused(closed):
    theta = closed.last.theta.copy()
    theta[: len(theta)] *= -1.0
    wrong = Closed(dataclasses.replace(closed.last, theta=theta))
    with refused("no physical inertia gives the identified base parameters"):
        make_exports(wrong, ["urdf"])


def test_models_without_bodies_of_their_own_are_refused_first(closed):
    model = closed.last.model
    assert isinstance(model, JointMotionModel)
    refuse_export(model, ["urdf"])
    with refused("base parameters were held"):
        refuse_export(model.only(["upper.Izz"]), ["urdf"])
    with refused("has no URDF"):
        refuse_export(model.replace(_inertia=np.ones(10)), ["urdf"])


def test_a_missing_mujoco_is_named_with_the_remedy(closed, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    with refused("pip install 'drake_disasm[mujoco]'"):
        refuse_export(closed.last.model, ["mjcf"])

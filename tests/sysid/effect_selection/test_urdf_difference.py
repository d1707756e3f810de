"""What identified rigid bodies say of the URDF, on a simulated UR-like arm."""

import numpy as np
import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import (
    FlangePayload,
    JointViscousFriction,
    LinkPayload,
    RotorInertia,
)
from drake_disasm.logs import read_log, write_static_wrench
from sysid.data_checks import check_data
from sysid.effect_selection.close_loop import close_loop
from sysid.effect_selection.urdf_difference import links_in_base, urdf_difference
from sysid.fitting.candidates import Candidate, extended
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import DEFAULT_SETTINGS
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.joint_motion import JointMotionModel
from sysid.workers import Workers
from tests.sysid.models.two_logs import two_logs


def fitted(model):
    fitter = Fitter.of(model, Workers(), np.inf, DEFAULT_SETTINGS)
    return fitter.fit(())


@pytest.fixture(scope="module")
def loaded(tmp_path_factory):
    """Returns the log of a small arm whose flange carries 0.8 kg."""
    folder = tmp_path_factory.mktemp("logs")
    return two_logs(folder, changes=[FlangePayload(0.8, 0.04, 0.0, 0.08)])[1]


def test_a_body_on_the_flange_is_weighed_against_the_urdf(loaded):
    found = urdf_difference(fitted(JointMotionModel([loaded])))
    assert found is not None and found.body is not None
    value, low, high = found.body.mass
    assert found.body.link == "lower"
    assert found.body.share > 0.98
    assert low <= value <= high
    assert value == pytest.approx(0.8, rel=0.1)
    assert "more on lower than the URDF says" in found.sentence


def test_rotors_are_no_body(tmp_path):
    rotors = [RotorInertia("shoulder", 0.3), RotorInertia("elbow", 0.2)]
    found = urdf_difference(fitted(JointMotionModel(two_logs(tmp_path, rotors)[:1])))
    assert found is not None and found.body is None
    assert found.rotors > 0.95
    assert "inertia of rotors explains" in found.sentence


def test_the_check_of_the_data_trusts_a_urdf(loaded):
    model = model_of([loaded], ModelChoice(trust_urdf=True))
    assert not {each.kind for each in check_data([loaded], model)} & {
        *("spikes", "unrelated"),
    }


def test_a_right_urdf_differs_by_nothing_that_shows(tmp_path):
    found = urdf_difference(fitted(JointMotionModel(two_logs(tmp_path)[:1])))
    assert found is not None
    assert found.share < 0.01
    assert len(found.differing) <= 2


def test_a_trusted_urdf_leaves_what_hangs_there(loaded):
    model = model_of([loaded], ModelChoice(trust_urdf=True))
    assert model.parameters == ()
    closed = close_loop(model, library=[FlangePayload, JointViscousFriction])
    assert closed.verdict.confirmed == ("FlangePayload",)
    values = {v.name.partition(".")[2]: v.value for v in closed.verdict.values}
    assert values["mass"] == pytest.approx(0.8, abs=0.02)
    assert set(values) == {"mass", "cx", "cy", "cz"}  # a body is one, or none
    assert closed.urdf_difference is None


def test_a_body_on_an_inner_link_acts_as_one_in_the_urdf(loaded):
    model = model_of([loaded], ModelChoice(trust_urdf=True))
    body = LinkPayload("shoulder", 0.5, 0.05, 0.01, 0.1)
    more, _ = extended(model, [Candidate.of(body)])
    theta = np.array([p.nominal for p in more.parameters])
    free = JointMotionModel([loaded])
    beta = np.array([p.nominal for p in free.parameters])
    beta = beta + links_in_base(free)["upper"] @ body.inertial
    assert np.allclose(more.predictions(theta), free.predictions(beta), atol=1e-9)


def test_logs_without_links_trust_no_urdf(tmp_path):
    turns = np.tile(np.eye(4), (2, 1))
    wrench = np.zeros((8, 6))
    write_static_wrench(tmp_path / "log", turns, wrench, "S", "weigh", {})
    log = read_log(tmp_path / "log")
    with pytest.raises(DisasmError, match="has no rigid bodies"):
        model_of([log], ModelChoice(trust_urdf=True))

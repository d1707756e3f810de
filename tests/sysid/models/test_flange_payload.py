"""A payload that the model of the arm does not know, against Drake's dynamics."""

from pathlib import Path

import numpy as np
import pytest

from drake_disasm.effects import FlangePayload, JointCoulombFriction
from drake_disasm.logs import Log
from drake_disasm.scenario import Scenario
from sysid.effect_selection.close_loop import close_loop
from sysid.fitting.candidates import candidates
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.joint_motion import JointMotionModel
from sysid.scenario_parameters import ParameterRequest
from tests.sysid.models.arm import write_motion_log, write_two_link_arm
from tests.sysid.models.test_joint_motion import drakes_torques, states

MASS, COM = 1.5, np.array([0.05, -0.03, 0.12])
NOISE = 0.05  # N m
LOAD = f"""<link name="load"><inertial><origin xyz="{COM[0]} {COM[1]} {COM[2]}"/>
<mass value="{MASS}"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>
</inertial></link><joint name="held" type="fixed"><parent link="flange"/>
<child link="load"/></joint>"""
FLANGE = """<link name="flange"/><joint name="ee" type="fixed"><parent link="lower"/>
<child link="flange"/><origin xyz="0 0.02 0.3" rpy="0.3 0 1"/></joint>"""


@pytest.fixture
def log(tmp_path: Path) -> Log:
    """Motion of an arm that carries something; the header knows nothing of it."""
    known = write_two_link_arm(tmp_path / "a.urdf", FLANGE)
    loaded = write_two_link_arm(tmp_path / "b.urdf", FLANGE + LOAD)
    q, v, vd = states(400)
    tau = drakes_torques(loaded, q, v, vd)
    tau += NOISE * np.random.default_rng(1).normal(size=tau.shape)
    columns = {"time": 0.01 * np.arange(400), "q": q, "v": v, "vd": vd, "tau": tau}
    return write_motion_log(tmp_path / "log", known, columns)


def test_a_payload_is_drakes_point_mass_and_a_candidate_of_the_arm(log: Log) -> None:
    library = [FlangePayload, JointCoulombFriction]
    found = candidates(JointMotionModel([log]), library)
    assert [c.name for c in found].count("FlangePayload") == 1
    assert len(found) == 1 + 2 * 3  # friction of each joint, in three shapes
    scenario = Scenario(effects=[FlangePayload(MASS, *(MASS * COM))])
    model = JointMotionModel([log], scenario=scenario).only([])
    residual = model.predictions(np.zeros(0)) - model.measurements.values
    assert np.std(residual) == pytest.approx(NOISE, rel=0.1)


def test_closing_the_loop_finds_it_beside_the_arm_of_the_urdf(log: Log) -> None:
    model = model_of([log], ModelChoice(requests=(ParameterRequest("upper.Izz"),)))
    assert isinstance(model, JointMotionModel)
    found = close_loop(model)
    assert found.verdict.names == ("FlangePayload",)
    (effect,) = found.last.model.scenario_at(found.last.theta).effects
    assert effect.mass == pytest.approx(MASS, abs=0.03)
    np.testing.assert_allclose(effect.first_moment, MASS * COM, atol=0.01)


def test_a_payload_is_not_asked_for_if_the_last_link_is_free(log: Log) -> None:
    """A link's own inertia takes it up: the model lacks nothing."""
    model = model_of([log], ModelChoice())
    assert isinstance(model, JointMotionModel)
    verdict = close_loop(model).verdict
    assert not verdict.names and verdict.ending == "none"
    assert not any(limit.effect == "FlangePayload" for limit in verdict.limits)

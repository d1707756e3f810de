"""A flexible learner bounds what is left, and stands in for an effect nobody knows."""

from pathlib import Path

import numpy as np
import pytest
from sklearn.ensemble import GradientBoostingRegressor

from drake_disasm.effects import JointCoulombFriction, JointViscousFriction
from drake_disasm.logs import LogHeader, LogWriter, flat_columns, read_log
from drake_disasm.scenario import Scenario
from sysid.effect_selection.close_loop import ClosedLoop, close_loop
from sysid.models.joint_motion import JointMotionModel
from sysid.residuals.residual_model import _trees
from tests.sysid.models.arm import JOINTS, smooth_motion, write_two_link_arm

_ROWS, _NOISE = 1500, 0.02
_LIBRARY = (JointCoulombFriction, JointViscousFriction)


def _model(folder: Path, hidden: float) -> JointMotionModel:
    """Returns the model of two runs of an arm whose elbow sticks as nobody models it.

    Args:
        folder: of the logs.
        hidden: size of what is hidden [N m].
    """
    urdf = write_two_link_arm(folder / "two.urdf")
    header = LogHeader("joint_motion", "excite", {}, joints=JOINTS, urdf=str(urdf))
    logs, random = [], np.random.default_rng(0)
    for number, speed in enumerate((1.0, 1.13)):
        time = 0.01 * np.arange(_ROWS)
        q, v, vd = smooth_motion(speed * time)
        columns = {"time": time, "q": q, "v": speed * v, "vd": speed**2 * vd}
        with LogWriter(folder / f"bare_{number}", header) as writer:
            writer.write_episode(flat_columns("joint_motion", columns | {"tau": 5 * q}))
        friction = [JointViscousFriction("elbow", 0.05)]
        bare = JointMotionModel(
            [read_log(folder / f"bare_{number}")], scenario=Scenario(effects=friction)
        )
        tau = bare.predictions(np.array([p.nominal for p in bare.parameters]))
        tau[:, 1] += hidden * np.cos(0.8 * speed * v[:, 1])
        tau += _NOISE * random.normal(size=tau.shape)
        with LogWriter(folder / f"log_{number}", header) as writer:
            writer.write_episode(flat_columns("joint_motion", columns | {"tau": tau}))
        logs.append(read_log(folder / f"log_{number}"))
    return JointMotionModel(logs)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("hidden")


@pytest.fixture(scope="module")
def found(folder: Path) -> ClosedLoop:
    model = _model(folder, hidden=0.2)
    return close_loop(model, train=[0], test=[1], library=_LIBRARY, learn_residual=True)


def test_what_is_left_is_said_with_its_channel_and_what_it_depends_on(found):
    (left,) = found.verdict.predictable_residual
    assert left.channel == "elbow" and left.share > 0.5
    assert left.depends_on[0] == "velocity"
    assert 0.05 < left.size < 0.2 and left.unit == "N m"
    assert found.verdict.ending in ("partly", "unexplained")
    assert "elbow depends on velocity" in found.text


def test_a_residual_model_halves_the_error_of_a_run_it_never_saw(found, tmp_path):
    model = found.verdict.residual_model
    (error,) = model.errors
    assert error.channel == "elbow" and error.gain > 0.3
    assert "not physical" in found.text
    model.functions.save(tmp_path / "model.npz")
    effect = model.effect(str(tmp_path / "model.npz"))
    scenario = found.scenario_with_residual_model(effect.file)
    assert scenario.effects[-1] == effect and not effect.is_physical
    held_out = found.errors
    assert error.before == pytest.approx(held_out.rms(held_out.after)[1], rel=1e-6)


def test_identification_takes_the_scenario_with_it(found, folder, tmp_path):
    model = found.verdict.residual_model
    model.functions.save(tmp_path / "model.npz")
    scenario = found.scenario_with_residual_model(str(tmp_path / "model.npz"))
    fit = found.last
    base = fit.theta[: len(found.first.theta)]
    again = JointMotionModel([read_log(folder / "log_0")], scenario=scenario)
    residual = again.predictions(base) - again.measurements.values
    before = fit.linearisation.residual * fit.model.measurements.noise
    assert np.std(residual[:, 1]) < 0.6 * np.std(before[:, 1])
    np.testing.assert_allclose(residual[:, 0], before[:, 0], atol=1e-9)


def test_nothing_is_left_where_nothing_is_hidden(tmp_path):
    model = _model(tmp_path, hidden=0.0)
    verdict = close_loop(model, train=[0], test=[1], library=_LIBRARY).verdict
    assert verdict.names == ("JointViscousFriction.elbow",)
    assert not verdict.predictable_residual and verdict.residual_model is None
    assert verdict.ending == "explained"


def test_saved_trees_predict_what_the_learner_does():
    random = np.random.default_rng(0)
    x = random.normal(size=(400, 4))
    y = np.sin(2 * x[:, 0]) * x[:, 1] + 0.1 * random.normal(size=400)
    learner = GradientBoostingRegressor(max_leaf_nodes=8, random_state=0).fit(x, y)
    inside = np.clip(random.normal(size=(200, 4)), x.min(axis=0), x.max(axis=0))
    np.testing.assert_allclose(_trees(learner, x)(inside), learner.predict(inside))

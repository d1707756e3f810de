"""An encoder that reads another angle, in logs of an arm's torques."""

import numpy as np
import pytest

from drake_disasm.effects import EncoderError, JointElasticity
from drake_disasm.scenario import Scenario
from sysid.models.joint_motion import JointMotionModel
from sysid.models.regressor import ArmRegressor
from tests.sysid.models.arm import (
    JOINTS,
    smooth_motion,
    write_motion_log,
    write_two_link_arm,
)
from tests.sysid.models.fitted import fitted

_TIME = 0.01 * np.arange(600)
_NOISE = 0.01  # N m


@pytest.fixture
def urdf(tmp_path):
    return write_two_link_arm(tmp_path / "two.urdf")


def _log(folder, urdf, offset=0.0, scale=0.0, noise=0.0, joint="elbow"):
    """An arm's torques, and the motion as a joint's encoder reads it."""
    at = np.array([name == joint for name in JOINTS])
    motion = smooth_motion(_TIME)
    tau = ArmRegressor(str(urdf), JOINTS).torques(*motion)
    tau += noise * np.random.default_rng(0).normal(size=tau.shape)
    read = [x * (1.0 + scale * at) for x in motion]
    read[0] = read[0] + offset * at
    columns = dict(zip(("q", "v", "vd"), read, strict=True))
    return write_motion_log(folder, urdf, {"time": _TIME, "tau": tau, **columns})


def _missed(log, effects) -> float:
    """Returns the rms of what a model at the URDF misses of the torques."""
    model = JointMotionModel([log], scenario=Scenario(effects=effects))
    theta = np.array([p.nominal for p in model.parameters])
    return float(np.sqrt(np.mean((model.predictions(theta) - _tau(log)) ** 2)))


def _tau(log) -> np.ndarray:
    return log.episodes[0]["tau"]


@pytest.mark.parametrize(("offset", "scale"), [(0.01, 0.0), (0.0, 0.01), (-0.01, 0.02)])
def test_what_it_misses_is_of_second_order(offset, scale, urdf, tmp_path):
    missed = []
    for share in (1.0, 0.5):
        wrong = share * offset, share * scale
        log = _log(tmp_path / f"{share}", urdf, *wrong)
        missed.append(_missed(log, [EncoderError("elbow", *wrong)]))
        assert missed[-1] < 0.1 * _missed(log, [])
    assert missed[0] / missed[1] == pytest.approx(4.0, rel=0.1)


def test_least_squares_get_offset_and_scale_back(urdf, tmp_path):
    log = _log(tmp_path / "log", urdf, 0.02, -0.01, _NOISE, "shoulder")
    effects = [EncoderError("shoulder", 1e-3), EncoderError("shoulder", scale=1e-3)]
    found, left = fitted(log, effects)
    np.testing.assert_allclose(1e-3 * found, [0.02, -0.01], rtol=0.1)
    assert left < 1.2 * _NOISE
    rival = JointElasticity("shoulder", 1e-3)
    assert fitted(log, [rival])[1] > 1.5 * _NOISE


def test_the_last_joints_offset_turns_its_links_weight_alone(urdf, tmp_path):
    log = _log(tmp_path / "log", urdf, 0.02, 0.0, _NOISE)
    assert fitted(log, [])[1] < 1.2 * _NOISE


def test_it_acts_on_any_rows_and_is_linear(urdf, tmp_path):
    log = _log(tmp_path / "log", urdf)
    theta = np.array([p.nominal for p in JointMotionModel([log]).parameters])
    scenario = Scenario(effects=[EncoderError("elbow", 0.1, 0.05)])
    of_some, of_all = (JointMotionModel([log], scenario=scenario) for _ in range(2))
    mask = np.arange(len(_TIME)) % 7 == 3
    some, whole = of_some.of_rows(mask).predictions(theta), of_all.predictions(theta)
    np.testing.assert_allclose(some, whole[mask], rtol=1e-12)
    np.testing.assert_allclose(of_some.predictions(theta), whole, rtol=1e-12)
    parts = [EncoderError("elbow", 0.1), EncoderError("elbow", scale=0.05)]
    both = JointMotionModel([log], scenario=Scenario(effects=parts))
    np.testing.assert_allclose(both.predictions(theta), whole, rtol=1e-12)


def test_an_offset_about_the_vertical_does_not_show(tmp_path):
    """Gravity does not change about it."""
    upright = tmp_path / "upright.urdf"
    upright.write_text(
        write_two_link_arm(tmp_path / "two.urdf")
        .read_text()
        .replace("1.2 0 0", "0 0 0")
    )
    log = _log(tmp_path / "log", upright, 0.0)
    assert _missed(log, [EncoderError("shoulder", 0.1)]) < 1e-6
    assert _missed(log, [EncoderError("elbow", 0.1)]) > 0.01

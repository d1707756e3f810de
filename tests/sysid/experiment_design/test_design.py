"""Designed motions: within all limits, better than random, as telling as predicted."""

import numpy as np
import pytest

from drake_disasm.free_motion.arm_limits import CollisionFreeSpace, JointLimits
from sysid.experiment_design.design import DesignSettings, design_motion
from sysid.experiment_design.information import (
    ArmExperiment,
    condition_of,
    confusion_of,
    uncertainty_of,
)
from tests.refusals import refused
from tests.sysid.models.arm import JOINTS, write_two_link_arm

_KINDS = ("JointCoulombFriction", "JointViscousFriction")
_NOISE = np.array([0.5, 0.2])  # N m
_DRIVE = """<transmission name="{0}_drive">
<type>transmission_interface/SimpleTransmission</type>
<joint name="{0}"/><actuator name="{0}_motor"/></transmission>"""
_SETTINGS = DesignSettings(duration=8.0, harmonics=4, starts=10, iterations=6)


@pytest.fixture(scope="module")
def urdf(tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("arm") / "two.urdf"
    return str(write_two_link_arm(path, "".join(map(_DRIVE.format, JOINTS))))


@pytest.fixture(scope="module")
def experiment(urdf) -> ArmExperiment:
    return ArmExperiment(urdf, JOINTS, _KINDS, _NOISE, _SETTINGS.duration)


@pytest.fixture(scope="module")
def limits(urdf) -> JointLimits:
    return JointLimits.of_urdf(urdf, JOINTS, 5.0, 0.1)


@pytest.fixture(scope="module")
def design(urdf, experiment, limits):
    workspace = CollisionFreeSpace(urdf, JOINTS, limits)
    return design_motion(experiment, limits, workspace, _SETTINGS)


def _states(design):
    return design.motion.states(np.linspace(0.0, _SETTINGS.duration, 1601))


def test_it_is_within_all_limits(design, limits, experiment):
    q, v, vd = _states(design)
    assert np.all(q <= limits.upper) and np.all(q >= limits.lower)
    for values, most in (
        (v, limits.velocity),
        (vd, limits.acceleration),
        (experiment.torques(q, v, vd), limits.effort),
    ):
        assert np.all(np.abs(values).max(axis=0) <= most)
    assert np.abs(v[[0, -1]]).max() < 1e-9


def test_it_tells_more_than_the_median_of_random_motions(design):
    assert design.after.criterion < design.before.criterion - 0.3


def test_predicted_intervals_are_those_of_fits_to_noisy_recordings(design, experiment):
    rows = int(_SETTINGS.duration * _SETTINGS.rate)
    time = np.arange(rows) / _SETTINGS.rate
    columns = experiment.columns(time, *design.motion.states(time))
    A = (columns / _NOISE[:, None]).reshape(-1, columns.shape[-1])
    random = np.random.default_rng(0)
    fits = np.linalg.lstsq(A, random.normal(size=(len(A), 400)), rcond=None)[0]
    measured = 1.96 * fits.std(axis=1)
    assert measured == pytest.approx(design.spreads, rel=0.2)


def test_unknowns_are_base_parameters_and_each_joints_effects(experiment):
    effects = [u for u in experiment.unknowns if u.is_effect]
    assert [u.name for u in effects] == [
        "JointCoulombFriction.shoulder.size",
        "JointCoulombFriction.elbow.size",
        "JointViscousFriction.shoulder.coefficient",
        "JointViscousFriction.elbow.coefficient",
    ]
    assert {u.unit for u in effects} == {"N m", "N m s/rad"}
    assert len(experiment.unknowns) > len(effects)


def test_units_change_the_criterion_by_a_constant():
    random = np.random.default_rng(0)
    one, other = (x @ x.T for x in random.normal(size=(2, 4, 9)))
    scale = np.diag([1.0, 10.0, 0.1, 1e3])
    before = uncertainty_of(one) - uncertainty_of(other)
    after = uncertainty_of(scale @ one @ scale) - uncertainty_of(scale @ other @ scale)
    assert after == pytest.approx(before, rel=1e-6)


def test_what_another_effect_does_as_well_separates_nothing():
    """Two columns with the correlation r leave 1 - r^2 of each other."""
    r = 0.8
    information = np.array([[1.0, r, 0.0], [r, 1.0, 0.0], [0.0, 0.0, 4.0]])
    kinds = [np.arange(3) == 0, np.arange(3) == 1]
    expected = -np.log(1.0 - r**2)
    assert confusion_of(information, kinds) == pytest.approx(expected, rel=1e-6)


def test_a_motion_separates_two_effects_better_than_one_that_shows_all(
    urdf, limits, design
):
    rivals = ("JointCoulombFriction", "JointStribeckFriction")
    experiment = ArmExperiment(urdf, JOINTS, _KINDS, _NOISE, _SETTINGS.duration, rivals)
    workspace = CollisionFreeSpace(urdf, JOINTS, limits)
    found = design_motion(experiment, limits, workspace, _SETTINGS)
    time = np.linspace(0.0, _SETTINGS.duration, 400)
    columns = experiment.columns(time, *design.motion.states(time))
    rows = int(_SETTINGS.duration * _SETTINGS.rate)
    usual = experiment.criterion(experiment.information(columns, rows))
    assert found.after.criterion < usual - 0.3
    assert "JointStribeckFriction" in experiment.criterion_name


def test_the_condition_number_is_the_scaled_regressors():
    A = np.random.default_rng(0).normal(size=(50, 4)) * [1.0, 1e3, 1e-3, 1.0]
    scaled = A / np.linalg.norm(A, axis=0)
    assert condition_of(A.T @ A) == pytest.approx(np.linalg.cond(scaled))


def test_a_floor_above_the_arm_is_refused(urdf, experiment, limits):
    high = DesignSettings(duration=8.0, harmonics=4, starts=2, iterations=1, floor=5.0)
    with refused("no motion", "`floor`"):
        design_motion(
            experiment, limits, CollisionFreeSpace(urdf, JOINTS, limits), high
        )
    with refused("did you mean 'JointCoulombFriction'"):
        ArmExperiment(urdf, JOINTS, ["JointCoulombFrictoin"], _NOISE, 8.0)

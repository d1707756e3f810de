"""Effects in logs that the import has filtered: amplitudes come back, unrounded."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.effects import (
    ArmDelay,
    JointCoulombFriction,
    JointDahlFriction,
    JointViscousFriction,
    TorqueOffset,
)
from drake_disasm.logs import read_log
from drake_disasm.logs.importing import (
    ImportProcessing,
    guessed_map,
    import_recordings,
    read_source,
    write_log,
)
from drake_disasm.logs.importing.importer import low_pass_of
from drake_disasm.scenario import Scenario
from sysid.models.joint_motion import JointMotionModel
from sysid.models.log_filters import LogFilter, log_filters
from sysid.models.regressor import ArmRegressor
from tests.sysid.models.arm import JOINTS, write_two_link_arm
from tests.sysid.models.fitted import fitted

PERIOD, CUTOFF, NOISE, SIZES = 0.004, 4.0, 0.5, (3.0, 2.0)
DRY = tuple(map(JointCoulombFriction, JOINTS, (1.0, 1.0)))


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """Two swinging joints with dry friction, recorded and imported."""
    folder = tmp_path_factory.mktemp("filtered")
    urdf = write_two_link_arm(folder / "two.urdf")
    time = PERIOD * np.arange(4000)
    q, v, vd = swing(time)
    tau = ArmRegressor(str(urdf), JOINTS).torques(q, v, vd)
    tau += np.array(SIZES) * np.tanh(v / DRY[0].creep)
    tau += NOISE * np.random.default_rng(0).standard_normal(tau.shape)
    np.savez(folder / "run.npz", time=time, q=q, tau=tau)
    source = read_source(folder / "run.npz")
    fields = guessed_map(source, "joint_motion")
    fields = dataclasses.replace(fields, urdf=str(urdf), joints=JOINTS)
    found = import_recordings([source], fields, ImportProcessing(cutoff=CUTOFF))
    write_log(found, [source], fields, folder / "log", {})
    return read_log(folder / "log")


def swing(time):
    w = np.array([[1.7, 2.3], [3.1, 4.4]])
    phase = time[:, None, None] * w
    q, v = 0.4 * np.sin(phase), 0.4 * w * np.cos(phase)
    return tuple(a.sum(axis=1) for a in (q, v, -(w**2) * q))


def silent(log):
    """The same log without provenance."""
    header = dataclasses.replace(log.header, provenance={})
    return dataclasses.replace(log, header=header)


def model_with(log, *effects):
    return JointMotionModel([log], scenario=Scenario(effects=list(effects)))


def predicted(model):
    return model.predictions(np.array([p.nominal for p in model.parameters]))


def test_dry_friction_of_a_filtered_log_has_its_size(log):
    """Only noise is left: white noise through the filter has 2 fc T of its power."""
    sizes, left = fitted(log, DRY)
    noise = NOISE * np.sqrt(2.0 * CUTOFF * PERIOD)
    error = noise / np.sqrt(log.episodes[0]["time"][-1] * 2.0 * CUTOFF)
    np.testing.assert_allclose(sizes, SIZES, atol=3.0 * error)
    assert left == pytest.approx(noise, rel=0.2)
    rounded, more = fitted(silent(log), DRY)
    assert np.all(rounded < SIZES - 3.0 * error) and more > 2.0 * noise


def test_a_log_without_provenance_is_not_filtered(log):
    assert not log_filters([silent(log)])
    v = log.episodes[0]["v"]
    bare, dry = (predicted(model_with(silent(log), *e)) for e in ((), DRY))
    np.testing.assert_allclose(dry - bare, np.tanh(v / DRY[0].creep), atol=1e-12)


def test_effects_that_are_linear_in_the_motion_are_filtered_already(log):
    effects = JointViscousFriction("elbow", 0.7), TorqueOffset("shoulder", 0.3)
    one, other = (predicted(model_with(each, *effects)) for each in (log, silent(log)))
    np.testing.assert_array_equal(one, other)


def test_effects_of_null_change_nothing(log):
    null = JointCoulombFriction("elbow", 0.0), JointDahlFriction("elbow", 0.0)
    bare = predicted(model_with(log))
    np.testing.assert_array_equal(predicted(model_with(log, *null)), bare)
    changed = predicted(model_with(log, JointCoulombFriction("elbow", 1e-9))) - bare
    assert not changed[:, 0].any() and changed[:, 1].any()


def test_rows_that_are_left_out_change_no_other_row(log):
    model = model_with(log, *DRY, JointDahlFriction("elbow", 1.0), ArmDelay(0.01))
    whole = predicted(model)
    mask = np.random.default_rng(0).random(len(whole)) < 0.2
    np.testing.assert_array_equal(predicted(model.of_rows(mask)), whole[mask])


def test_an_edge_between_rows_becomes_the_imports(log):
    """Rows of a filtered step; a constant stays one up to the ends."""
    own = LogFilter.of(log.header)
    low, points = own.low, own.points
    assert points > 1
    step = np.where(np.arange(200 * points) < 100 * points + 1, -1.0, 1.0)[:, None]
    first = -(-low.reach // points)
    expected = low(step)[first * points - low.reach :: points]
    inner = own(step)[first : first + len(expected)]
    np.testing.assert_allclose(inner, expected, atol=1e-12)
    np.testing.assert_allclose(own(np.ones_like(step)), 1.0, atol=1e-12)


@pytest.mark.parametrize(
    "stated", [None, 3, {"processing": None}, {"processing": {"cutoff_Hz": "4"}}]
)
def test_a_provenance_that_states_no_filter(log, stated):
    header = dataclasses.replace(log.header, provenance={"import": stated})
    assert low_pass_of(header) is None

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
from drake_disasm.importing import (
    Processing,
    guessed_map,
    import_recordings,
    read_source,
    write_log,
)
from drake_disasm.importing.importer import low_pass_of
from drake_disasm.logs import read_log
from drake_disasm.scenario import Scenario
from sysid.models.joint_motion import JointMotionModel
from sysid.models.log_filters import LogFilters
from sysid.models.regressor import ArmDynamics
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
    tau = ArmDynamics(str(urdf), JOINTS).torques(q, v, vd)
    tau += np.array(SIZES) * np.tanh(v / DRY[0].creep)
    tau += NOISE * np.random.default_rng(0).standard_normal(tau.shape)
    np.savez(folder / "run.npz", time=time, q=q, tau=tau)
    source = read_source(folder / "run.npz")
    fields = guessed_map(source, "joint_motion")
    fields = dataclasses.replace(fields, urdf=str(urdf), joints=JOINTS)
    found = import_recordings([source], fields, Processing(cutoff=CUTOFF))
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
    assert left < 1.3 * noise
    rounded, more = fitted(silent(log), DRY)
    assert np.all(rounded < SIZES - 3.0 * error) and more > 2.0 * noise


def test_a_log_without_provenance_is_not_filtered(log):
    assert not LogFilters.of([silent(log)])
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


def test_episodes_are_filtered_each_by_its_own_filter(log):
    low = low_pass_of(log.header)
    rows = (slice(0, 200), slice(200, 220), slice(220, 400))
    filters = LogFilters(tuple(zip(rows, (low, low, None), strict=True)))
    torque = np.ones((400, 2))
    torque[200:, 0] = -1.0
    torque[:, 1] = 0.0
    np.testing.assert_allclose(filters(torque), torque, atol=1e-12)
    torque[220:] = np.random.default_rng(0).standard_normal((180, 2))
    np.testing.assert_array_equal(filters(torque)[220:], torque[220:])
    step = np.where(np.arange(400)[:, None] < 100, -1.0, 1.0) * np.ones((1, 2))
    inner = slice(low.reach, 200 - low.reach)
    np.testing.assert_allclose(filters(step)[inner], low(step[:200]), atol=1e-12)


@pytest.mark.parametrize(
    "stated", [None, 3, {"processing": None}, {"processing": {"cutoff_Hz": "4"}}]
)
def test_a_provenance_that_states_no_filter(log, stated):
    header = dataclasses.replace(log.header, provenance={"import": stated})
    assert low_pass_of(header) is None

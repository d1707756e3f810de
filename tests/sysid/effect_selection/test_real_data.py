"""What real measurements lack, from the models that their authors used."""

import arm_verdicts
import null_alarms
import numpy as np
import pytest

from drake_disasm.logs import read_log, read_logs
from sysid.effect_selection.close_loop import ClosedLoop, close_loop
from sysid.models.from_logs import ModelChoice, model_of
from sysid.validation.null_logs import autoregressive
from tests.sysid.real_data import (
    real_folder,
    write_arm,
    write_emps,
    write_motion,
    write_slide,
    write_static,
)

pytestmark = pytest.mark.usefixtures("real_arm")

_NULLS = 40


@pytest.fixture(scope="module")
def real_arm() -> None:
    """Skips the tests where the recordings are not there."""
    real_folder("kuka_lwr4")


def _closed(folders, train, test) -> ClosedLoop:
    model = model_of(read_logs(folders), ModelChoice())
    return close_loop(model, train=train, test=test)


def test_a_real_force_sensor_drifts_and_stops(tmp_path):
    found = _closed([write_static(100, tmp_path / "log")], [0], [])
    assert "SensorDrift" in found.verdict.names
    values = {value.name: value for value in found.verdict.values}
    assert values["SensorDrift.fz"].interval[1] < 0.0
    assert 45.0 < values["SensorDrift.duration"].value < 65.0
    before, after = (
        found.errors.rms_by_unit(p) for p in (found.errors.before, found.errors.after)
    )
    assert before["N"] > 0.29 and after["N"] < 0.064 and after["N m"] < 0.00087


@pytest.mark.slow
def test_a_real_arm_has_friction_and_offsets(tmp_path):
    arm = write_arm(tmp_path / "arm.urdf")
    folders = [write_motion(n, tmp_path / f"run_{n}", arm) for n in (1, 2)]
    found = _closed(folders, [0], [1])
    kinds = {name.partition(".")[0] for name in found.verdict.names}
    assert {"JointDahlFriction", "TorqueOffset"} <= kinds  # dry, with its pre-sliding
    assert found.errors.relative(found.errors.before) > 0.06
    assert found.errors.relative(found.errors.after) < 0.0216
    columns = read_log(folders[0]).episodes[0].columns
    for value in found.verdict.values:
        if value.name.startswith("TorqueRipple") and value.name.endswith("periods"):
            joint = value.name.removeprefix("TorqueRipple.lwr_")[0]
            assert value.value * np.ptp(columns[f"q.{joint}"]) > 2.0 * np.pi


@pytest.mark.slow
def test_a_real_drives_motion_was_recorded_late(tmp_path):
    slide = write_slide(tmp_path / "emps.urdf")
    folders = [write_emps(n, tmp_path / f"record_{n}", slide) for n in (1, 2)]
    found = _closed(folders, [0], [1])
    values = {value.name: value for value in found.verdict.values}
    delay = values["ArmDelay.delay"]
    assert -0.0011 < delay.value < -0.0007 and delay.excludes_null
    assert found.errors.relative(found.errors.before) > 0.6
    assert found.errors.relative(found.errors.after) < 0.031


@pytest.mark.slow
def test_three_seconds_of_slow_noise_name_no_effect(tmp_path):
    model = null_alarms.arm(tmp_path)
    noise = null_alarms.noise_of("sieve+white", model)
    answers = [null_alarms.answer(model, noise, seed) for seed in range(_NULLS)]
    assert sum(bool(found["names"]) for found in answers) <= 0.1 * _NULLS


@pytest.mark.slow
def test_what_a_real_arms_motion_hides_beside_friction_is_named_or_in_a_tie(tmp_path):
    model = arm_verdicts.arm(tmp_path)
    real = arm_verdicts.with_friction(model, null_alarms.fitted(model))
    found = arm_verdicts.answer(model, real, autoregressive(0.9), 1.0, 12)
    assert found["kinds"][0] in arm_verdicts.said(found)

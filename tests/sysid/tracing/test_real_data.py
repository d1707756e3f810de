"""What real measurements lack, from the models that their authors used."""

import numpy as np
import pytest

from drake_disasm.errors import DisasmError
from sysid.logs import read_logs
from sysid.models.from_logs import ModelChoice, model_of
from sysid.tracing.pipeline import Closed, close_loop
from sysid.workers import Workers
from tests.sysid.real_data import write_arm, write_motion, write_static


def _closed(folders, train, test) -> Closed:
    model = model_of(read_logs(folders), ModelChoice())
    return close_loop(model, train, test, np.inf, Workers(), lambda _: None)


def test_a_real_force_sensor_drifts_and_stops(tmp_path):
    found = _closed([write_static(100, tmp_path / "log")], [0], [])
    assert found.verdict.names == ("SensorDrift",)
    values = {value.name: value for value in found.verdict.values}
    assert values["SensorDrift.fz"].interval[1] < 0.0
    assert 45.0 < values["SensorDrift.duration"].value < 65.0
    before, after = (
        found.errors.rms_by_unit(p) for p in (found.errors.before, found.errors.after)
    )
    assert before["N"] > 0.29 and after["N"] < 0.1 and after["N m"] < before["N m"]


@pytest.mark.slow
def test_a_real_arm_has_friction_and_offsets(tmp_path):
    arm = write_arm(tmp_path / "arm.urdf")
    folders = [write_motion(n, tmp_path / f"run_{n}", arm) for n in (1, 2)]
    found = _closed(folders, [0], [1])
    kinds = {name.partition(".")[0] for name in found.verdict.names}
    assert kinds == {"JointCoulombFriction", "TorqueOffset"}
    assert found.errors.relative(found.errors.before) > 0.06
    assert found.errors.relative(found.errors.after) < 0.03


@pytest.mark.slow
def test_too_little_of_a_real_arms_motion_is_refused(tmp_path):
    arm = write_arm(tmp_path / "arm.urdf")
    log = write_motion(1, tmp_path / "run", arm)
    model = model_of(read_logs([log]), ModelChoice())
    short = model.of_rows(np.arange(model.measurements.rows) < 500)
    with pytest.raises(DisasmError, match="too short to decide"):
        close_loop(short, [0], [], np.inf, Workers(), lambda _: None)

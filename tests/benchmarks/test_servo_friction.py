"""A real servo: its runs as logs, and a friction that shows in them."""

import math

import numpy as np
import pytest
from servo_friction import written_logs

from drake_disasm.effects import JointLoadFriction, RotorInertia
from drake_disasm.scenario import Scenario
from sysid.models.response.model import JointResponseModel
from tests.sysid.real_data import DATA as SHARED

DATA = SHARED / "servo_pendulum"


@pytest.mark.skipif(not DATA.exists(), reason=f"{DATA} is not here")
def test_friction_by_load_predicts_a_run_that_nothing_was_fitted_to(tmp_path) -> None:
    log = written_logs(DATA, tmp_path)["up_and_down_kp200"]
    errors = []
    drive = np.array([0.1243, 0.0232, 0.0069])  # fitted to other motions
    friction = [JointLoadFriction("servo", 0.64, 0.001), RotorInertia("servo", 0.001)]
    for effects in ([], friction):
        scenario = Scenario(effects=effects)
        model = JointResponseModel([log], scenario=scenario, segment=math.inf)
        error = model.predictions(drive) - model.measurements.values
        errors.append(np.mean(np.abs(error)))
    assert errors[1] < 0.5 * errors[0]

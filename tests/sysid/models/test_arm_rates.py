"""Rates of the arm at the begin of a step, against a simulated arm."""

import numpy as np
import pytest

from drake_disasm.cell.grip import AXIS_ORDER
from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.common.spatial import velocity_shift
from drake_disasm.scenario import load_scenario
from drake_disasm.stations.arm_node import ArmStep
from sysid.models.arm_rates import ArmRates

_STEPS, _FINE = 20, 100
_ACROSS = np.array([3e-3] * 3 + [1e-2] * 3)  # of the commands, m and rad


def _moved(control: str) -> tuple[ArmRates, dict[str, np.ndarray]]:
    """Returns the estimate, and what an arm did: n + 1 coordinates, rates, wrenches."""
    scenario = load_scenario("removal", [f"arm.control={control}"])
    twin, period = twin_of(scenario), scenario.task.period
    fine = ArmStep.of(twin.arm, twin.grip, period / _FINE)
    random = np.random.default_rng(0)
    qd = np.cumsum(_ACROSS * random.uniform(-1, 1, (_STEPS + 1, 6)), axis=0)
    wrench = random.uniform(-1, 1, (_STEPS + 1, 6)) * ([2.0] * 3 + [0.2] * 3)
    force = (wrench @ velocity_shift(twin.p_BoTo_B))[:, list(AXIS_ORDER)]
    x = np.concatenate([qd[0], np.zeros(6)])
    states = [x]
    for k in range(_STEPS):
        rate = (qd[k + 1] - qd[k]) / period
        for i in range(_FINE):
            at = [(i + j) / _FINE for j in (0.5, 1.0)]
            push, command = (
                (1 - at[j]) * a[k] + at[j] * a[k + 1] for j, a in enumerate((force, qd))
            )
            x = fine.ahead(x, np.concatenate([command, rate])) + fine.G @ push
        states.append(x)
    q, v = np.split(np.array(states), 2, axis=1)
    return ArmRates.of(scenario), {"q": q, "v": v, "qd": qd, "wrench": wrench}


@pytest.mark.parametrize("control", ["cartesian_impedance", "joint_impedance"])
def test_an_arm_that_lags_is_followed(control):
    """Whatever it began with, a few steps later to a twentieth of the mean's error."""
    rates, arm = _moved(control)
    v = np.full((1, 6), 0.05)
    errors = []
    for k in range(1, _STEPS + 1):
        last = np.s_[None, k - 1 : k + 1]
        v = rates.after(v, arm["q"][last], arm["qd"][last], arm["wrench"][last])
        mean = (arm["q"][k] - arm["q"][k - 1]) / rates.step.h
        errors.append([v[0] - arm["v"][k], mean - arm["v"][k]])
    found, by_mean = np.sqrt(np.mean(np.array(errors)[8:] ** 2, axis=(0)))
    assert np.all(found < 0.05 * by_mean)


def test_an_arm_under_position_control_has_the_mean_rate():
    rates, arm = _moved("position")
    last = np.s_[None, 3:5]
    found = rates.after(
        np.zeros((1, 6)), arm["q"][last], arm["qd"][last], arm["wrench"][last]
    )
    np.testing.assert_array_equal(found[0], (arm["q"][4] - arm["q"][3]) / 0.1)

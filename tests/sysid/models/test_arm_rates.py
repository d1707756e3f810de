"""Rates of the arm at the begin of a step, against a simulated arm."""

import numpy as np
import pytest

from drake_disasm.cell.grip import AXIS_ORDER
from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.common.spatial import velocity_shift
from drake_disasm.scenario import load_scenario
from drake_disasm.twin.arm_step import ArmStep
from sysid.models.arm_rates import ArmRates

_STEPS, _FINE = 20, 100
_ACROSS = np.array([3e-3] * 3 + [1e-2] * 3)  # of the commands, m and rad


def _moved(control: str, load: float = 1.0) -> tuple[ArmRates, dict[str, np.ndarray]]:
    """Returns the estimate, and what an arm did: n + 1 coordinates, rates, wrenches."""
    scenario = load_scenario("removal", [f"arm.control={control}"])
    twin, period = twin_of(scenario), scenario.task.period
    fine = ArmStep.of(twin.arm, twin.grip, period / _FINE)
    random = np.random.default_rng(0)
    qd = np.cumsum(_ACROSS * random.uniform(-1, 1, (_STEPS + 1, 6)), axis=0)
    wrench = random.uniform(-1, 1, (_STEPS + 1, 6)) * ([2.0] * 3 + [0.2] * 3) * load
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


def _errors(rates: ArmRates, arm: dict[str, np.ndarray]) -> np.ndarray:
    """Returns rms errors (2, 6) of the estimate and of the mean, after eight steps."""
    found = rates.along(arm["q"], arm["qd"], arm["wrench"])[1:]
    mean = (np.diff(arm["q"], axis=0) / rates.step.h)[:-1]
    errors = np.array([found, mean]) - arm["v"][1:-1]
    return np.sqrt(np.mean(errors[:, 8:] ** 2, axis=1))


@pytest.mark.parametrize("control", ["cartesian_impedance", "joint_impedance"])
def test_an_arm_that_lags_is_followed(control):
    found, by_mean = _errors(*_moved(control))
    assert np.all(found < 0.05 * by_mean)


def test_a_stiff_arm_whose_command_turns_back_is_followed():
    found, by_mean = _errors(*_moved("position", load=0.0))
    assert np.all(found < 0.05 * by_mean)


def test_an_episode_begins_at_rest():
    rates, arm = _moved("position")
    assert not rates.along(arm["q"], arm["qd"], arm["wrench"])[0].any()


def test_when_a_force_came_in_a_step_does_not_matter_to_a_stiff_arm():
    """An even growth would: the arm gives way to it until the step ends."""
    for control, matters in (("position", False), ("joint_impedance", True)):
        rates, arm = _moved(control)
        other = arm["wrench"].copy()
        other[1] += 5.0
        rate, of_other = (
            rates.along(arm["q"], arm["qd"], wrench)[1]
            for wrench in (arm["wrench"], other)
        )
        assert np.any(rate != of_other) == matters


def test_an_episode_is_its_steps_one_after_the_other():
    rates, arm = _moved("joint_impedance")
    v = np.zeros((1, 6))
    along = rates.along(arm["q"], arm["qd"], arm["wrench"])
    for k in range(1, _STEPS):
        last = np.s_[None, k - 1 : k + 1]
        v = rates.after(v, arm["q"][last], arm["qd"][last], arm["wrench"][last])
        np.testing.assert_allclose(along[k], v[0], rtol=1e-9, atol=1e-12)

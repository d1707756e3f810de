"""Controls, faults and forces on the hardware station, against a fake cell."""

import math

import numpy as np
import pytest
from fault_runs import ALL, in_lockstep, run_fault
from force_runs import PUSHES, run_push

from drake_disasm.mdp import Outcome
from drake_disasm.policies import make_policy
from drake_disasm.safety import Mode
from drake_disasm.scenario import CONTROLS, load_scenario
from drake_disasm.stations.hardware import HardwareStation, HoldError
from drake_disasm.stations.hardware_config import HardwareConfig
from drake_disasm.task.simulation import TaskSimulation
from tests.drake_disasm.conftest import QUIET
from tests.refusals import refused

_STEPS = 25


def _end(simulation: TaskSimulation) -> np.ndarray:
    """Returns the measured pose (6,) [m, rad] after some steps of an episode."""
    simulation.reset(0)
    for _ in range(_STEPS):
        result = simulation.step()
        assert result.outcome is Outcome.RUNNING
    return np.asarray(result.observation[:6])


@pytest.mark.slow
@pytest.mark.parametrize("control", CONTROLS)
def test_an_arm_goes_as_in_simulation(control: str) -> None:
    scenario = load_scenario("removal", [QUIET, f"arm.control={control}"])
    policy = make_policy("admittance")
    simulated = _end(TaskSimulation(scenario, "cell", policy))
    with in_lockstep(scenario, policy) as (simulation, station, _):
        difference = np.abs(_end(simulation) - simulated)
        assert station.supervisor.mode is Mode.ACTIVE
        assert station.supervisor.clamped == 0
    assert simulated[0] > 0.01
    assert difference.max() < 1e-3, difference  # m, rad; a control period later


def test_an_arm_that_yields_may_lag_but_not_stand_still() -> None:
    """Brakes that stay shut: a hold, once the spring could push with all it may."""
    scenario = load_scenario("removal", ["arm.control=cartesian_impedance"])
    with in_lockstep(scenario, make_policy("straight")) as parts:
        simulation, station, cell = parts
        simulation.reset(0)
        braked = cell.position_measured()
        cell.position_measured = lambda: braked  # type: ignore[method-assign]
        with pytest.raises(HoldError, match=r"are allowed; it does not follow") as hold:
            for _ in range(60):
                simulation.step()
        lead = np.abs(cell.commanded - braked)
        assert (lead <= station.allowed_lead + 1e-3).all()
        assert lead.max() > station.config.safety.max_lead, str(hold.value)


@pytest.mark.slow
def test_a_hold_lets_an_arm_that_yields_relax() -> None:
    """Held where it was measured, its spring no longer presses."""
    stiff, soft = (
        run_push("across the groove (+z)", "hold", control)
        for control in ("position", "cartesian_impedance")
    )
    assert "on the gripper, 20 are allowed" in soft.reason
    assert soft.greatest < 1.1 * soft.at_hold
    assert soft.late < 0.5 * stiff.late


def test_a_cabinet_in_another_control_is_refused_when_it_is_built() -> None:
    scenario = load_scenario("removal", ["arm.control=cartesian_impedance"])
    with refused("iiwa.control", "'position'", "'cartesian_impedance'"):
        HardwareStation(scenario, HardwareConfig())


#: What each does: the words of the hold, and within what time [s] of virtual time.
HARMLESS = {("iiwa", "reorder"), ("ft_sensor", "reorder")}
QUICK = [("iiwa", "jump"), ("iiwa", "reorder"), ("ft_sensor", "loss")]
QUICK += [("gripper", "silent")]
SLOW = [which for which in ALL if which not in QUICK]
WORDS = {
    "nan": ["not finite"],
    "jump": ("jumped by 0.300 rad", "N on the gripper"),
    "status": ("HEX status", "overcurrent"),
    "short": ("not an lcmt_iiwa_status", "stopped sending"),
    "header": ("not an lcmt_iiwa_status", "stopped sending"),
}


@pytest.mark.parametrize(
    ("device", "fault"),
    [*QUICK, *(pytest.param(*which, marks=pytest.mark.slow) for which in SLOW)],
)
def test_a_fault(device: str, fault: str) -> None:
    """Of any device: a hold in time with its reason, or nothing at all."""
    run = run_fault(device, fault)
    if (device, fault) in HARMLESS:
        assert run.mode is Mode.ACTIVE and math.isnan(run.until_hold)
        assert "reordered" in run.counters
        return
    assert run.mode is Mode.HOLD
    assert any(word in run.reason for word in WORDS.get(fault, ["stopped sending"]))
    assert run.until_hold <= (0.6 if device == "gripper" else 0.08)
    assert run.moved < 2e-3  # on the way to where it is held


def test_the_arm_backs_away_from_what_presses() -> None:
    run = run_push("across the groove (+z)", "yield")
    assert "on the gripper, 20 are allowed; backed away 0." in run.reason
    assert run.at_hold > 19.0 > 10.0 > run.soon
    assert run.greatest < 1.2 * run.at_hold


@pytest.mark.slow
@pytest.mark.parametrize("push", PUSHES)
def test_a_hold_leaves_less_than_the_limit(push: str) -> None:
    run = run_push(push, "hold")
    assert "on the gripper, 20 are allowed" in run.reason
    assert "backed away" not in run.reason
    assert run.late < 20.0

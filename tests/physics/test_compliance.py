"""Cell and twin yield at the bolt as `twin_of` states; a bolt may slip."""

import numpy as np
import pytest
from compliance import Push, stated, stiffness

from drake_disasm.scenario import load_scenario
from drake_disasm.stations import make_station
from tests.drake_disasm.conftest import QUIET
from tests.refusals import refusal

ORIGIN = np.zeros(3)


@pytest.mark.parametrize("name", ["twin", "cell"])
def test_the_bolt_yields_as_stated(name: str) -> None:
    """Within 2 %; about z the cell's pads hold by friction alone, and creep."""
    scenario = load_scenario("removal", [QUIET])
    found = stiffness(make_station(name, scenario), ORIGIN, 0.8)
    sure = slice(0, 5) if name == "cell" else slice(0, 6)
    np.testing.assert_allclose(found[1:, sure], stated(scenario)[1:, sure], rtol=0.02)


def test_a_bolt_slips_that_is_pulled_harder_than_it_is_held() -> None:
    """Held by 12 N a pad and friction of 0.8: 10 N of pull are held, 25 N are not."""
    overrides = [QUIET, "gripper.grip_force=12", "gripper.compliance=rigid"]
    station = make_station("cell", load_scenario("removal", overrides))
    ways = []
    for pull in (10.0, 25.0):
        push = Push(station, np.array([0.0, 0.03, 0.0]))
        load = np.array([pull, 0, 0, 0, 0, 0])
        early, late = (push.advance(load, time).grip[0] for time in (0.04, 0.06))
        ways.append(late - early)
    assert 0.0 < ways[0] < 2e-4
    assert ways[1] > 10.0 * ways[0]


def test_a_step_that_is_too_long_for_a_stiff_grip_is_refused() -> None:
    overrides = ["gripper.compliance=rigid", "arm.control=cartesian_impedance"]
    step = "simulation.twin_time_step=0.02"
    scenario = load_scenario("removal", [*overrides, step])
    assert "twin_time_step" in refusal(make_station, "twin", scenario)

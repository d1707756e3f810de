"""Many steps of the twin with IMPACT at once, against the diagram."""

import numpy as np
import pytest

from drake_disasm.scenario import Scenario, load_scenario, with_values
from drake_disasm.stations import TwinStation
from drake_disasm.task.diagram_replay import TwinReplay
from drake_disasm.twin.replay import ImpactReplay
from drake_disasm.twin.steps import Steps

QUIET = ["contact.model=impact", "ft_sensor.noise=[0, 0, 0, 0, 0, 0]"]
TURNED = load_scenario("removal_turned", QUIET)
STIFF = load_scenario("removal_turned", [*QUIET, "gripper.compliance=rigid"])
SENSING = load_scenario(
    "removal_turned",
    [
        *QUIET,
        "effects=[!SensorBias {fx: 0.5, tz: 0.02}, "
        "!PayloadError {mass: 0.2, cx: 0.01}]",
        "observation.variant=small_angle",
    ],
)
COUNT = 24


def steps(scenario: Scenario) -> Steps:
    """Returns steps along the turned groove, most of them in contact.

    The bolt is in the groove; the arm is where the grip gives to reach there.
    """
    random = np.random.default_rng(0)
    x = random.uniform(0.0, 0.058, COUNT)
    q_bolt = np.zeros((COUNT, 6))
    q_bolt[:, 0], q_bolt[:, 2] = x, -0.035 * x + random.uniform(-2e-4, 2e-4, COUNT)
    q_bolt[:, 4] = random.uniform(0.0, 0.035, COUNT)
    wrench = random.uniform(-1, 1, (COUNT, 6)) * [1, 1, 1, 0.02, 0.02, 0.02]
    station = TwinStation(scenario)
    q = q_bolt - np.array([station.deflection(w) for w in wrench])
    away = random.uniform(-1, 1, (COUNT, 6)) * [1e-4, 1e-4, 3e-4, 1e-3, 1e-3, 1e-3]
    rate = random.uniform(-1, 1, (COUNT, 6)) * [2e-2, 3e-3, 3e-3, 1e-2, 2e-2, 1e-2]
    rest = np.zeros((COUNT, 6))
    return Steps(np.arange(COUNT), q, rest, q + away, rate, wrench, 0.1 * rate)


@pytest.mark.parametrize(
    ("scenario", "pushes"),
    [(TURNED, 0.8), (SENSING, 0.8), (STIFF, 3.0)],
    ids=["turned", "sensing", "stiff"],
)
def test_it_says_what_the_diagram_says(scenario, pushes):
    """To some 10 nm, thousandths of a newton and hundredths of a N mm."""
    expected = TwinReplay(scenario).transitions(steps(scenario))
    [found] = ImpactReplay([scenario]).transitions([steps(scenario)])
    assert np.abs(expected[:, 8]).max() > pushes
    np.testing.assert_allclose(found[:, :3], expected[:, :3], atol=6e-8)
    np.testing.assert_allclose(found[:, 3:6], expected[:, 3:6], atol=1e-6)
    np.testing.assert_allclose(found[:, 6:9], expected[:, 6:9], atol=2e-3)
    np.testing.assert_allclose(found[:, 9:], expected[:, 9:], atol=5e-5)


def test_the_sensor_is_zeroed_under_the_force_at_the_start():
    """To hundredths of a newton: in contact the bolt still creeps when it is zeroed."""
    effect = "!GroovePose {x: 0.001, z: 5.0e-4}"
    scenario = load_scenario("removal", [*QUIET, f"effects=[{effect}]"])
    expected = TwinReplay(scenario).reading_at_zeroing
    [found] = ImpactReplay([scenario]).reading_at_zeroing
    [away] = ImpactReplay([TURNED]).reading_at_zeroing
    assert np.abs(expected - away)[:3].max() > 0.1
    np.testing.assert_allclose(found[:3], expected[:3], atol=1e-2)
    np.testing.assert_allclose(found[3:], expected[3:], atol=5e-4)


def test_what_a_scenario_gives_does_not_depend_on_the_others():
    """Whatever they differ in, and from how many states each begins."""
    values = [
        {},
        {"contact.impact.stiffness": 50.0, "contact.impact.depth": 0.3},
        {"gripper.stiffness.2": 900.0, "part.clearance": 0.0005},
        {"effects.0.ry": 0.01, "part.neck_diameter": 0.0051},
    ]
    scenarios = [with_values(TURNED, each) for each in values]
    given = [steps(TURNED).select(np.arange(COUNT) < n) for n in (24, 7, 1, 12)]
    together = ImpactReplay(scenarios)
    found = together.transitions(given)
    for i, scenario in enumerate(scenarios):
        alone = ImpactReplay([scenario])
        [expected] = alone.transitions([given[i]])
        np.testing.assert_allclose(found[i], expected, rtol=1e-9, atol=1e-11)
        zeros = together.reading_at_zeroing[i], alone.reading_at_zeroing[0]
        np.testing.assert_allclose(*zeros, rtol=1e-9, atol=1e-11)


def test_a_state_without_balance_is_nan_and_the_others_are_found():
    broken = steps(TURNED)
    broken.qd[3, 0] = np.nan
    [found] = ImpactReplay([TURNED]).transitions([broken])
    [expected] = ImpactReplay([TURNED]).transitions([steps(TURNED)])
    assert np.isnan(found[3]).all()
    others = np.arange(COUNT) != 3
    np.testing.assert_allclose(found[others], expected[others], rtol=1e-9, atol=1e-11)

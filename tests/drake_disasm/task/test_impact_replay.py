"""Many steps of the twin with IMPACT at once, against the diagram."""

import numpy as np
import pytest

from drake_disasm.scenario import load_scenario, with_values
from drake_disasm.task.impact_replay import ImpactReplay
from drake_disasm.task.replay import Steps, TwinReplay

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


def steps() -> Steps:
    """Returns steps along the turned groove, most of them in contact."""
    random = np.random.default_rng(0)
    x = random.uniform(0.0, 0.058, COUNT)
    q = np.zeros((COUNT, 6))
    q[:, 0], q[:, 2] = x, -0.035 * x + random.uniform(-2e-4, 2e-4, COUNT)
    q[:, 4] = random.uniform(0.0, 0.035, COUNT)
    away = random.uniform(-1, 1, (COUNT, 6)) * [1e-4, 1e-4, 3e-4, 1e-3, 1e-3, 1e-3]
    rate = random.uniform(-1, 1, (COUNT, 6)) * [2e-2, 3e-3, 3e-3, 1e-2, 2e-2, 1e-2]
    f = np.column_stack([random.uniform(-1, 1, (COUNT, 3)), np.zeros((COUNT, 3))])
    return Steps(np.arange(COUNT), q, np.zeros((COUNT, 6)), q + away, rate, f)


@pytest.mark.parametrize(
    ("scenario", "pushes"),
    [(TURNED, 0.8), (SENSING, 0.8), (STIFF, 3.0)],
    ids=["turned", "sensing", "stiff"],
)
def test_it_says_what_the_diagram_says(scenario, pushes):
    """To nanometres, thousandths of a newton and hundredths of a N mm."""
    expected = TwinReplay(scenario).transitions(steps())
    found = ImpactReplay(scenario).transitions(steps())
    assert np.abs(expected[:, 8]).max() > pushes
    np.testing.assert_allclose(found[:, :3], expected[:, :3], atol=3e-9)
    np.testing.assert_allclose(found[:, 3:6], expected[:, 3:6], atol=1e-6)
    np.testing.assert_allclose(found[:, 6:9], expected[:, 6:9], atol=2e-3)
    np.testing.assert_allclose(found[:, 9:], expected[:, 9:], atol=1e-5)


def test_becoming_another_scenario_is_building_it_anew_bit_for_bit():
    other = with_values(
        TURNED,
        {
            "contact.impact.stiffness": 50.0,
            "contact.impact.depth": 0.3,
            "lock.clearance": 0.0005,
            "gripper.stiffness.2": 900.0,
            "effects.0.ry": 0.01,
        },
    )
    replay = ImpactReplay(TURNED)
    before = replay.transitions(steps())
    for scenario in (other, with_values(TURNED, {"lock.neck_diameter": 0.0051})):
        replay.reconfigure(scenario)
        expected = ImpactReplay(scenario).transitions(steps())
        assert replay.transitions(steps()).tobytes() == expected.tobytes()
    replay.reconfigure(TURNED)
    assert replay.transitions(steps()).tobytes() == before.tobytes()

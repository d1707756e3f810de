"""The twin driven open loop, and turned into other scenarios in place."""

import numpy as np
import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.scenario import load_scenario, with_values
from drake_disasm.stations import TwinStation
from drake_disasm.task.diagram_replay import TwinReplay
from drake_disasm.task.simulation import TaskSimulation

TURNED = load_scenario(
    "removal_turned",
    ["ft_sensor.noise=[0, 0, 0, 0, 0, 0]", "task.max_translation=0.003"],
)
OTHER = with_values(TURNED, {
    "part.clearance": 0.0006, "part.travel": 0.05, "contact.friction": 0.35,
    "contact.modulus": 1e9, "contact.dissipation": 5.0, "effects.0.ry": 0.02,
    "gripper.stiffness.1": 800.0, "gripper.damping_ratio": 0.8, "arm.stiffness.3": 6e3,
})  # fmt: skip
THICK = with_values(TURNED, {"part.neck_diameter": 0.0051})  # another plant
IMPACT = load_scenario(
    "removal_turned", ["contact.model=impact", "ft_sensor.noise=[0, 0, 0, 0, 0, 0]"]
)
OTHER_IMPACT = with_values(IMPACT, {
    "contact.impact.stiffness": 50.0, "contact.impact.exponent": 1.3,
    "contact.friction": 0.1, "part.clearance": 0.0005, "gripper.stiffness.2": 900.0,
    "effects.0.ry": 0.01,
})  # fmt: skip
ACTIONS = np.random.default_rng(0).uniform(-1, 1, (6, 6)) * [
    2e-3, 3e-4, 3e-4, 0, 2e-3, 0
]  # fmt: skip

NONE = np.zeros(6)


def replayed(replay: TwinReplay) -> np.ndarray:
    """Returns the states of a walk along the groove in contact."""
    start = np.array([0.02, 0, 2e-4, 0, 0, 0])
    replay.start(0, start, NONE, start, NONE)
    return np.array([replay.advance(rate / 0.1) for rate in ACTIONS])


def test_it_is_the_task_simulation_open_loop():
    simulation = TaskSimulation(TURNED, "twin")
    first = simulation.reset(0)
    replay = TwinReplay(TURNED)
    actions = ACTIONS * [1, 1, 1, 0, 0, 0]
    expected = np.array([simulation.step(a).observation for a in actions])
    replay.start(0, NONE, NONE, NONE, NONE)
    found = np.array([replay.advance(a / 0.1) for a in actions])
    np.testing.assert_allclose(found, expected, atol=2e-3)  # the sensor rounds
    assert first.shape == found[0].shape


@pytest.mark.parametrize(
    ("first", "second"), [(TURNED, OTHER), (IMPACT, OTHER_IMPACT), (TURNED, THICK)]
)
def test_becoming_another_scenario_is_building_it_anew_bit_for_bit(first, second):
    replay = TwinReplay(first)
    before = replayed(replay)
    replay.reconfigure(second)
    assert replayed(replay).tobytes() == replayed(TwinReplay(second)).tobytes()
    replay.reconfigure(first)
    assert replayed(replay).tobytes() == before.tobytes()


def test_a_station_refuses_in_place_what_needs_another_plant():
    station = TwinStation(TURNED)
    assert station.can_reconfigure(OTHER) and not station.can_reconfigure(THICK)
    context = station.CreateDefaultContext()
    with pytest.raises(DisasmError, match="in place"):
        station.reconfigure(context, THICK)
    with pytest.raises(DisasmError, match=r"contact\.friction"):
        station.reconfigure(context, with_values(TURNED, {"contact.friction": 7.0}))

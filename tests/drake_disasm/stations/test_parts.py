"""Parts in stations: what effects reshape, and a spring that acts in each step."""

import numpy as np
import pytest

from drake_disasm.effects import DetentTorque, GrooveClearance
from drake_disasm.mdp import Outcome
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import TwinStation
from drake_disasm.task.episode import run_episode
from drake_disasm.task.simulation import TaskSimulation
from tests.drake_disasm.conftest import QUIET


@pytest.fixture(scope="module")
def bayonet() -> TaskSimulation:
    """A bayonet's twin without noise."""
    return TaskSimulation(load_scenario("iiwa_bayonet", [QUIET]), "twin")


def test_a_reshaped_body_does_not_meet_itself(bayonet: TaskSimulation) -> None:
    """Its solids overlap each other; between fixed bodies no contact can be solved."""
    station: TwinStation = bayonet.station
    context = station.settled([GrooveClearance(change=1e-4)])
    pose = station.GetOutputPort("bolt_pose_in_groove").Eval(context)
    np.testing.assert_allclose(pose.translation(), 0.0, atol=1e-5)


def test_the_detents_torque_follows_its_effect(bayonet: TaskSimulation) -> None:
    """Turned by 0.1 rad at its middle: e^0.5 times as much torque."""
    torques = []
    for effects in ([], [DetentTorque(log_factor=0.5)]):
        bayonet.reset(0, effects)
        for _ in range(10):
            result = bayonet.step(np.array([0, 0, 0, 0, 0.01, 0]))
        X_GB = bayonet.evaluate(bayonet.station, "bolt_pose_in_groove")
        angle = np.arctan2(
            -X_GB.rotation().matrix()[2, 0], X_GB.rotation().matrix()[0, 0]
        )
        share = np.sin(np.pi * angle / bayonet.scenario.part.detent_width)
        torques.append(result.observation[10] / share)
    assert torques[1] / torques[0] == pytest.approx(np.exp(0.5), rel=0.02)


@pytest.mark.parametrize(
    "station", ["twin", pytest.param("cell", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("scenario", ["iiwa_peg", "iiwa_bayonet"])
def test_admittance_takes_it_out(scenario: str, station: str) -> None:
    loaded = load_scenario(scenario)
    policy = make_policy("admittance", loaded)
    summary = run_episode(TaskSimulation(loaded, station, policy), 3)
    assert summary.outcome is Outcome.SUCCESS and summary.bolt_is_out
    assert summary.max_force < 0.6 * loaded.task.reward.f_max

"""What the two scripted policies do on turned grooves."""

import numpy as np
import pytest

from drake_disasm.effects import GroovePose
from drake_disasm.mdp import Outcome
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.episode import EpisodeSummary, run_episode
from drake_disasm.task.simulation import TaskSimulation

ANGLES_DEG = (0.0, 2.0, -2.0, 4.0, -4.0)
F_MAX = 20.0  # N


def _episodes(
    model: str, policy: str, angle_deg: float, seeds: range, name: str = "removal"
) -> list[EpisodeSummary]:
    scenario = load_scenario(name)
    scenario.effects = [GroovePose(ry=np.deg2rad(angle_deg))]
    simulation = TaskSimulation(scenario, model, make_policy(policy, scenario))
    return [run_episode(simulation, seed) for seed in seeds]


def _assert_jammed(summaries: list[EpisodeSummary], travel: float) -> None:
    for summary in summaries:
        assert summary.outcome is Outcome.FORCE_LIMIT
        assert summary.travel < travel
        assert not summary.bolt_is_out


def _slow(*values: object) -> object:
    return pytest.param(*values, marks=pytest.mark.slow)


@pytest.mark.parametrize(("model", "angle_deg"), [
    ("cell", 4.0), _slow("cell", 0.0), ("twin", -4.0), _slow("twin", 0.0),
    _slow("twin", 2.0), _slow("twin", 4.0),
])  # fmt: skip
def test_admittance_removes_the_bolt(model: str, angle_deg: float) -> None:
    for summary in _episodes(model, "admittance", angle_deg, range(1)):
        assert summary.outcome is Outcome.SUCCESS
        assert summary.bolt_is_out
        assert summary.max_force < F_MAX


@pytest.mark.parametrize(("model", "angle_deg"), [
    ("cell", -4.0), ("twin", 2.0), _slow("cell", 2.0), _slow("twin", -4.0),
])  # fmt: skip
def test_straight_jams_before_the_end(model: str, angle_deg: float) -> None:
    """On the stiff grip; one that yields lets the arm go on for long."""
    episodes = _episodes(model, "straight", angle_deg, range(1), "chapter4_stiff")
    _assert_jammed(episodes, 0.055)


@pytest.mark.slow
@pytest.mark.parametrize("angle_deg", ANGLES_DEG)
def test_ten_seeds_in_the_cell(angle_deg: float) -> None:
    removed = _episodes("cell", "admittance", angle_deg, range(10))
    assert all(s.outcome is Outcome.SUCCESS and s.max_force < F_MAX for s in removed)
    # Where the bolt is, is judged to half a millimetre while the arm moves: the head of
    # some is that much short of the height at which it counts as out.
    assert sum(s.bolt_is_out for s in removed) > 5
    straight = _episodes("cell", "straight", angle_deg, range(10), "chapter4_stiff")
    _assert_jammed(straight, 0.055 if angle_deg else 0.062)

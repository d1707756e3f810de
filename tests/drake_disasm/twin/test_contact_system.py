"""IMPACT in the twin's diagram, against statics."""

import numpy as np
import pytest
from pydrake.math import RotationMatrix
from pydrake.multibody.tree import BodyIndex

from drake_disasm.cell.twin_parameters import bolt_stiffness
from drake_disasm.parts import DoorChain
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.diagram_replay import TwinReplay
from drake_disasm.task.episode import run_episode
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm.twin.conditions import ImpactConditions, Surroundings
from drake_disasm.twin.contact_system import ImpactContact
from drake_disasm.twin.equations import normal_force
from drake_disasm.twin.law import ImpactLaw
from tests.drake_disasm.conftest import QUIET, STIFF

NOISELESS = ["contact.model=impact", QUIET]
ACROSS = np.array([0.0, 0.0, 0.6e-3, 0.0, 0.0, 0.0])  # 0.4 mm into the lip


def pressed(overrides):
    """Returns depths [mm] (2,) of the neck pressed across the slot at rest, and force.

    On the stiff grip; at the lips' upper and lower edge, for the bolt tilts. The force
    [N] as the sensor has it, and as arm and grip do, as springs.
    """
    scenario = load_scenario("removal", [*NOISELESS, STIFF, *overrides])
    replay, none = TwinReplay(scenario), np.zeros(6)
    start = np.array([0.02, 0, 0, 0, 0, 0])
    replay.start(0, start, none, start, none)
    replay.advance(ACROSS / 0.1)
    for _ in range(5):
        state = replay.advance(np.zeros(6))
    diagram = replay._diagram
    z = diagram.station.coordinates.pose(diagram.state().q_bolt).translation()[2]
    springs = bolt_stiffness(scenario)[2] * (ACROSS[2] - z)
    return 1e3 * (z - 0.2e-3), -state[8], springs


@pytest.mark.parametrize(("stiffness", "exponent"), [(1e3, 1.5), (50.0, 0.7)])
def test_the_neck_rests_where_law_and_spring_balance(stiffness, exponent):
    """Two circles touch: 2 k p^e = K (0.4 mm - p), and the sensor reads it."""
    text = f"{{stiffness: {stiffness}, exponent: {exponent}, damping: 1, depth: 0.1}}"
    depth, force, springs = pressed([f"contact.impact={text}", "contact.friction=0"])
    law = ImpactLaw(stiffness, exponent, 1.0, 0.1)
    assert force == pytest.approx(springs, rel=0.02)
    expected = 2 * normal_force(depth * 1e-3, 0.0, np.array(law.row))[0]
    assert force == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("time_step", [0.00125, 0.01])
def test_the_stiffest_corner_of_the_thesis_box_does_not_explode(time_step):
    text = "{stiffness: 1.0e+5, exponent: 1, damping: 1000, depth: 0.0}"
    depth, force, springs = pressed(
        [f"contact.impact={text}", f"simulation.twin_time_step={time_step}"]
    )
    assert force == pytest.approx(springs, rel=0.02) and abs(depth) < 0.01


def test_friction_is_coulombs():
    """Sliding along the lip under a steady push across: f_x = -mu f_z."""
    replay = TwinReplay(
        load_scenario("removal", [*NOISELESS, STIFF, "contact.friction=0.3"])
    )
    start = np.array([0.01, 0, 0, 0, 0, 0])
    replay.start(0, start, np.zeros(6), start, np.zeros(6))
    replay.advance(ACROSS / 0.1)
    for _ in range(8):
        state = replay.advance(np.array([0.02, 0, 0, 0, 0, 0]))
    assert state[6] == pytest.approx(0.3 * state[8], rel=0.02)


@pytest.mark.slow
def test_an_episode_ends_as_with_hydroelastic_contact():
    ends = []
    for model in ("impact", "hydroelastic"):
        scenario = load_scenario(
            "removal_turned", [QUIET, STIFF, f"contact.model={model}"]
        )
        simulation = TaskSimulation(scenario, "twin", make_policy("admittance"))
        ends.append(run_episode(simulation, 1))
    first, second = ends
    assert first.bolt_is_out and second.bolt_is_out
    assert first.reward == pytest.approx(second.reward, rel=0.03)
    assert first.mean_force == pytest.approx(second.mean_force, rel=0.2)


def test_a_step_without_a_balance_is_an_error():
    conditions = ImpactConditions(
        law=ImpactLaw(100.0, 1.5, 1.0, 0.1),
        gaps=DoorChain().gaps,
        around=Surroundings(np.zeros(1), np.eye(3)[None], *np.zeros((2, 1, 3))),
        M=np.eye(6),
        K=np.ones(6),
        D=np.ones(6),
        p_BoTo_B=np.zeros(3),
    )
    system = ImpactContact(BodyIndex(1), RotationMatrix(), 0.005, conditions)
    context = system.CreateDefaultContext()
    system.GetInputPort("state").FixValue(context, np.zeros(12))
    system.GetInputPort("desired_state").FixValue(context, np.full(12, np.inf))
    with pytest.raises(RuntimeError, match="no force balances"):
        system.get_output_port().Eval(context)

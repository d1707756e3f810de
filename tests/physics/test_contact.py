"""Contact between bolt and groove, against statics and against itself refined."""

import numpy as np
import pytest
from physics import QUIET, STIFF, action, episode, play, quiet, sliding

from drake_disasm.effects import GroovePose
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.simulation import TaskSimulation
from tests.physics.contacts import surfaces


@pytest.mark.parametrize("model", ["cell", "twin"])
def test_bolt_and_groove_touch_hydroelastically(model: str) -> None:
    """Rigid pairs would silently fall back to point contact (drake-traps 5)."""
    scenario = load_scenario("removal_turned", [QUIET])
    simulation = TaskSimulation(scenario, model, make_policy("straight"))
    simulation.reset(0)
    for _ in range(20):
        simulation.step()
    contacts = simulation.evaluate(simulation.station, "contact_results")
    lock = simulation.station.lock
    assert any(
        {surface.id_M(), surface.id_N()} & set(lock.groove_ids)
        and {surface.id_M(), surface.id_N()} & set(lock.bolt_ids.values())
        for surface in surfaces(contacts)
    )
    assert contacts.num_point_pair_contacts() == 0


@pytest.mark.parametrize(("mu", "offset"), [(0.1, 4e-4), (0.4, 1e-3)])
def test_sliding_force_is_mu_n(mu: float, offset: float) -> None:
    """Coulomb, within 5 %: the issue's figure (measured: within 0.5 %)."""
    normal, friction = sliding(mu, offset)
    assert normal > 2.0
    assert friction == pytest.approx(mu * normal, rel=0.05)


@pytest.mark.parametrize("clearance", [1e-4, 1e-3])
def test_play_is_the_clearance(clearance: float) -> None:
    """At 1 N and the shipped mesh, within 15 %."""
    found = play(1.0, f"part.clearance={clearance}")
    assert found == pytest.approx(clearance, rel=0.15)


def test_play_converges_with_the_mesh() -> None:
    """Even from 12 facets, since they are a multiple of four (`lock.facet_length`)."""
    finer = play(1.0, "contact.resolution=0.0004")
    for resolution, excess in ((0.0016, 0.025), (0.0008, 0.015)):
        found = play(1.0, f"contact.resolution={resolution}")
        assert found == pytest.approx(finer, rel=excess)


@pytest.mark.parametrize(
    ("model", "policy"),
    [
        ("twin", "admittance"),
        pytest.param("cell", "straight", marks=pytest.mark.slow),
        pytest.param("twin", "straight", marks=pytest.mark.slow),
        pytest.param("cell", "admittance", marks=pytest.mark.slow),
    ],
)
def test_half_the_time_step_gives_the_same(model: str, policy: str) -> None:
    """End pose within 2 % of the travel, peak force within 2 %."""
    step = getattr(load_scenario("removal").simulation, f"{model}_time_step")
    key = f"simulation.{model}_time_step"
    whole = episode(model, policy, f"{key}={step}")
    half = episode(model, policy, f"{key}={step / 2}")
    for axis in "xyz":
        assert abs(whole[axis] - half[axis]) < 0.02 * whole["travel"]
    assert whole["peak"] == pytest.approx(half["peak"], rel=0.02)


def test_groove_turned_the_other_way_mirrors_the_force() -> None:
    forces = []
    for sign in (1.0, -1.0):
        simulation = quiet("removal", STIFF)
        simulation.reset(0, [GroovePose(ry=sign * np.deg2rad(2.0))])
        for _ in range(25):
            result = simulation.step(action(x=1e-3))
        forces.append(result.observation[8])
    assert abs(forces[0]) > 3.0
    assert forces[0] == pytest.approx(-forces[1], rel=0.01)


@pytest.mark.slow
def test_twin_and_cell_jam_at_the_same_place() -> None:
    twin, cell = episode("twin", "straight"), episode("cell", "straight")
    assert twin["travel"] == pytest.approx(cell["travel"], rel=0.15)

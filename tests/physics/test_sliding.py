"""Sliding, in the cell and in a turned groove, against Coulomb and the contact."""

import itertools

import numpy as np
import pytest
from physics import QUIET, STIFF

from drake_disasm.common.spatial import rotation_from_vector
from drake_disasm.effects import GroovePose
from drake_disasm.scenario import load_scenario
from drake_disasm.task.simulation import TaskSimulation
from tests.physics.contacts import surfaces


def _press(model: str, offset: np.ndarray, ry: float) -> TaskSimulation:
    """Returns a simulation whose bolt has slid 20 mm, pressed by `offset` (3,) in G."""
    simulation = TaskSimulation(load_scenario("removal", [QUIET, STIFF]), model)
    simulation.reset(0, [GroovePose(ry=ry)])
    R_GnG = rotation_from_vector(np.array([0.0, ry, 0.0]))
    for move in [offset] + 20 * [np.array([1e-3, 0.0, 0.0])]:
        simulation.step(np.concatenate([R_GnG @ move, np.zeros(3)]))
    return simulation


def _groove_on_bolt(simulation: TaskSimulation) -> np.ndarray:
    """Returns the force (3,) in Gn that the contact results say."""
    station = simulation.station
    contacts = simulation.evaluate(station, "contact_results")
    groove, force = set(station.lock.groove_ids), np.zeros(3)
    for i, surface in enumerate(surfaces(contacts)):
        if {surface.id_M(), surface.id_N()} & groove:  # the force is on M's body
            info = contacts.hydroelastic_contact_info(i)
            sign = -1.0 if surface.id_M() in groove else 1.0
            force += sign * info.F_Ac_W().translational()
    return station.X_WG.rotation().matrix().T @ force


#: Neck on a lip, head under the lips, head on the floor; groove turned or not.
WALLS = {"lip": [0, 0, 6e-4], "lips": [0, 6e-4, 0], "floor": [0, -6e-4, 0]}
QUICK = [("twin", 0.0, "lip"), ("twin", -4.0, "lips"), ("twin", 2.0, "floor")]
QUICK += [("cell", 2.0, "lips")]
ALL = itertools.product(("cell", "twin"), (0.0, 2.0, -4.0), WALLS)
SLOW = [case for case in ALL if case not in QUICK]


@pytest.mark.parametrize(
    ("model", "ry_deg", "wall"),
    [*QUICK, *(pytest.param(*case, marks=pytest.mark.slow) for case in SLOW)],
)
def test_sliding_force_is_mu_n_anywhere(model: str, ry_deg: float, wall: str) -> None:
    ry = np.deg2rad(ry_deg)
    simulation = _press(model, np.array(WALLS[wall]), ry)
    R_GnG = rotation_from_vector(np.array([0.0, ry, 0.0]))
    force = R_GnG.inverse() @ simulation.observation()[6:9]
    assert np.hypot(force[1], force[2]) > 3.0
    assert -force[0] == pytest.approx(0.2 * np.hypot(force[1], force[2]), rel=0.05)


@pytest.mark.parametrize("model", ["cell", "twin"])
def test_processed_wrench_is_the_contact_force(model: str) -> None:
    """In even motion to a tenth of the HEX-E's resolution, at rest to its counts."""
    simulation = _press(model, np.array([0.0, 0.0, 1e-3]), np.deg2rad(2.0))
    moving = simulation.observation()[6:9] - _groove_on_bolt(simulation)
    assert np.abs(moving).max() < 0.02
    for _ in range(5):
        simulation.step(np.zeros(6))
    resting = simulation.observation()[6:9] - _groove_on_bolt(simulation)
    assert np.abs(resting).max() < 1e-3

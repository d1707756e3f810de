"""Sliding, in the cell and in a turned groove, against Coulomb and the contact."""

import numpy as np
import pytest
from physics import QUIET, STIFF

from drake_disasm.common.spatial import rotation_from_vector
from drake_disasm.effects import GroovePose
from drake_disasm.scenario import load_scenario
from drake_disasm.task.simulation import TaskSimulation


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
    for i in range(contacts.num_hydroelastic_contacts()):
        info = contacts.hydroelastic_contact_info(i)
        surface = info.contact_surface()
        if {surface.id_M(), surface.id_N()} & groove:  # the force is on M's body
            sign = -1.0 if surface.id_M() in groove else 1.0
            force += sign * info.F_Ac_W().translational()
    return station.X_WG.rotation().matrix().T @ force


ANGLES_DEG = [0.0, 2.0, -4.0]
OFFSETS = [[0, 0, 6e-4], [0, 6e-4, 0], [0, -6e-4, 0]]
IN_TWIN = [("twin", angle, offset) for angle in ANGLES_DEG for offset in OFFSETS]
IN_CELL = [("cell", *case) for _, *case in IN_TWIN]


@pytest.mark.parametrize(
    ("model", "ry_deg", "offset"),
    [
        *IN_TWIN,
        IN_CELL[4],
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in IN_CELL[:4] + IN_CELL[5:]
        ),
    ],
)
def test_sliding_force_is_mu_n_anywhere(
    model: str, ry_deg: float, offset: list[float]
) -> None:
    """Neck on a lip, head under the lips, head on the floor; groove turned or not."""
    ry = np.deg2rad(ry_deg)
    simulation = _press(model, np.array(offset), ry)
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

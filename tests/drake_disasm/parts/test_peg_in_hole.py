"""A peg's solids: they fit, and the hole's mesh is closed and has its size."""

import itertools

import numpy as np
import pytest
from pydrake.geometry import CalcVolume

from drake_disasm.parts import ContactConfig, PegInHole
from drake_disasm.parts.materials import facet_count
from drake_disasm.parts.meshes import circle, tube
from drake_disasm.scenario import load_scenario
from tests.refusals import refused


@pytest.mark.parametrize("clearance", [2e-5, 2e-4, 1e-3])
def test_facets_take_little_of_the_play(clearance: float) -> None:
    radius = 0.005
    facets = facet_count(2 * radius, clearance)
    assert facets % 4 == 0
    assert radius * (1 - np.cos(np.pi / facets)) <= 0.05 * clearance
    corners = circle(radius, facets)
    assert np.abs(corners).max() == pytest.approx(radius)  # sides across the axes
    assert np.linalg.norm(corners, axis=1).min() >= radius


def test_a_tube_has_the_volume_of_its_polygons() -> None:
    """Positive: its faces point outwards, or contact would pull."""
    n, inner, outer, height = 64, 0.005, 0.015, 0.02
    inside = circle(inner, n)
    area = (
        0.5 * n * np.sin(2 * np.pi / n) * (outer**2 - (inner / np.cos(np.pi / n)) ** 2)
    )
    found = CalcVolume(tube(inside, outer, -height, 0.0))
    assert found == pytest.approx(area * height)


def test_walls_of_a_square_hole_leave_it_open_and_do_not_overlap() -> None:
    peg = PegInHole(cross_section="square")
    solids = peg.fixed_solids(peg.environment(ContactConfig()))
    boxes = {}
    for name, (X_GP, box) in solids.items():
        half = np.array(box.size()) / 2
        boxes[name] = X_GP.translation() - half, X_GP.translation() + half
    for (low, high), (low_2, high_2) in itertools.combinations(boxes.values(), 2):
        assert np.any(np.minimum(high, high_2) - np.maximum(low, low_2) < 1e-12)
    half = (peg.width + peg.clearance) / 2
    walls = [box for name, box in boxes.items() if name != "floor"]
    for point in ([half - 1e-9, -0.01, 0.0], [0.0, -0.01, 1e-9 - half]):
        assert not any(np.all((low < point) & (point < high)) for low, high in walls)
    for point in ([half + 1e-9, -0.01, half], [-half, -0.01, -half - 1e-9]):
        assert any(np.all((low <= point) & (point <= high)) for low, high in walls)


def test_a_peg_that_would_tip_over_is_refused() -> None:
    with refused("part.clearance: ", "give less than a quarter"):
        load_scenario("iiwa_peg", ["part.clearance=0.001", "part.depth=0.003"])

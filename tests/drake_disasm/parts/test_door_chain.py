"""The lock's geometry: its gaps are the scenario's clearances, and nothing overlaps."""

import dataclasses
import itertools

import numpy as np
import pytest

from drake_disasm.cell.lock import set_environment
from drake_disasm.parts import DoorChain
from drake_disasm.parts.materials import facet_length
from drake_disasm.stations import SimulatedStation

PARTS = [
    DoorChain(),
    DoorChain(clearance=1e-4, travel=0.1, head_diameter=0.014),
    DoorChain(clearance=1e-3, axial_clearance=1e-3, lip_thickness=0.004),
]


@pytest.mark.parametrize("part", PARTS)
def test_gaps_are_the_clearances(part: DoorChain) -> None:
    boxes = part.groove_boxes(part.clearance)
    low = {name: box[0] for name, box in boxes.items()}
    high = {name: box[1] for name, box in boxes.items()}
    slot = low["lip_left"][2] - high["lip_right"][2]
    channel = low["wall_left"][2] - high["wall_right"][2]
    height = low["lip_left"][1] - high["floor"][1]
    hole = low["stop_b"][0] - high["lip_left"][0]
    assert slot == pytest.approx(part.neck_diameter + part.clearance)
    assert channel == pytest.approx(part.head_diameter + part.channel_clearance)
    assert height == pytest.approx(part.head_thickness + part.axial_clearance)
    assert hole == pytest.approx(part.head_diameter + part.keyhole_clearance)
    assert (low["stop_b"][0] + high["lip_left"][0]) / 2 == pytest.approx(part.travel)


@pytest.mark.parametrize("part", PARTS)
def test_solid_parts_do_not_overlap_and_are_a_mirror_image(part: DoorChain) -> None:
    boxes = part.groove_boxes(part.clearance)
    for first, second in itertools.combinations(boxes.values(), 2):
        low, high = np.maximum(first[0], second[0]), np.minimum(first[1], second[1])
        assert np.any(high - low < 1e-12), (first, second)
    mirror = np.array([1.0, 1.0, -1.0])
    for name in ("lip", "wall", "keyhole"):
        corners = [boxes[f"{name}_right"][i] * mirror for i in (0, 1)]
        low, high = np.minimum(*corners), np.maximum(*corners)
        np.testing.assert_allclose(boxes[f"{name}_left"][0], low)
        np.testing.assert_allclose(boxes[f"{name}_left"][1], high)


@pytest.mark.parametrize("part", PARTS)
def test_heights_add_up(part: DoorChain) -> None:
    """The head hangs midway in the channel; to be out it rises past lip and itself."""
    play = part.axial_clearance / 2
    assert -part.surface - part.gaps.top == pytest.approx(play)
    underside = part.gaps.top - part.head_thickness
    channel_floor = part.groove_boxes(part.clearance)["floor"][1][1]
    assert underside - channel_floor == pytest.approx(play)
    assert part.bottom < channel_floor
    lifted = underside + part.stages[-1].end + 0.002
    assert lifted == pytest.approx(part.surface + 0.002)


def test_bolt_weight_and_facets() -> None:
    """Facets by Drake's count: the circumference over the hint, rounded up."""
    part = DoorChain(mass=0.3)
    M_B = part.M_moved_B
    assert M_B.get_mass() == 0.3
    middle = part.lip_thickness / 2 + part.grip_standoff + part.grip_size[1] / 2
    np.testing.assert_allclose(M_B.get_com(), [0, middle, 0])
    assert M_B.IsPhysicallyValid()
    for diameter in (0.002, 0.005, 0.0073, 0.02):
        for resolution in (1e-4, 0.8e-3, 1.6e-3, 5e-3):
            edge = facet_length(diameter, resolution)
            facets = np.ceil(np.pi * diameter / edge)
            assert facets % 4 == 0
            assert edge <= resolution * (1 + 1e-5)
            assert facets < np.pi * diameter / resolution + 4


@pytest.mark.parametrize("name", ["cell", "twin"])
def test_bolt_starts_free_of_the_groove(name: str, request) -> None:
    station: SimulatedStation = request.getfixturevalue(name)
    context = station.settled([])
    contacts = station.GetOutputPort("contact_results").Eval(context)
    groove = set(station.lock.groove_ids)
    for i in range(contacts.num_hydroelastic_contacts()):
        surface = contacts.hydroelastic_contact_info(i).contact_surface()
        assert not {surface.id_M(), surface.id_N()} & groove


@pytest.mark.parametrize("name", ["cell", "twin"])
def test_environment_reaches_every_contact_property(name: str, request) -> None:
    station: SimulatedStation = request.getfixturevalue(name)
    context, lock = station.CreateDefaultContext(), station.lock
    changed = dataclasses.replace(lock.environment, friction=0.55, modulus=3e8)
    plant = station.part_context(station.plant, context)
    scene = station.part_context(station.scene_graph, context)
    set_environment(lock, changed, plant, station.scene_graph, scene)
    inspector = station.GetOutputPort("query_object").Eval(context).inspector()
    for geometry in (*lock.groove_ids, *lock.bolt_ids.values()):
        properties = inspector.GetProximityProperties(geometry)
        friction = properties.GetProperty("material", "coulomb_friction")
        assert friction.static_friction() == friction.dynamic_friction() == 0.55
    neck = inspector.GetProximityProperties(lock.bolt_ids["neck"])
    assert neck.GetProperty("hydroelastic", "hydroelastic_modulus") == 3e8

"""Every station has the ports of its table."""

import dataclasses

import pytest

from drake_disasm.common.ports import (
    TWIN_PORTS,
    cell_ports,
    check_ports,
    port_differences,
)
from drake_disasm.stations import CellStation, SimulatedStation
from tests.refusals import refused

TABLES = {"cell": cell_ports("iiwa", 7), "twin": TWIN_PORTS}


@pytest.mark.parametrize("name", TABLES)
def test_parity_in_both_directions(name: str, request: pytest.FixtureRequest) -> None:
    station: SimulatedStation = request.getfixturevalue(name)
    assert port_differences(station, TABLES[name]) == []


def test_a_missing_an_extra_and_a_resized_port_are_named(cell: CellStation) -> None:
    first, second, third, *rest = TABLES["cell"]
    odd = dataclasses.replace(third, size=3)
    more = dataclasses.replace(first, name="iiwa.jerk")
    words = ("iiwa.jerk is missing", "iiwa.position is extra", "has size 7, not 3")
    with refused(*words):
        check_ports(cell, (second, odd, more, *rest))

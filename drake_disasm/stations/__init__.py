"""Stations: the one part of the diagram that is swapped (cell, twin, hardware)."""

from drake_disasm.scenario import Scenario
from drake_disasm.stations.base import InitialState, Station
from drake_disasm.stations.cell import CellStation
from drake_disasm.stations.simulated import SimulatedStation
from drake_disasm.stations.twin import TwinStation

#: What `--station` may name.
STATIONS = ("cell", "twin", "hardware")

#: Those of them that are simulated.
MODELS: dict[str, type[SimulatedStation]] = {"cell": CellStation, "twin": TwinStation}


def make_station(model: str, scenario: Scenario) -> SimulatedStation:
    """Returns the simulated station of a model's name, "cell" or "twin"."""
    return MODELS[model](scenario)


__all__ = [
    "MODELS",
    "STATIONS",
    "CellStation",
    "InitialState",
    "SimulatedStation",
    "Station",
    "TwinStation",
    "make_station",
]

"""Stations: the one part of the diagram that is swapped (cell, twin, hardware)."""

from drake_disasm.stations.base import InitialState, Station
from drake_disasm.stations.cell import CellStation
from drake_disasm.stations.make import SIMULATED_STATIONS, STATIONS, make_station
from drake_disasm.stations.simulated import SimulatedStation
from drake_disasm.stations.twin import TwinStation

__all__ = [
    "SIMULATED_STATIONS",
    "STATIONS",
    "CellStation",
    "InitialState",
    "SimulatedStation",
    "Station",
    "TwinStation",
    "make_station",
]

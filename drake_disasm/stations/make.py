"""One way to make a station: by its name."""

from pathlib import Path
from typing import Any, Literal, overload

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.common.text import clipped
from drake_disasm.scenario import Scenario
from drake_disasm.scenario.given import scenario_of
from drake_disasm.stations.base import Station
from drake_disasm.stations.cell import CellStation
from drake_disasm.stations.simulated import SimulatedStation
from drake_disasm.stations.twin import TwinStation

_SIMULATED: dict[str, type[SimulatedStation]] = {
    "cell": CellStation,
    "twin": TwinStation,
}

#: What can be simulated.
SIMULATED_STATIONS = tuple(_SIMULATED)

#: The names of all stations.
STATIONS = (*SIMULATED_STATIONS, "hardware")


@overload
def make_station(
    name: Literal["cell", "twin"], scenario: Scenario | str | Path
) -> SimulatedStation: ...


@overload
def make_station(
    name: str, scenario: Scenario | str | Path, **options: Any
) -> Station: ...


def make_station(name: str, scenario: Scenario | str | Path, **options: Any) -> Station:
    """Returns the station of a name.

    Args:
        name: one of STATIONS.
        scenario: of the task: an object, a shipped name, or a file.
        options: of hardware alone, and those of `HardwareStation`: `config`, a
            HardwareConfig or the path of a file such as models/hardware/cell.yaml,
            which is needed; and `dry_run`, `clock`, `wait`, `lcm`.

    Raises:
        DisasmError: there is no such station or scenario; an option is missing or not
            the station's; the station can't carry one of the scenario's effects, or
            take its arm.
    """
    if not isinstance(name, str) or name not in STATIONS:
        known = closest(str(name), list(STATIONS))
        raise DisasmError(f"there is no station '{clipped(str(name))}'; {known}")
    scenario = scenario_of(scenario)
    if name == "hardware":
        return _make_hardware(scenario, options)
    if options:
        raise DisasmError(
            f"station '{name}': takes no option '{next(iter(options))}'; only hardware "
            "has options"
        )
    return _SIMULATED[name](scenario)


def _make_hardware(scenario: Scenario, options: dict[str, Any]) -> Station:
    # Here, since only this station needs the devices' libraries.
    from drake_disasm.stations.hardware import HardwareStation
    from drake_disasm.stations.hardware_config import (
        load_hardware_config,
    )

    config = options.pop("config", None)
    if config is None:
        raise DisasmError(
            "station 'hardware': needs to know where its devices are; give config, a "
            "HardwareConfig or the path of a file such as models/hardware/cell.yaml"
        )
    if isinstance(config, str | Path):
        config = load_hardware_config(Path(config))
    return HardwareStation(scenario, config, **options)

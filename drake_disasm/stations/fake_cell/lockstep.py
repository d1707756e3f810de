"""The hardware station and a fake cell in step with it, in one process."""

import contextlib
import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydrake.lcm import DrakeLcm

from drake_disasm.effects import Effect
from drake_disasm.scenario import Scenario
from drake_disasm.scenario.given import scenario_of
from drake_disasm.stations.fake_cell.cell import FakeCell, arrival
from drake_disasm.stations.hardware import HardwareStation

_REPORTS = 5  # of each device, until the station has the newest


@dataclasses.dataclass(frozen=True)
class FakeHardware:
    """A hardware station, and the played devices that it talks to.

    Attributes:
        station: talks to the devices by their own protocols.
        cell: plays the devices, with a simulated cell behind them.
    """

    station: HardwareStation
    cell: FakeCell

    def jog_to_start(self) -> None:
        """Puts the arm back to where an episode starts, and has the devices say so."""
        self.cell.jog_to_start()
        for _ in range(_REPORTS):
            self.cell.advance(arrival(self.station.devices["ft_sensor"].read))


@contextlib.contextmanager
def fake_hardware(
    scenario: Scenario | str | Path,
    seed: int = 0,
    limits: Mapping[str, Any] | None = None,
    hidden: Sequence[Effect] = (),
) -> Iterator[FakeHardware]:
    """Yields a hardware station with fake devices, in virtual time.

    Args:
        scenario: of the task, an object, a shipped name, or a file; effects in it are
            refused, as by any hardware station.
        seed: of the fake sensor's noise.
        limits: fields of the safety limits that differ from the defaults, by name.
        hidden: effects of the simulated cell behind the devices.
    """
    scenario, lcm = scenario_of(scenario), DrakeLcm("memq://")
    played = dataclasses.replace(scenario, effects=[*scenario.effects, *hidden])
    with FakeCell(played, lcm, seed) as cell:

        def wait(_: float) -> None:
            """Lets a period pass: the station waits, if only for a command's turn."""
            cell.advance(arrival(station.devices["ft_sensor"].read))

        config = cell.config()
        config.safety = dataclasses.replace(config.safety, **(limits or {}))
        with HardwareStation(
            scenario, config, clock=cell.clock, wait=wait, lcm=lcm
        ) as station:
            yield FakeHardware(station, cell)

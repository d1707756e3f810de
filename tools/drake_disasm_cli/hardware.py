"""What simulate.py and play_motion.py do with --station hardware."""

import argparse
import dataclasses
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from drake_disasm.common import stopping
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.ports import Health
from drake_disasm.devices.reading import Reading
from drake_disasm.scenario import Scenario
from drake_disasm.stations.hardware import HardwareStation
from drake_disasm.stations.hardware_config import load_hardware_config
from drake_disasm.visualization import MeasuredView

_EVERY = 0.5  # s, between two looks of a dry run
_FRAMES = 10  # of the view, in that time
_POLL = 0.001  # s: LCM keeps one message of a channel and drops later ones


def add_config_argument(add: Callable[..., object]) -> None:
    """Adds --hardware-config.

    Args:
        add: a parser's `add_argument`.
    """
    add(
        "--hardware-config",
        type=Path,
        metavar="FILE",
        help="where the devices are, and limits; see models/hardware/cell.yaml",
    )


def refuse_contradictions(
    args: argparse.Namespace, of_hardware: Sequence[str], usual: Mapping[str, object]
) -> None:
    """Refuses options that do not go together with --station.

    Args:
        args: the parsed command line.
        of_hardware: names of options that are for hardware alone.
        usual: the only values that others may have there.

    Raises:
        DisasmError: names the first.
    """
    if args.station != "hardware":
        for name in of_hardware:
            if getattr(args, name):
                raise DisasmError(f"{_option(name)}: is for --station hardware")
        return
    for name, only in usual.items():
        if getattr(args, name) != only:
            raise DisasmError(f"{_option(name)}: hardware can't do that; leave it out")


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def open_station(
    scenario: Scenario, config: Path | None, dry_run: bool
) -> HardwareStation:
    """Returns the station of a configuration's file.

    Raises:
        DisasmError: no file, or one that is wrong.
    """
    if config is None:
        raise DisasmError(
            "--station hardware: give the devices' addresses by --hardware-config "
            "FILE; copy models/hardware/cell.yaml"
        )
    return HardwareStation(scenario, load_hardware_config(config), dry_run)


def watch(station: HardwareStation, view: MeasuredView | None) -> None:
    """Prints and shows the devices' state until Ctrl-C; commands nothing."""
    print("dry run: nothing is commanded; Ctrl-C ends it", flush=True)
    print(control_in_words(station), flush=True)
    station.connect()
    while True:
        for _ in range(_FRAMES):
            _pump(station, _EVERY / _FRAMES)
            if view:
                view.show(station.measured())
        print(health_table(station), flush=True)


def control_in_words(station: HardwareStation) -> str:
    """Returns what the cabinet must be set to, and how far a command may lead."""
    arm = station.scenario.arm
    words = f"arm: {arm.control} control"
    if arm.control != "position":
        section = dataclasses.asdict(getattr(arm, arm.control))
        values = (f"{name} {_numbers(value)}" for name, value in section.items())
        words += f" with {', '.join(values)} (set these in the Sunrise application)"
    lead = _numbers([f"{q:.3f}" for q in station.allowed_lead])
    return f"{words}\ncommands may lead the joints by {lead} rad"


def _numbers(value: object) -> str:
    values = value if isinstance(value, list) else [value]
    return " ".join(f"{v:g}" if isinstance(v, float) else str(v) for v in values)


def _pump(station: HardwareStation, duration: float) -> None:
    """Receives the arm's messages for a time [s]."""
    end = time.monotonic() + duration
    while time.monotonic() < end:
        stopping.stop_if_interrupted()
        station.pump()
        time.sleep(_POLL)


def health_table(station: HardwareStation) -> str:
    """Returns a line for each device: health, values, age, packets."""
    readings, healths, now = station.readings(), station.healths(), time.monotonic()
    return "\n".join(
        _line(name, reading, healths[name], now) for name, reading in readings.items()
    )


def _line(name: str, reading: Reading, health: Health, now: float) -> str:
    values = " ".join(f"{value:8.3f}" for value in reading.values)
    age = f"{1e3 * reading.age(now):6.0f} ms old"
    more = reading.error or reading.counters.text
    return f"{name:10} {health.name:8} {values}  {age}  {more}"


def pace_in_words(station: HardwareStation) -> str:
    """Returns what keeping the commands' pace has cost, in a line."""
    counts = station.counts()
    if not (counts["stalls"] or counts["clamped"]):
        return "pace: every command was sent in time"
    return (
        f"pace: {counts['stalls']} stalls, the longest of "
        f"{1e3 * counts['longest_stall']:.0f} ms; {counts['slipped']:.2f} s lost; "
        f"{counts['held']} commands not sent, {counts['clamped']} shortened"
    )

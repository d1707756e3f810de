"""Simulates the devices of a cell on this machine, to try the hardware station.

A simulated cell runs in real time behind the LCM channels of an iiwa driver, an OnRobot
HEX and a Robotiq gripper on the loopback. The program writes the configuration file for
simulate.py --hardware-config, then runs until Ctrl-C. Type a device and a fault to
cause the fault, and an empty line to end it:

  ft_sensor: delay, loss, reorder, short, header, status, frozen, jump
  gripper:   crc, drop, silent, status, short, header
  iiwa:      loss, frozen, reorder, nan, jump, short, header

Type `start` to have the arm back where an episode starts, as if it had been jogged.
"""

import argparse
import math
import select
import sys
from collections.abc import Sequence
from pathlib import Path

import cli
from pydrake.common.yaml import yaml_dump_typed
from pydrake.lcm import DrakeLcm

from drake_disasm.common import options, program
from drake_disasm.common.files import write_text
from drake_disasm.fakes import hex_box, robotiq_gripper
from drake_disasm.fakes.cell import IIWA_FAULTS, FakeCell
from drake_disasm.fakes.real_time import RealTime
from drake_disasm.scenario import load_scenario
from drake_disasm.stations.hardware_config import HardwareConfig

_LCM = "udpm://239.255.76.67:7667?ttl=0"
_LATE = 1.0  # s that were lost
_BEHIND = (
    "the fake cell can't keep real time on this machine; "
    "try --set simulation.cell_time_step=0.005"
)
_EXAMPLES = """examples:
  python tools/fake_cell.py --config out/fake.yaml             in one terminal
  python tools/simulate.py --station hardware --hardware-config out/fake.yaml
  python tools/fake_cell.py --scenario removal_turned          with a hidden effect
  ft_sensor loss                                               while it runs
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("fake_cell", __doc__, _EXAMPLES)
    cli.add_scenario_arguments(parser)
    add = parser.add_argument
    add(
        "--config",
        type=Path,
        default=Path("fake_cell.yaml"),
        metavar="FILE",
        help="is written, for simulate.py --hardware-config (default: fake_cell.yaml)",
    )
    add("--lcm-url", default=_LCM, metavar="URL", help=f"(default: {_LCM})")
    add(
        "--seed",
        type=options.seed,
        default=0,
        help="of the sensor's noise (default: 0)",
    )
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    scenario = load_scenario(args.scenario, args.overrides)
    lcm = DrakeLcm(args.lcm_url)
    with FakeCell(scenario, lcm, args.seed) as cell:
        config = cell.config()
        config.iiwa.lcm_url = args.lcm_url
        text = yaml_dump_typed(config, schema=HardwareConfig)
        write_text(args.config, text)
        print(f"playing a cell; --hardware-config {args.config}", flush=True)
        _play(cell)
    return 0


def _play(cell: FakeCell) -> None:
    """Advances the cell in real time; causes the faults that are typed."""
    pace, steps = RealTime(cell), 0
    while True:
        program.stop_if_interrupted()
        cell.advance()
        pace.keep()
        steps += 1
        if pace.lost > _LATE:
            print(_BEHIND, file=sys.stderr, flush=True)
            pace.lost = -math.inf  # once is enough
        if steps % 20 == 0 and sys.stdin and select.select([sys.stdin], [], [], 0)[0]:
            line = sys.stdin.readline()
            if line:
                _cause(cell, line.split())


def _cause(cell: FakeCell, words: Sequence[str]) -> None:
    """Causes a fault of a device; no words end all faults."""
    devices: dict[str, tuple[object, Sequence[str]]] = {
        "iiwa": (cell, IIWA_FAULTS),
        "ft_sensor": (cell.hex, hex_box.FAULTS),
        "gripper": (cell.gripper, robotiq_gripper.FAULTS),
    }
    if not words:
        for device, _ in devices.values():
            device.fault = ""  # type: ignore[attr-defined]
        return
    if list(words) == ["start"]:
        cell.jog_to_start()
        print("the arm is at the start", flush=True)
        return
    try:
        name, fault = words
        device, faults = devices[name]
        if fault not in faults:
            raise ValueError
    except (ValueError, KeyError):
        print(f"{' '.join(words)}: write a device and a fault; see --help")
        return
    device.fault = fault  # type: ignore[attr-defined]
    print(f"{name}: {fault}", flush=True)


if __name__ == "__main__":
    program.run(main)

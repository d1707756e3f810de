"""Simulates the devices of a cell on this machine, to try the hardware station.

A simulated cell runs in real time behind the LCM channels of an iiwa driver, an OnRobot
HEX and a Robotiq gripper on the loopback. The program writes the configuration file for
simulate --hardware-config, then runs until Ctrl-C. Type a device and a fault to
cause the fault, and an empty line to end it:

  ft_sensor: delay, loss, reorder, short, header, status, frozen, jump
  gripper:   crc, drop, silent, status, short, header
  iiwa:      loss, frozen, reorder, nan, jump, short, header

and `restart` for each of them: as after a loss of power.

Type `start` to have the arm back where an episode starts, as if it had been jogged;
`force` prints the greatest force at the sensor since.
"""

import argparse
import math
import select
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydrake.common.yaml import yaml_dump_typed
from pydrake.lcm import DrakeLcm

from drake_disasm.common import options, program, stopping
from drake_disasm.common.files import write_text
from drake_disasm.devices.onrobot_hex import fake_box
from drake_disasm.devices.robotiq import fake_gripper
from drake_disasm.scenario import load_scenario
from drake_disasm.stations.fake_cell.cell import IIWA_FAULTS, FakeCell
from drake_disasm.stations.fake_cell.real_time import RealTime
from drake_disasm.stations.hardware_config import HardwareConfig
from drake_disasm_cli import common

_LCM = "udpm://239.255.76.67:7667?ttl=0"
_LATE = 1.0  # s that were lost
_BEHIND = (
    "the fake cell can't keep real time on this machine; "
    "try --set simulation.cell_time_step=0.005"
)
_EXAMPLES = """examples:
  drake-disasm fake-cell --hardware-config out/fake.yaml       in one terminal
  drake-disasm fake-cell --scenario removal_turned             with a hidden effect
in another terminal:
  drake-disasm simulate --station hardware --hardware-config out/fake.yaml
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm fake-cell", __doc__, _EXAMPLES)
    common.add_scenario_arguments(parser)
    add = parser.add_argument
    add(
        "--hardware-config",
        type=Path,
        default=Path("fake_cell.yaml"),
        metavar="FILE",
        help="is written, for the same option of simulate (default: fake_cell.yaml)",
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
        write_text(args.hardware_config, text)
        print(f"playing a cell; --hardware-config {args.hardware_config}", flush=True)
        _play(cell)
    return 0


class _Console:
    """Does what is typed."""

    def __init__(self, cell: FakeCell) -> None:
        self._cell, self._greatest = cell, 0.0
        self._devices: dict[str, tuple[object, Sequence[str]]] = {
            "iiwa": (cell, IIWA_FAULTS),
            "ft_sensor": (cell.hex, fake_box.FAULTS),
            "gripper": (cell.gripper, fake_gripper.FAULTS),
        }

    def look(self) -> None:
        """Takes note of the force, and does what was typed since."""
        self._greatest = max(self._greatest, float(np.linalg.norm(self._cell.load())))
        while sys.stdin and select.select([sys.stdin], [], [], 0)[0]:
            line = sys.stdin.readline()
            if not line:
                return
            self._obey(line.split())

    def _obey(self, words: Sequence[str]) -> None:
        match list(words):
            case []:
                for device, _ in self._devices.values():
                    device.fault = ""  # type: ignore[attr-defined]
            case ["start"]:
                self._cell.jog_to_start()
                self._greatest = 0.0
                print("the arm is at the start", flush=True)
            case ["force"]:
                print(f"greatest force {self._greatest:.2f} N", flush=True)
            case [name, "restart"] if name in self._devices:
                self._cell.restart(name)
                print(f"{name}: restarted", flush=True)
            case [name, fault] if fault in self._devices.get(name, ("", ""))[1]:
                self._devices[name][0].fault = fault  # type: ignore[attr-defined]
                print(f"{name}: {fault}", flush=True)
            case _:
                print(f"{' '.join(words)}: write a device and a fault; see --help")


def _play(cell: FakeCell) -> None:
    """Advances the cell in real time; does what is typed."""
    pace, console = RealTime(cell), _Console(cell)
    while True:
        stopping.stop_if_interrupted()
        cell.advance()
        pace.keep()
        if pace.lost > _LATE:
            print(_BEHIND, file=sys.stderr, flush=True)
            pace.lost = -math.inf  # once is enough
        console.look()

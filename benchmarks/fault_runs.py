"""What each fault of each device does to the hardware station, in virtual time.

The cell moves, then one device fails. Prints what happened, and how long it took, as
Markdown.
"""

import contextlib
import dataclasses
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from drake_disasm.common import program
from drake_disasm.devices.onrobot_hex import fake_box
from drake_disasm.devices.robotiq import fake_gripper
from drake_disasm.policies import make_policy
from drake_disasm.safety import Mode
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.stations.fake_cell.cell import IIWA_FAULTS, FakeCell
from drake_disasm.stations.fake_cell.lockstep import fake_hardware
from drake_disasm.stations.hardware import HardwareStation, HoldError
from drake_disasm.systems.policy import Policy
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm.visualization import MeshcatView

ALL = (
    *(("iiwa", fault) for fault in IIWA_FAULTS if fault),
    *(("ft_sensor", fault) for fault in fake_box.FAULTS if fault),
    *(("gripper", fault) for fault in fake_gripper.FAULTS if fault),
)
_STEPS_BEFORE, _STEPS_WITH = 3, 12
_REAL_PACE = 0.1  # s of real time for a step, where a thread polls in real time


@dataclasses.dataclass(frozen=True)
class FaultRun:
    """What a fault did.

    Attributes:
        device, fault: which.
        mode: of the supervisor at the end.
        reason: of the hold.
        until_hold: from the fault to it [s], virtual; NaN without one.
        moved: largest change of a command sent after it, other than to the place
            where the arm is held [rad].
        counters: of the device, in words.
    """

    device: str
    fault: str
    mode: Mode
    reason: str
    until_hold: float
    moved: float
    counters: str


@contextlib.contextmanager
def in_lockstep(
    scenario: Scenario,
    policy: Policy,
    seed: int = 0,
    views: Sequence[MeshcatView] = (),
    limits: Mapping[str, Any] | None = None,
) -> Iterator[tuple[TaskSimulation, HardwareStation, FakeCell]]:
    """Yields a diagram on the hardware station, with a fake cell in step with it.

    Args:
        scenario, policy, seed, views: of the diagram.
        limits: fields of the safety limits that differ from the defaults.
    """
    with fake_hardware(scenario, seed, limits) as fake:
        simulation = TaskSimulation(scenario, lambda _: fake.station, policy, views)
        yield simulation, fake.station, fake.cell


def run_fault(device: str, fault: str) -> FaultRun:
    """Runs into a fault and on; returns what it did."""
    with in_lockstep(load_scenario("removal"), make_policy("straight")) as parts:
        simulation, station, cell = parts
        simulation.reset(0)
        for _ in range(_STEPS_BEFORE):
            simulation.step()
        sent = _commands_of(cell)
        begun = cell.time
        players: dict[str, Any] = {
            "iiwa": cell, "ft_sensor": cell.hex, "gripper": cell.gripper
        }  # fmt: skip
        players[device].fault = fault
        _run_on(simulation, device)
        supervisor, counters = station.supervisor, station.readings()[device].counters
        return FaultRun(
            device,
            fault,
            supervisor.mode,
            supervisor.reason,
            supervisor.held_since - begun,
            _moved(sent, supervisor.held_since),
            counters.text,
        )


def _run_on(simulation: TaskSimulation, device: str) -> None:
    """Steps into a hold, if one comes, and on as if nobody had noticed."""
    for _ in range(_STEPS_WITH):
        with contextlib.suppress(HoldError):
            simulation.step()
        if device == "gripper":
            time.sleep(_REAL_PACE)


def _commands_of(cell: FakeCell) -> list[tuple[float, np.ndarray]]:
    """Returns a list that fills with each command and when it was obeyed."""
    sent: list[tuple[float, np.ndarray]] = []
    advance = cell.advance

    def noted(heard: Callable[[], bool] = lambda: True) -> None:
        """Advances the cell, and notes what it was commanded."""
        advance(heard)
        sent.append((cell.time, cell.commanded))

    cell.advance = noted  # type: ignore[method-assign]
    return sent


def _moved(sent: list[tuple[float, np.ndarray]], held_at: float) -> float:
    """Returns the largest change of commands [rad] since the step that held."""
    after = [q for when, q in sent if when > held_at]
    return float(np.ptp(after, axis=0).max()) if after else 0.0


def table(runs: list[FaultRun]) -> str:
    """Returns the runs as Markdown."""
    lines = ["| device | fault | what happened | until hold |", "|---|---|---|---|"]
    for run in runs:
        is_held = run.mode is Mode.HOLD
        what = run.reason if is_held else f"goes on; {run.counters}"
        when = f"{1e3 * run.until_hold:.0f} ms" if is_held else "-"
        lines.append(f"| {run.device} | {run.fault} | {what} | {when} |")
    return "\n".join(lines)


def main(arguments: Sequence[str]) -> int:
    """Runs into the faults and prints the table; returns the exit status."""
    parser = program.argument_parser("python benchmarks/fault_runs.py", __doc__, "")
    devices = tuple(dict.fromkeys(device for device, _ in ALL))
    parser.add_argument(
        "--only", nargs="+", choices=devices, default=devices, metavar="DEVICE",
        help=f"of {', '.join(devices)} (default: all)",
    )  # fmt: skip
    wanted = parser.parse_args(arguments).only
    print(table([run_fault(*which) for which in ALL if which[0] in wanted]))
    return 0


if __name__ == "__main__":
    program.run(main)

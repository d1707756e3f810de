"""What the arm does at the limit of force: held, or backing away, in virtual time.

The policy presses the gripped bolt against the groove until a hold. Prints the force at
the fake sensor, as Markdown.
"""

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np
from fault_runs import in_lockstep

from drake_disasm.common import program
from drake_disasm.scenario import CONTROLS, load_scenario
from drake_disasm.stations.fake_cell.cell import FakeCell
from drake_disasm.stations.hardware import HoldError

#: Actions (6,) that press the bolt against the groove until a hold.
PUSHES = {
    "across the groove (+z)": (0.0, 0.0, 1e-3, 0.0, 0.0, 0.0),
    "into its end (-x)": (-1e-3, 0.0, 0.0, 0.0, 0.0, 0.0),
    "out of the plate (+y)": (0.0, 1e-3, 0.0, 0.0, 0.0, 0.0),
    "turning about z": (0.0, 0.0, 0.0, 0.0, 0.0, 8.7e-3),
}
_MOST_STEPS, _STEPS_HELD = 100, 10
_SOON = 0.1  # s
#: In impedance control a joint is at its limit before any force is too much.
_TURN = "turning about z"
_GRIP = "gripper.compliance=rigid"  # one that yields leaves the workspace sooner


@dataclasses.dataclass(frozen=True)
class ForceRun:
    """What a push did.

    Attributes:
        push: of PUSHES.
        on_force: of the safety limits.
        control: of the arm.
        at_hold: force at the sensor when it was held [N].
        greatest: after that [N].
        soon, late: 0.1 s and 1 s after it [N].
        reason: of the hold.
    """

    push: str
    on_force: str
    control: str
    at_hold: float
    greatest: float
    soon: float
    late: float
    reason: str


def run_push(push: str, on_force: str, control: str = "position") -> ForceRun:
    """Pushes until a hold, and watches for a second.

    Args:
        push: of PUSHES.
        on_force: of the safety limits.
        control: of the arm.
    """
    action, forces = np.array(PUSHES[push]), list[tuple[bool, float]]()
    scenario = load_scenario("removal", [_GRIP, f"arm.control={control}"])
    limits = {"on_force": on_force}
    with in_lockstep(scenario, lambda _: action, limits=limits) as parts:
        simulation, station, cell = parts
        simulation.reset(0)
        advance = cell.advance

        def noted(*heard: object) -> None:
            """Advances the cell, and notes the force at its sensor."""
            advance(*heard)  # type: ignore[arg-type]
            is_held = np.isfinite(station.supervisor.held_since)
            forces.append((bool(is_held), _force(cell)))

        cell.advance = noted  # type: ignore[method-assign, assignment]
        held = 0
        for _ in range(_MOST_STEPS):
            try:
                simulation.step()
            except HoldError:
                held += 1
            if held == _STEPS_HELD:
                break
        reason = station.supervisor.reason
    before = [force for is_held, force in forces if not is_held]
    after = [force for is_held, force in forces if is_held]
    soon = after[round(_SOON / station.control_period)]
    forces_after = before[-1], max(after), soon, after[-1]
    return ForceRun(push, on_force, control, *forces_after, reason)


def _force(cell: FakeCell) -> float:
    return float(np.linalg.norm(cell.load()))


def table(runs: list[ForceRun]) -> str:
    """Returns the runs as Markdown."""
    lines = [
        "| pressed | control | on_force | at the hold | greatest after | 0.1 s later "
        "| 1 s later | said |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for run in runs:
        forces = (run.at_hold, run.greatest, run.soon, run.late)
        figures = " | ".join(f"{force:.1f} N" for force in forces)
        first = f"{run.push} | {run.control} | {run.on_force}"
        lines.append(f"| {first} | {figures} | {run.reason} |")
    return "\n".join(lines)


def main(arguments: Sequence[str]) -> int:
    """Pushes and prints the table; returns the exit status."""
    parser = program.argument_parser("python benchmarks/force_runs.py", __doc__, "")
    parser.add_argument(
        "--control", nargs="+", choices=CONTROLS, default=CONTROLS, metavar="CONTROL",
        help=f"of {', '.join(CONTROLS)} (default: all)",
    )  # fmt: skip
    controls = parser.parse_args(arguments).control
    cases = itertools.product(PUSHES, controls, ("hold", "yield"))
    reached = [c for c in cases if c[0] != _TURN or c[1] == "position"]
    print(table([run_push(push, mode, c) for push, c, mode in reached]))
    return 0


if __name__ == "__main__":
    program.run(main)

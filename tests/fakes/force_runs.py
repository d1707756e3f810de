"""What the arm does at the limit of force: held, or backing away, in virtual time.

`python -m tests.fakes.force_runs` prints the table of docs/hardware.md.
"""

import dataclasses

import numpy as np

from drake_disasm.fakes.cell import FakeCell
from drake_disasm.scenario import load_scenario
from drake_disasm.stations.hardware import HoldError
from tests.fakes.fault_runs import in_lockstep

#: Actions (6,) that press the bolt against the groove until a hold.
PUSHES = {
    "across the groove (+z)": (0.0, 0.0, 1e-3, 0.0, 0.0, 0.0),
    "into its end (-x)": (-1e-3, 0.0, 0.0, 0.0, 0.0, 0.0),
    "out of the plate (+y)": (0.0, 1e-3, 0.0, 0.0, 0.0, 0.0),
    "turning about z": (0.0, 0.0, 0.0, 0.0, 0.0, 0.01),
}
_MOST_STEPS, _STEPS_HELD = 60, 10
_SOON = 0.1  # s


@dataclasses.dataclass(frozen=True)
class ForceRun:
    """What a push did.

    Attributes:
        push: of PUSHES.
        on_force: of the safety limits.
        at_hold: force at the sensor when it was held [N].
        greatest: after that [N].
        soon, late: 0.1 s and 1 s after it [N].
        reason: of the hold.
    """

    push: str
    on_force: str
    at_hold: float
    greatest: float
    soon: float
    late: float
    reason: str


def run_push(push: str, on_force: str) -> ForceRun:
    """Pushes until a hold, and watches for a second."""
    action, forces = np.array(PUSHES[push]), list[tuple[bool, float]]()
    scenario = load_scenario("removal")
    limits = {"on_force": on_force}
    with in_lockstep(scenario, lambda _: action, limits=limits) as parts:
        simulation, station, cell = parts
        simulation.reset(0)
        advance = cell.advance

        def noted(*heard: object) -> None:
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
    return ForceRun(push, on_force, before[-1], max(after), soon, after[-1], reason)


def _force(cell: FakeCell) -> float:
    return float(np.linalg.norm(cell.load()))


def table(runs: list[ForceRun]) -> str:
    """Returns the runs as Markdown."""
    lines = [
        "| pressed | on_force | at the hold | greatest after | 0.1 s later | 1 s later "
        "| said |",
        "|---|---|---|---|---|---|---|",
    ]
    for run in runs:
        forces = (run.at_hold, run.greatest, run.soon, run.late)
        figures = " | ".join(f"{force:.1f} N" for force in forces)
        lines.append(f"| {run.push} | {run.on_force} | {figures} | {run.reason} |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(table([run_push(p, mode) for p in PUSHES for mode in ("hold", "yield")]))

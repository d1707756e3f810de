"""An experiment of your own, performed on the twin.

    python examples/own_experiment.py

An experiment is a frozen dataclass: its fields are its parameters, and `phases` says
what is done from the begin of an episode on. Registered, it is one of those that
`drake-disasm diagnose` chooses from:

    drake-disasm diagnose --experiments examples/own_experiment.py Rest --out out/found
"""

import dataclasses
from collections.abc import Iterator

from drake_disasm.common.quantity import quantity
from drake_disasm.experiments import (
    Experiment,
    Move,
    Phase,
    Wait,
    register_experiment,
)
from drake_disasm.experiments.performing import Laboratory
from drake_disasm.scenario import Scenario, load_scenario


@register_experiment
@dataclasses.dataclass(frozen=True)
class Staircase(Experiment):
    """Presses sideways, each time harder than before: tells play from compliance."""

    top: float = quantity(
        6.0, "N", "at the last stair", low=1.0, high=10.0, grid=(3.0, 6.0)
    )
    stairs: float = quantity(3, "1", "how many", low=1, high=10)

    def phases(self, scenario: Scenario) -> Iterator[Phase]:
        """Moves 0.2 mm a step along z of the groove, and holds each stair for 1 s."""
        for stair in range(1, round(self.stairs) + 1):
            force = self.top * stair / self.stairs
            yield Move((0.0, 0.0, 2e-4, 0.0, 0.0, 0.0), steps=30, effort=force)
            yield Wait(round(1.0 / scenario.task.period))


def main() -> None:
    """Performs it, and prints what was measured at the end of each stair."""
    scenario = load_scenario("removal", ["contact.model=impact"])
    performance = Laboratory(scenario, "twin").perform(Staircase().plan(scenario))
    print(f"{Staircase().text}: {performance.duration:.1f} s")
    print("  z [mm]  f_z [N]")
    moves = performance.actions.any(axis=1)
    for step in range(1, len(moves)):
        if not moves[step - 1] and (step == len(moves) - 1 or moves[step]):
            state = performance.observations[step]
            print(f"{1e3 * state[2]:8.2f}{state[8]:9.2f}")


if __name__ == "__main__":
    main()

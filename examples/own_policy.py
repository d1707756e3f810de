"""A policy of your own, as a LeafSystem, on the cell and on its twin.

    python examples/own_policy.py [STEPS]

`add_task` wires a policy to a station: imprecision, pose target, motion, observation
and reward. A policy is any system with the input `observation` (12) and the output
`action` (6). It does not see which station it is on, so it can be tried on the twin,
which is fast, and then moved to the cell or the hardware.
"""

import sys

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem

from drake_disasm.mdp import BoltState
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import make_station
from drake_disasm.task.diagram import add_task


class PushAndYield(LeafSystem):
    """Slides along the groove (x), and yields to what presses from the side (z)."""

    def __init__(self) -> None:
        super().__init__()
        self.DeclareVectorInputPort("observation", 12)
        self.DeclareVectorOutputPort("action", 6, self._calc_action)

    def _calc_action(self, context: Context, output: BasicVector) -> None:
        state = BoltState.from_vector(self.get_input_port().Eval(context))
        dz = 2e-5 * state.f[2]  # m per N
        output.SetFromVector([1e-3, 0.0, dz, 0.0, 0.0, 0.0])  # m, rad


def main(steps: int = 12) -> None:
    """Runs a number of steps of the MDP, and prints how far the bolt came."""
    scenario = load_scenario("removal_turned")
    print("station  steps  x [mm]  force [N]")
    for name in ("twin", "cell"):
        builder = DiagramBuilder()
        station = builder.AddNamedSystem("station", make_station(name, scenario))
        task = add_task(builder, station, PushAndYield())
        simulator = Simulator(builder.Build())
        simulator.AdvanceTo(steps * scenario.task.period)
        context = task.processor.GetMyContextFromRoot(simulator.get_context())
        observation = task.processor.GetOutputPort("observation").Eval(context)
        state = BoltState.from_vector(np.array(observation))
        print(f"{name:7}  {steps:5d}  {1e3 * state.p[0]:6.2f}  {state.force:9.2f}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))

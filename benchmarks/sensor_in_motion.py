"""What the sensor reads of steady motion in the groove's play, by cell and twin.

    python benchmarks/sensor_in_motion.py

Prints the force (fx, fy, fz) over the commanded rate, along x, y and z in turn: after
the first step, which begins from rest, and when nothing changes any more [N s/m].
`sysid/models/cell_motion.py` holds the differences.
"""

from collections.abc import Sequence

import numpy as np

from drake_disasm.common import program
from drake_disasm.scenario import load_scenario
from drake_disasm.task.simulation import TaskSimulation

QUIET = ["ft_sensor.noise=[0, 0, 0, 0, 0, 0]", "part.clearance=0.001"]
_STEPS = {"x": 9e-4, "y": 3e-5, "z": 3e-5}  # m, that do not end at a wall


def responses(simulation: TaskSimulation, axis: int, step: float) -> np.ndarray:
    """Returns forces over the rate (2, 3) after the first step and after the fifth."""
    simulation.reset(0)
    action = np.zeros(6)
    action[axis] = step
    rate = step / simulation.scenario.task.period
    forces = [simulation.step(action).observation[6:9] / rate for _ in range(5)]
    return np.array([forces[0], forces[-1]])


def main(arguments: Sequence[str]) -> int:
    """Prints the table; returns the exit status."""
    program.argument_parser(
        "python benchmarks/sensor_in_motion.py", __doc__, ""
    ).parse_args(arguments)
    scenario = load_scenario("removal", QUIET)
    for station in ("cell", "twin"):
        simulation = TaskSimulation(scenario, station)
        for axis, (name, step) in enumerate(_STEPS.items()):
            first, steady = responses(simulation, axis, step).round(2).tolist()
            print(f"{station}, along {name}: first {first}, steady {steady}")
    return 0


if __name__ == "__main__":
    program.run(main)

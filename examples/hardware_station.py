"""The hardware station in a diagram of your own, against a fake cell.

    python examples/hardware_station.py [STEPS]

The hardware station has the cell's ports, so the same diagram runs on it. A fake cell
plays the arm behind LCM, the sensor behind UDP and the gripper behind Modbus, here in
virtual time. With real devices, read docs/guides/hardware.md first, then build the
station by `make_station("hardware", scenario, config=load_hardware_config(path))`.
"""

import sys

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_disasm.common.timing import boundary
from drake_disasm.policies import make_policy
from drake_disasm.stations.fake_cell.lockstep import fake_hardware
from drake_disasm.task.diagram import add_task


def main(steps: int = 8) -> None:
    """Slides the bolt for a number of steps, and prints how the devices are."""
    with fake_hardware("removal") as fake:
        builder, station = DiagramBuilder(), fake.station
        builder.AddNamedSystem("station", station)
        task = add_task(builder, station, make_policy("straight"))
        simulator = Simulator(builder.Build())
        context = simulator.get_mutable_context()
        # Waits for the devices, checks the start, zeroes the sensor.
        task.begin(context)
        print("step  x [mm]  force along x [N]")
        for step in range(1, steps + 1):
            simulator.AdvanceTo(boundary(step, station.scenario.task.period))
            station.check()  # raises, with the reason, if the supervisor holds the arm
            s = task.processor.GetOutputPort("observation").Eval(
                task.processor.GetMyContextFromRoot(context)
            )
            print(f"{step:4d}  {1e3 * s[0]:6.2f}  {s[6]:17.2f}")
        for name, health in station.healths().items():
            print(f"{name}: {health.name}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))

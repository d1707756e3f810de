"""The station in a diagram of your own, shown in Meshcat.

    python examples/own_diagram.py [SECONDS]

`make_station` returns a Drake diagram like any other: add it to a builder and connect
its inputs. Its default Context is the start of the task: the arm stands at the lock,
the gripper holds the bolt in the groove at A, and the scenario's effects act.
"""

import sys

from pydrake.geometry import MeshcatVisualizer
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

from drake_disasm.scenario import load_scenario
from drake_disasm.stations import make_station
from drake_disasm.visualization import start_meshcat


def main(seconds: float = 0.2) -> None:
    """Holds the bolt at A for a time [s], and prints what the sensor reads."""
    builder = DiagramBuilder()
    scenario = load_scenario("removal_turned")
    station = builder.AddNamedSystem("station", make_station("cell", scenario))
    commands = {
        "iiwa.position": station.start,  # (7,) rad
        "gripper.position": [station.grip_command],  # m
    }
    for port, value in commands.items():
        source = builder.AddNamedSystem(port, ConstantVectorSource(value))
        builder.Connect(source.get_output_port(), station.GetInputPort(port))
    meshcat = start_meshcat()
    query = station.GetOutputPort("query_object")
    MeshcatVisualizer.AddToBuilder(builder, query, meshcat)
    sink = LogVectorOutput(station.GetOutputPort("ft_sensor.wrench"), builder, 0.05)

    simulator = Simulator(builder.Build())
    station.attach(simulator)  # for effects that depend on the bolt's motion
    print(f"watch at {meshcat.web_url()}")
    simulator.AdvanceTo(seconds)

    log = sink.FindLog(simulator.get_context())
    print("time [s]   force on the sensor [N], with the tool's weight")
    for time, wrench in zip(log.sample_times(), log.data().T, strict=True):
        print(f"{time:8.2f}   {' '.join(f'{f:7.2f}' for f in wrench[:3])}")
    station_context = station.GetMyContextFromRoot(simulator.get_context())
    X_GB = station.GetOutputPort("bolt_pose").Eval(station_context)
    moved = 1e6 * abs(X_GB.translation()).max()
    print(f"the bolt is held at A: it moved by {moved:.1f} micrometres")


if __name__ == "__main__":
    main(*map(float, sys.argv[1:2]))

"""The station in a diagram of your own, shown in Meshcat, on any of the stations.

    python examples/own_diagram.py [--station cell|twin|hardware] [--seconds 0.2]

`make_station` returns a Drake diagram like any other: add it to a builder and connect
its inputs. Behind the hardware are played devices, or those of --hardware-config FILE.
"""

import argparse

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

from drake_disasm.stations import STATIONS, Station, make_station
from drake_disasm.stations.fake_cell.lockstep import fake_hardware
from drake_disasm.visualization import add_cell_view, start_meshcat

SCENARIO = "removal"  # without effects, which hardware refuses


def hold(station: Station, seconds: float) -> None:
    """Holds the bolt at A for a time [s], and prints what the sensor reads."""
    builder = DiagramBuilder()
    builder.AddNamedSystem("station", station)
    commands = {f"{station.arm}.position": station.start}  # rad; the twin's m, rad
    if station.grip_command is not None:  # the twin has no gripper
        commands["gripper.position"] = [station.grip_command]  # m
    for port, value in commands.items():
        source = builder.AddNamedSystem(port, ConstantVectorSource(value))
        builder.Connect(source.get_output_port(), station.GetInputPort(port))
    sink = LogVectorOutput(station.GetOutputPort("ft_sensor.wrench"), builder, 0.05)
    meshcat = start_meshcat()
    add_cell_view(builder, station, meshcat)

    simulator = Simulator(builder.Build())
    station.attach(simulator)
    simulator.set_target_realtime_rate(1.0)
    context = station.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    station.begin(context)  # hardware connects here; the others are there already
    print(f"watch at {meshcat.web_url()}")
    simulator.AdvanceTo(seconds)

    log = sink.FindLog(simulator.get_context())
    print("time [s]   force on the sensor [N], with the tool's weight")
    for time, wrench in zip(log.sample_times(), log.data().T, strict=True):
        print(f"{time:8.2f}   {' '.join(f'{f:7.2f}' for f in wrench[:3])}")
    q = station.GetOutputPort(f"{station.arm}.position_measured").Eval(context)
    moved = 1e6 * abs(station.coordinates.pose(q).translation()).max()
    print(f"the bolt is held at A: measured {moved:.1f} micrometres from it")
    if station.HasOutputPort("bolt_pose"):  # see station.simulation_only
        p = station.GetOutputPort("bolt_pose").Eval(context).translation()
        print(f"and truly {1e6 * abs(p).max():.1f}, which only a simulation knows")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--station", choices=STATIONS, default="cell")
    parser.add_argument("--hardware-config")
    parser.add_argument("--seconds", type=float, default=0.2)
    args = parser.parse_args()
    if args.station == "hardware" and args.hardware_config:
        with make_station("hardware", SCENARIO, config=args.hardware_config) as real:
            hold(real, args.seconds)
    elif args.station == "hardware":
        with fake_hardware(SCENARIO) as fake:
            hold(fake.station, args.seconds)
    else:
        hold(make_station(args.station, SCENARIO), args.seconds)

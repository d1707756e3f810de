"""A path of the bolt in space, played on the arm.

    python examples/cartesian_command.py

`station.coordinates.solve(X_GB, near)` returns the joint angles for the bolt at the
pose X_GB in the groove's frame, `pose` the pose of joint angles.
"""

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from drake_disasm.stations import make_station


def main() -> None:
    """Slides the bolt by 10 mm in a second, while it turns by 0.5 degrees and back."""
    station = make_station("cell", "removal")
    times = np.linspace(0.0, 1.0, 21)  # s
    joints = [station.start]
    for t in times[1:]:
        x, turn = 0.01 * t**2 * (3 - 2 * t), np.deg2rad(0.5) * np.sin(np.pi * t) ** 2
        X_GB = RigidTransform(RollPitchYaw(0.0, turn, 0.0), [x, 0.0, 0.0])
        joints.append(station.coordinates.solve(X_GB, near=joints[-1]))
    path = PiecewisePolynomial.CubicShapePreserving(times, np.array(joints).T, True)

    builder = DiagramBuilder()
    builder.AddNamedSystem("station", station)
    for port, source in {
        "iiwa.position": TrajectorySource(path),
        "gripper.position": ConstantVectorSource([station.grip_command]),
    }.items():
        builder.AddSystem(source)
        builder.Connect(source.get_output_port(), station.GetInputPort(port))
    simulator = Simulator(builder.Build())
    context = station.GetMyContextFromRoot(simulator.get_context())
    print("time [s]   x [mm]: commanded, measured   turn [deg]: commanded, measured")
    for time in times[::5]:
        simulator.AdvanceTo(time)
        measured = station.GetOutputPort("iiwa.position_measured").Eval(context)
        poses = [station.coordinates.pose(q) for q in (path.value(time).T[0], measured)]
        x = [f"{1e3 * X_GB.translation()[0]:9.2f}" for X_GB in poses]
        turn = [RollPitchYaw(X_GB.rotation()).pitch_angle() for X_GB in poses]
        print(
            f"{time:8.2f}   ", *x, "        ", *(f"{np.rad2deg(a):9.3f}" for a in turn)
        )


if __name__ == "__main__":
    main()

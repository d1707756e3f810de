"""A force from outside on any body of a simulated station.

    python examples/outside_force.py

The input `applied_spatial_force` of cell and twin takes what Drake's MultibodyPlant
takes: a list of forces, each on a body, at a point of it, in the world's axes.
"""

import numpy as np
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.systems.analysis import Simulator

from drake_disasm.stations import make_station


def main() -> None:
    """Pulls on the bolt, then on the arm, and prints what sensor and drives feel."""
    station = make_station("cell", "removal")
    simulator = Simulator(station)
    context = simulator.get_mutable_context()
    station.GetInputPort("iiwa.position").FixValue(context, station.start)
    station.GetInputPort("gripper.position").FixValue(context, [station.grip_command])
    f_W = station.X_WG.rotation() @ np.array([5.0, 0.0, 0.0])  # N, along the groove
    pull = ExternallyAppliedSpatialForce()
    pull.p_BoBq_B = np.zeros(3)  # at the body's origin
    pull.F_Bq_W = SpatialForce(tau=np.zeros(3), f=f_W)
    print("5 N on         force on the sensor [N]   torque of the drives [N m]")
    for name in ("nothing", "bolt", "iiwa_link_4"):
        forces = []
        if name != "nothing":
            pull.body_index = station.plant.GetBodyByName(name).index()
            forces = [pull]
        station.GetInputPort("applied_spatial_force").FixValue(context, forces)
        simulator.AdvanceTo(context.get_time() + 0.5)
        wrench = station.GetOutputPort("ft_sensor.wrench").Eval(context)
        torque = station.GetOutputPort("iiwa.torque_measured").Eval(context)
        print(f"{name:12}", *(f"{value:7.2f}" for value in [*wrench[:3], *torque]))


if __name__ == "__main__":
    main()

"""A ROS 2 bag such as a lab's: an iiwa in motion, with a load on a wrist sensor.

python examples/record_bag.py out/bag
python examples/record_bag.py out/bag out/motion/motion.csv     of excite

Simulated: two of its joints have dry friction that no model knows of. Times jitter, 2 %
of the messages are lost, and the sensor's clock is 12 ms late.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces
from scipy.interpolate import CubicSpline

from drake_disasm.common.resources import model_path, package_map
from drake_disasm.stations.fake_cell.bag import FakeBag, bag_times

FRICTION = np.array([0.0, 4.0, 0.0, 2.5, 0.0, 0.0, 0.0])  # N m
DURATION, LATE, LOAD = 20.0, 0.012, 2.0  # s, s, kg

plant = MultibodyPlant(0.0)
parser = Parser(plant)
parser.package_map().AddMap(package_map())
parser.AddModels(str(model_path("package://disasm_models/iiwa14/iiwa14.urdf")))
plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("iiwa_link_0"))
plant.Finalize()
context, flange = plant.CreateDefaultContext(), plant.GetBodyByName("iiwa_link_7")
names = [f"iiwa_joint_{i}" for i in range(1, 8)]
random = np.random.default_rng(2)
sine, cosine = random.uniform(-0.25, 0.25, (2, 5, 7))
time = np.linspace(0.0, DURATION, 4001)
wt = 2.0 * np.pi * 0.1 * np.outer(time, np.arange(1, 6))
path = CubicSpline(time, np.sin(wt) @ sine + (np.cos(wt) - 1.0) @ cosine)
if len(sys.argv) > 2:
    table = np.loadtxt(sys.argv[2], delimiter=",", skiprows=1)
    path = CubicSpline(table[:, 0], table[:, 1:8])


def motion(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns position, velocity and acceleration (7,)."""
    return path(t), path(t, 1), path(t, 2)


folder = Path(sys.argv[1] if len(sys.argv) > 1 else f"{tempfile.mkdtemp()}/bag")
bag = FakeBag()
for t in bag_times(random, DURATION, 200.0):
    q, v, vd = motion(t)
    plant.SetPositionsAndVelocities(context, np.concatenate([q, v]))
    tau = plant.CalcInverseDynamics(context, vd, MultibodyForces(plant))
    tau -= plant.CalcGravityGeneralizedForces(context)
    tau += FRICTION * np.tanh(v / 0.02) + 0.1 * random.standard_normal(7)
    order = random.permutation(7)  # as drivers do
    q = q + 1e-6 * random.standard_normal(7)
    bag.add_joint_state(t, [names[i] for i in order], q[order], tau[order])
for t in bag_times(random, DURATION, 500.0):
    q, v, vd = motion(t)
    plant.SetPositionsAndVelocities(context, np.concatenate([q, v]))
    A_WF = plant.CalcSpatialAccelerationsFromVdot(context, vd)[flange.index()]
    R_WF = plant.EvalBodyPoseInWorld(context, flange).rotation()
    pull = LOAD * (plant.gravity_field().gravity_vector() - A_WF.translational())
    wrench = np.concatenate([R_WF.inverse() @ pull, np.zeros(3)])
    bag.add_wrench(t + LATE, wrench + 0.05 * random.standard_normal(6))
bag.write(folder)
print(f"bag: {folder}: iiwa for {DURATION:g} s, wrench {1e3 * LATE:g} ms late")

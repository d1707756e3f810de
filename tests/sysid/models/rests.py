"""Logs of an arm's torques at rest, by Drake's gravity and by hand."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia, UnitInertia

from drake_disasm.cell.parsing import add_model, movable_joints
from drake_disasm.logs import Log, LogHeader, LogWriter, flat_columns, read_log

IIWA = "package://disasm_models/iiwa14/iiwa14.urdf"
IIWA_JOINTS = tuple(movable_joints(IIWA))
GRAVITY = 9.81  # m/s^2


def from_both_sides(poses: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Returns poses (n, joints), each reached from both sides by all joints (4 n, ...).

    Each joint comes from a side that is drawn.
    """
    beside = 0.1 * random.choice([-1.0, 1.0], poses.shape)
    stops = [poses + beside, poses, poses - beside, poses]
    return np.stack(stops, axis=1).reshape(-1, poses.shape[1])


def iiwa_poses(count: int, seed: int) -> np.ndarray:
    """Returns positions (4 count, 7) of the iiwa, as `from_both_sides` has them."""
    random = np.random.default_rng(seed)
    poses = random.uniform(-1.5, 1.5, (count, 7))
    poses[:, 3] = random.uniform(-1.8, -0.2, count)
    return from_both_sides(poses, random)


def iiwa_weight(
    q: np.ndarray,
    gravity: Sequence[float] = (0.0, 0.0, -GRAVITY),
    mass: float = 0.0,
    first_moment: Sequence[float] = (0.0, 0.0, 0.0),
) -> np.ndarray:
    """Returns the torques (n, 7) that hold the iiwa, by Drake.

    Args:
        q: (n, 7) positions.
        gravity: (3,) in the base's frame [m/s^2].
        mass: of a payload on the flange [kg].
        first_moment: of the payload, in the flange's frame [kg m].
    """
    plant = MultibodyPlant(0.0)
    plant.mutable_gravity_field().set_gravity_vector(gravity)
    arm = add_model(plant, IIWA)
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("iiwa_link_0"))
    if mass:
        centre = np.array(first_moment) / mass
        point = SpatialInertia(mass, centre, UnitInertia.PointMass(centre))
        load = plant.AddRigidBody("load", arm, point)
        flange = plant.GetFrameByName("iiwa_link_ee")
        plant.WeldFrames(flange, load.body_frame())
    plant.Finalize()
    context, found = plant.CreateDefaultContext(), []
    for pose in q:
        plant.SetPositions(context, pose)
        found.append(-plant.CalcGravityGeneralizedForces(context))
    return np.array(found)


def write_rests(
    folder: Path,
    urdf: str | Path,
    joints: Sequence[str],
    q: np.ndarray,
    tau: np.ndarray,
    time: np.ndarray | None = None,
) -> Log:
    """Writes a log of torques at rest (n, joints), and reads it."""
    header = LogHeader(
        "joint_torque_static", "hold", {}, joints=tuple(joints), urdf=str(urdf)
    )
    order = np.arange(len(q), dtype=float)
    clock = {"order": order} if time is None else {"time": time}
    columns = flat_columns("joint_torque_static", clock | {"q": q, "tau": tau})
    with LogWriter(folder, header) as writer:
        writer.write_episode(columns)
    return read_log(folder)

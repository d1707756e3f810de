"""Everything that stands in the cell, added to a plant."""

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import GeometryId
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, Frame

from drake_disasm.cell.arm_model import ArmModel, add_arm
from drake_disasm.cell.grip import Springs
from drake_disasm.cell.lock import Lock, add_lock
from drake_disasm.cell.parsing import add_model
from drake_disasm.cell.placement import bench_top
from drake_disasm.cell.sensor import (
    SensorModel,
    add_sensor_under_part,
    fixed_inertia,
)
from drake_disasm.cell.tool import ToolModels, add_tool, grasp_pose, grasp_rotation
from drake_disasm.effects import Environment
from drake_disasm.scenario import Scenario
from drake_disasm.stations.six_axis_spring import SixAxisSpring

_BENCH = "package://disasm_models/bench/bench.urdf"


@dataclass(frozen=True)
class CellModels:
    """Handles of the cell's models in a plant.

    Attributes:
        arm: on its base.
        tool: sensor and gripper.
        lock: groove and bolt.
        sensor: whose joint's reaction is read; None if there is none.
        bench: collision geometries of what lies under the part.
    """

    arm: ArmModel
    tool: ToolModels
    lock: Lock
    sensor: SensorModel | None
    bench: list[GeometryId]


def add_adaptive_fingers(
    plant: MultibodyPlant, models: ToolModels, springs: Springs
) -> SixAxisSpring:
    """Puts springs in the place of the fixed joint between palm and fingers.

    Args:
        plant: not yet finalized.
        models: of the gripper, added to it.
        springs: in the middle of the pads, along the axes of the bolt as gripped.
    """
    fixed = plant.GetJointByName("finger_carriage_joint", models.gripper)
    X_CT = models.frame_T.GetFixedPoseInBodyFrame()
    X_TA = RigidTransform(grasp_rotation(), np.zeros(3))  # A: the springs' axes
    on_palm = plant.AddFrame(
        FixedOffsetFrame("finger_springs", fixed.frame_on_parent(), X_CT @ X_TA)
    )
    on_carriage = plant.AddFrame(
        FixedOffsetFrame("sprung", models.carriage.body_frame(), X_CT @ X_TA)
    )
    plant.RemoveJoint(fixed)
    spring = SixAxisSpring(plant, "adaptive_fingers", on_palm, springs)
    plant.WeldFrames(spring.last.body_frame(), on_carriage)
    return spring


def hang_bolt(
    plant: MultibodyPlant, models: CellModels, springs: Springs, p_BoTo_B: np.ndarray
) -> SixAxisSpring:
    """Hangs the bolt on a tool without fingers, which it does not collide with.

    Args:
        plant: not yet finalized.
        models: of the cell, added to it.
        springs: at the tool's tcp, along the axes of the bolt as gripped.
        p_BoTo_B: (3,) of the tcp [m].
    """
    tool, bolt = models.tool, models.lock.bolt
    X_TA = RigidTransform(grasp_rotation(), np.zeros(3))  # A: the springs' axes
    on_tool = plant.AddFrame(FixedOffsetFrame("tool_springs", tool.frame_T, X_TA))
    on_bolt = plant.AddFrame(
        FixedOffsetFrame("hung", bolt.body_frame(), RigidTransform(p_BoTo_B))
    )
    spring = SixAxisSpring(plant, "tool_compliance", on_tool, springs)
    plant.WeldFrames(spring.last.body_frame(), on_bolt)
    return spring


def add_cell(
    plant: MultibodyPlant,
    frame_Gn: Frame,
    scenario: Scenario,
    environment: Environment | None = None,
    is_welded: bool = False,
) -> CellModels:
    """Adds arm, tool, lock and bench.

    Args:
        plant: not yet finalised.
        frame_Gn: the groove's nominal frame, fixed in the world.
        scenario: of the cell.
        environment: of the default Context; None is the nominal one.
        is_welded: whether the bolt is fixed to the gripper's tcp.

    Raises:
        DisasmError: a model file is missing or is of another device.
    """
    arm = add_arm(plant, scenario.arm)
    tool = add_tool(plant, arm.frame_F, scenario)
    under, lock = add_weighed_lock(plant, frame_Gn, scenario, environment)
    bench = _add_bench(plant, frame_Gn, scenario)
    if under:
        body = under.frame_S.body()
        bench += plant.GetCollisionGeometriesForBody(body)
    if is_welded:
        bolt = lock.bolt.body_frame()
        plant.WeldFrames(tool.frame_T, bolt, grasp_pose(scenario, tool))
    return CellModels(arm, tool, lock, under or tool.sensor, bench)


def add_weighed_lock(
    plant: MultibodyPlant,
    frame_Gn: Frame,
    scenario: Scenario,
    environment: Environment | None,
) -> tuple[SensorModel | None, Lock]:
    """Adds the part, on a sensor if the scenario has it there; see `add_lock`."""
    part, contact = scenario.part, scenario.contact
    if scenario.ft_sensor.place != "part":
        return None, add_lock(plant, frame_Gn, part, contact, environment)
    sensor, carried = add_sensor_under_part(plant, frame_Gn, scenario)
    M_G = fixed_inertia(scenario)
    return sensor, add_lock(plant, carried, part, contact, environment, M_G)


def _add_bench(
    plant: MultibodyPlant, frame_Gn: Frame, scenario: Scenario
) -> list[GeometryId]:
    """Puts the bench's top under the plate, level whatever the groove's yaw."""
    bench = add_model(plant, _BENCH)
    p_WTop = bench_top(frame_Gn.GetFixedPoseInBodyFrame(), scenario.part)
    top = plant.GetFrameByName("top", bench)
    plant.WeldFrames(plant.world_frame(), top, RigidTransform(p_WTop))
    return list(plant.GetCollisionGeometriesForBody(top.body()))

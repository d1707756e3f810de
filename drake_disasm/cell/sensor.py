"""The force/torque sensor in a plant: in the wrist, or under the fixed part.

Frames: S sensor, Gn the groove's nominal frame.
"""

import dataclasses

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    CalcSpatialInertia,
    FixedOffsetFrame,
    Frame,
    ModelInstanceIndex,
    SpatialInertia,
    WeldJoint,
)

from drake_disasm.cell.parsing import add_model, model_frame
from drake_disasm.cell.placement import MIDDLE
from drake_disasm.parts import Part
from drake_disasm.scenario import Scenario

_STEEL = 7850.0  # kg/m^3, of the fixed part on its sensor


@dataclasses.dataclass(frozen=True)
class SensorModel:
    """Handles of a sensor in a plant.

    Attributes:
        joint: the weld under the sensor, whose reaction is read; its child frame is S.
        frame_S: where the wrench is reported.
        tool_side: the face that carries what is weighed.
        instance: of the model.
    """

    joint: WeldJoint
    frame_S: Frame
    tool_side: Frame
    instance: ModelInstanceIndex

    @property
    def X_ToolSideS(self) -> RigidTransform:
        """The sensing frame from the face that carries."""
        X_CT, X_CS = (
            frame.GetFixedPoseInBodyFrame() for frame in (self.tool_side, self.frame_S)
        )
        return X_CT.inverse() @ X_CS


def add_sensor(plant: MultibodyPlant, on: Frame, url: str) -> SensorModel:
    """Adds a sensor whose link, with its origin on the lower face, sits on a frame.

    Raises:
        DisasmError: the model file is missing or is of another device.
    """
    instance = add_model(plant, url)
    frame_S = model_frame(plant, instance, "sensor", url)
    joint = plant.WeldFrames(on, frame_S, frame_S.GetFixedPoseInBodyFrame())
    tool_side = model_frame(plant, instance, "tool_side", url)
    return SensorModel(joint, frame_S, tool_side, instance)


def add_sensor_under_part(
    plant: MultibodyPlant, frame_Gn: Frame, scenario: Scenario
) -> tuple[SensorModel, Frame]:
    """Adds a sensor let into the bench, so that the part lies where it always does.

    Args:
        plant: not yet finalized.
        frame_Gn: the groove's nominal frame, fixed in the world.
        scenario: of the cell.

    Returns:
        The sensor, and a frame at Gn that it carries.
    """
    url, X_GnTop = scenario.ft_sensor.model, _top(scenario.part)
    height = _height(url)
    X_GnBase = X_GnTop @ RigidTransform([0.0, 0.0, -height])
    base = plant.AddFrame(FixedOffsetFrame("sensor_base", frame_Gn, X_GnBase))
    sensor = add_sensor(plant, base, url)
    X_TopGn = X_GnTop.inverse()
    carried = FixedOffsetFrame("groove_carried", sensor.tool_side, X_TopGn)
    return sensor, plant.AddFrame(carried)


def sensor_under_part(scenario: Scenario) -> tuple[RigidTransform, SpatialInertia]:
    """Returns X_GnS of a sensor under the fixed part, and what it carries.

    That is the part and the sensor's own body, about So in S.
    """
    plant = MultibodyPlant(0.0)
    sensor = add_sensor(plant, plant.world_frame(), scenario.ft_sensor.model)
    plant.Finalize()
    X_GS = _top(scenario.part) @ sensor.X_ToolSideS
    M_G = fixed_inertia(scenario)
    carried = M_G.Shift(X_GS.translation()).ReExpress(X_GS.rotation().inverse())
    bodies = plant.GetBodyIndices(sensor.instance)
    context = plant.CreateDefaultContext()
    carried += plant.CalcSpatialInertia(context, sensor.frame_S, bodies)
    return X_GS, carried


def fixed_inertia(scenario: Scenario) -> SpatialInertia:
    """Returns that of the fixed part's nominal solids, of steel, about Go in G."""
    part = scenario.part
    total = SpatialInertia.Zero()
    for X_GP, shape in part.fixed_solids(part.environment(scenario.contact)).values():
        M_P = CalcSpatialInertia(shape, _STEEL)
        total += M_P.ReExpress(X_GP.rotation()).Shift(-X_GP.translation())
    return total


def _top(part: Part) -> RigidTransform:
    """Returns the face in Gn that carries the part: z up, under the part's middle."""
    R = RotationMatrix(np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]]))
    return RigidTransform(R, [MIDDLE, part.bottom, 0.0])


def _height(url: str) -> float:
    """Returns a sensor's height from the lower face to the one that carries [m]."""
    plant = MultibodyPlant(0.0)
    face = add_sensor(plant, plant.world_frame(), url).tool_side
    return float(face.GetFixedPoseInBodyFrame().translation()[2])

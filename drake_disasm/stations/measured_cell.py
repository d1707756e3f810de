"""The cell's geometry posed by measurements, for a view of the real cell."""

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import MatrixGain, Multiplexer
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from drake_disasm.cell.placement import nominal_groove_pose
from drake_disasm.scenario import Scenario
from drake_disasm.stations.base import add_nominal_groove
from drake_disasm.stations.cell_models import add_cell


def measured_ports(scenario: Scenario) -> tuple[str, str]:
    """Returns a MeasuredCell's inputs, which are outputs of a station of the cell."""
    return f"{scenario.arm.name}.position_measured", "gripper.state_measured"


class MeasuredCell(Diagram):
    """Arm, fingers and lock, posed by measurements; the bolt sits as it was gripped.

    The arm's port has its name, "iiwa" here.

    @system
    name: MeasuredCell
    input_ports:
    - iiwa.position_measured
    - gripper.state_measured
    output_ports:
    - query_object
    @endsystem

    Args:
        scenario: of the cell.
    """

    def __init__(self, scenario: Scenario) -> None:
        super().__init__()
        builder = DiagramBuilder()
        graph = builder.AddNamedSystem("scene_graph", SceneGraph())
        plant = MultibodyPlant(0.0)
        source = plant.RegisterAsSourceForSceneGraph(graph)
        frame_Gn = add_nominal_groove(plant, nominal_groove_pose(scenario.placement))
        models = add_cell(plant, frame_Gn, scenario, is_welded=True)
        joints, count = len(models.arm.joints), len(models.tool.fingers)
        plant.Finalize()
        sizes = [joints, count] if count else [joints]
        position = builder.AddNamedSystem("position", Multiplexer(sizes))
        halves = np.array([[0.5, 0.0], [0.5, 0.0]])
        fingers = builder.AddNamedSystem("fingers", MatrixGain(D=halves))
        if count:
            builder.Connect(fingers.get_output_port(), position.get_input_port(1))
        inputs = (position.get_input_port(0), fingers.get_input_port())
        for name, port in zip(measured_ports(scenario), inputs, strict=True):
            builder.ExportInput(port, name)
        poses = builder.AddNamedSystem("poses", MultibodyPositionToGeometryPose(plant))
        builder.Connect(position.get_output_port(), poses.get_input_port())
        builder.Connect(poses.get_output_port(), graph.get_source_pose_port(source))
        builder.ExportOutput(graph.get_query_output_port(), "query_object")
        builder.BuildInto(self)

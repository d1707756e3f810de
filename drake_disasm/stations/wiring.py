"""Parts that simulated stations have in common, added to their diagrams."""

from collections.abc import Mapping

import numpy as np
from pydrake.common import RandomDistribution
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    MultibodyPlant,
    MultibodyPlantConfig,
)
from pydrake.systems.framework import DiagramBuilder, InputPort, OutputPort
from pydrake.systems.primitives import ConstantVectorSource, RandomSource

from drake_disasm.cell.lock import Lock
from drake_disasm.common.ports import Health
from drake_disasm.devices.ft_sensor import ForceTorqueSensor
from drake_disasm.scenario import SimulationConfig
from drake_disasm.systems.bolt_pose import BoltPose
from drake_disasm.systems.required_input import RequiredInput
from drake_disasm.systems.step_clock import StepClock


def add_plant(
    builder: DiagramBuilder, simulation: SimulationConfig, time_step: float
) -> tuple[MultibodyPlant, SceneGraph]:
    """Returns plant and scene graph, added to a station.

    Args:
        builder: of the station.
        simulation: how contact is solved.
        time_step: of the discrete plant [s].
    """
    config = MultibodyPlantConfig(
        time_step=time_step,
        stiction_tolerance=simulation.stiction_tolerance,
        discrete_contact_approximation=simulation.contact_approximation,
        contact_model="hydroelastic_with_fallback",
    )
    plant, scene_graph = AddMultibodyPlant(config, builder)
    return plant, scene_graph


def export_required(
    builder: DiagramBuilder, port: InputPort, name: str, remedy: str
) -> None:
    """Exports an input of a station, without which no simulation begins.

    Args:
        builder: of the station.
        port: that takes the command.
        name: of the station's port.
        remedy: what to do if it is not connected, for the message.
    """
    check = RequiredInput(name, port.size(), remedy)
    builder.AddNamedSystem(f"{name.replace('.', '_')}_required", check)
    builder.ExportInput(port, name)
    builder.ConnectInput(name, check.get_input_port())


def wire_sensor(
    builder: DiagramBuilder,
    sensor: ForceTorqueSensor,
    inputs: Mapping[str, OutputPort],
    period: float,
) -> RandomSource:
    """Connects a force/torque sensor to its source, and exports what it reads.

    Args:
        builder: of the station.
        sensor: not yet in the diagram.
        inputs: what its source's ports read, by their names.
        period: of its noise [s].

    Returns:
        The source of its noise.
    """
    builder.AddNamedSystem("ft_sensor", sensor)
    noise = builder.AddNamedSystem(
        "ft_sensor_noise", RandomSource(RandomDistribution.kGaussian, 6, period)
    )
    for name, port in {**inputs, "noise": noise.get_output_port()}.items():
        builder.Connect(port, sensor.GetInputPort(name))
    for quantity in ("wrench", "health", "time_measured"):
        builder.ExportOutput(sensor.GetOutputPort(quantity), f"ft_sensor.{quantity}")
    return noise


def reaction_ports(plant: MultibodyPlant) -> dict[str, OutputPort]:
    """Returns what a `JointReaction` reads of its plant, by the names of its ports."""
    return {
        "reaction_forces": plant.get_reaction_forces_output_port(),
        "body_poses": plant.get_body_poses_output_port(),
    }


def export_ready_device(builder: DiagramBuilder, name: str, time_step: float) -> None:
    """Exports health and sample time of a device that never fails."""
    ready = builder.AddNamedSystem(
        f"{name}_health", ConstantVectorSource(np.array([float(Health.READY)]))
    )
    clock = builder.AddNamedSystem(f"{name}_clock", StepClock(time_step))
    builder.ExportOutput(ready.get_output_port(), f"{name}.health")
    builder.ExportOutput(clock.get_output_port(), f"{name}.time_measured")


def export_bolt_pose(
    builder: DiagramBuilder, plant: MultibodyPlant, lock: Lock, X_WG: RigidTransform
) -> None:
    """Exports where the bolt truly is, X_GnB and X_GB."""
    bodies = lock.bolt.index(), lock.groove.index()
    truth = builder.AddNamedSystem("bolt_pose", BoltPose(*bodies, X_WG))
    builder.Connect(plant.get_body_poses_output_port(), truth.get_input_port())
    builder.ExportOutput(truth.GetOutputPort("X_GnB"), "bolt_pose")
    builder.ExportOutput(truth.GetOutputPort("X_GB"), "bolt_pose_in_groove")

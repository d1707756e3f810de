"""The real arm in a diagram: its status and its commands, by LCM."""

from drake import lcmt_iiwa_command, lcmt_iiwa_status
from pydrake.manipulation import (
    IiwaCommandSender,
    IiwaControlMode,
    IiwaStatusReceiver,
)
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.lcm import (
    LcmInterfaceSystem,
    LcmPublisherSystem,
    LcmSubscriberSystem,
)
from pydrake.systems.primitives import Gain

from drake_disasm.common.timing import COMMAND_DELAY
from drake_disasm.stations.cell_devices import CellDevices
from drake_disasm.stations.hardware_config import IiwaConnection


def export_status(
    builder: DiagramBuilder, devices: CellDevices, config: IiwaConnection
) -> None:
    """Exports what the arm's driver sends, in Drake's signs.

    Args:
        builder: of the station.
        devices: whose LCM is listened to, after the monitor has checked it.
        config: the arm's channels.
    """
    add, connect = builder.AddNamedSystem, builder.Connect
    add("lcm", LcmInterfaceSystem(devices.lcm))
    add("lcm_checked", LcmInterfaceSystem(devices.checked_lcm))
    status = add(
        "iiwa_status",
        LcmSubscriberSystem.Make(
            config.status_channel,
            lcmt_iiwa_status,
            devices.checked_lcm,
            use_cpp_serializer=True,
        ),
    )
    receiver = add("iiwa_receiver", IiwaStatusReceiver())
    connect(status.get_output_port(), receiver.get_input_port())
    for quantity in ("position_commanded", "velocity_estimated", "torque_external"):
        builder.ExportOutput(receiver.GetOutputPort(quantity), f"iiwa.{quantity}")
    for quantity in ("torque_commanded", "torque_measured"):
        # The driver sends these two with KUKA's sign (drake/manipulation/README).
        drakes = add(f"iiwa_{quantity}", Gain(-1.0, 7))
        connect(receiver.GetOutputPort(quantity), drakes.get_input_port())
        builder.ExportOutput(drakes.get_output_port(), f"iiwa.{quantity}")


def send_commands(
    builder: DiagramBuilder,
    position: OutputPort,
    devices: CellDevices,
    config: IiwaConnection,
    period: float,
) -> None:
    """Sends positions to the arm's driver.

    Args:
        builder: of the station.
        position: (7,) joint angles [rad].
        devices: whose LCM is used.
        config: the arm's channels.
        period: between commands [s].
    """
    add, connect = builder.AddNamedSystem, builder.Connect
    sender = add("iiwa_sender", IiwaCommandSender(7, IiwaControlMode.kPositionOnly))
    publisher = add(
        "iiwa_command",
        LcmPublisherSystem.Make(
            config.command_channel,
            lcmt_iiwa_command,
            devices.lcm,
            publish_period=period,
            publish_offset=COMMAND_DELAY,
            use_cpp_serializer=True,
        ),
    )
    connect(position, sender.get_input_port(0))
    connect(sender.get_output_port(), publisher.get_input_port())

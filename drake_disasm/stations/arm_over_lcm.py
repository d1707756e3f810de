"""The real arm in a diagram: its status and its commands, by LCM."""

from collections.abc import Callable

import numpy as np
from drake import lcmt_iiwa_status
from pydrake.manipulation import IiwaStatusReceiver
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.lcm import LcmInterfaceSystem, LcmSubscriberSystem
from pydrake.systems.primitives import Gain

from drake_disasm.devices.iiwa import encode_command
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


def command_sender(
    devices: CellDevices, config: IiwaConnection
) -> Callable[[np.ndarray, float], None]:
    """Returns what sends joint positions (7,) [rad] of a time [s] to the arm's driver.

    Args:
        devices: whose LCM is used.
        config: the arm's channels.
    """

    def send(position: np.ndarray, time: float) -> None:
        """Sends one command, and says so first: it comes back as others' do."""
        devices.commands.sent(position)
        devices.lcm.Publish(config.command_channel, encode_command(position, time))

    return send

"""The real arm in a diagram: its status, by LCM."""

from drake import lcmt_iiwa_status
from pydrake.manipulation import IiwaStatusReceiver
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.lcm import LcmInterfaceSystem, LcmSubscriberSystem
from pydrake.systems.primitives import Gain

from drake_disasm.stations.cell_devices import CellDevices
from drake_disasm.stations.hardware_config import IiwaConnection


def export_status(
    builder: DiagramBuilder, devices: CellDevices, config: IiwaConnection
) -> None:
    """Exports what the arm's driver sends, in Drake's signs.

    `CellDevices.pump` alone handles the driver's own messages. An LcmInterfaceSystem
    would do so while the simulator runs without Python's lock, which pydrake's handlers
    need: they allocate memory before they take it.

    Args:
        builder: of the station.
        devices: whose messages are exported, after the monitor has checked them.
        config: the arm's channels.
    """
    add, connect = builder.AddNamedSystem, builder.Connect
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

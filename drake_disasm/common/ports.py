"""The stations' ports, declared once as data.

Every station (simulated cell, hardware, twin) is held to its table by
`check_ports`; tests compare them in both directions.
"""

import dataclasses
import enum

from pydrake.systems.framework import PortDataType, System

from drake_disasm.common.errors import DisasmError


class Health(enum.IntEnum):
    """State of a device, carried as a number on its `<device>.health` port."""

    NO_DATA = 0
    READY = 1
    WARNING = 2
    ERROR = 3
    STALE = 4


@dataclasses.dataclass(frozen=True)
class Port:
    """One vector port.

    Attributes:
        name: `<device>.<quantity>`.
        size: number of elements.
        unit: SI unit.
        frame: what the value is measured in and of, "-" where none.
        is_input: whether the station reads it.
    """

    name: str
    size: int
    unit: str
    frame: str
    is_input: bool = False


_WRENCH_FRAME = "load on the sensor (none: the flange), at So, in S, [f; tau], untared"


def _device(name: str) -> tuple[Port, ...]:
    return (
        Port(f"{name}.health", 1, "1", "drake_disasm.common.ports.Health"),
        Port(f"{name}.time_measured", 1, "s", "when the newest sample was taken"),
    )


def cell_ports(arm: str, joints: int) -> tuple[Port, ...]:
    """Returns the ports of the cell, simulated or real. Torques have Drake's sign.

    Args:
        arm: name of the arm, `arm.name` of a scenario.
        joints: number of its joints.
    """
    where = f"joints 1 to {joints}"
    return (
        Port(f"{arm}.position", joints, "rad", where, is_input=True),
        Port("gripper.position", 1, "m", "opening between the pads", is_input=True),
        Port(f"{arm}.position_commanded", joints, "rad", where),
        Port(f"{arm}.position_measured", joints, "rad", where),
        Port(f"{arm}.velocity_estimated", joints, "rad/s", where),
        Port(f"{arm}.torque_commanded", joints, "N m", where),
        Port(f"{arm}.torque_measured", joints, "N m", where),
        Port(
            f"{arm}.torque_external", joints, "N m", f"{where}; bolt part of the tool"
        ),
        Port("gripper.state_measured", 2, "m, m/s", "opening and its rate"),
        Port("ft_sensor.wrench", 6, "N, N m", _WRENCH_FRAME),
        *_device(arm),
        *_device("gripper"),
        *_device("ft_sensor"),
    )


#: Ports of the twin: the bolt stands for the arm.
TWIN_PORTS: tuple[Port, ...] = (
    Port(
        "bolt.position",
        6,
        "m, rad",
        "B in Gn: x, y, z, turns about z, x, y",
        is_input=True,
    ),
    Port("bolt.velocity", 6, "m/s, rad/s", "rate of bolt.position", is_input=True),
    Port(
        "bolt.position_measured", 6, "m, rad", "B in Gn: x, y, z, turns about z, x, y"
    ),
    Port("ft_sensor.wrench", 6, "N, N m", _WRENCH_FRAME),
    *_device("bolt"),
    *_device("ft_sensor"),
)


def check_ports(system: System, table: tuple[Port, ...]) -> None:
    """Raises DisasmError unless the system has each port of the table, and size.

    Ports that only a simulation has carry no dot-name from the table and are
    not vector ports of a device; they are allowed in addition.
    """
    differences = port_differences(system, table)
    if differences:
        raise DisasmError(f"{system.get_name()}: {'; '.join(differences)}")


def port_differences(system: System, table: tuple[Port, ...]) -> list[str]:
    """Returns what is missing, extra or of another size, in words."""
    declared = {(p.name, p.is_input): p.size for p in table}
    actual = _vector_ports(system)
    words = [f"port {name} is missing" for name, _ in declared.keys() - actual.keys()]
    words += [f"port {name} is extra" for name, _ in actual.keys() - declared.keys()]
    words += [
        f"port {key[0]} has size {actual[key]}, not {declared[key]}"
        for key in declared.keys() & actual.keys()
        if actual[key] != declared[key]
    ]
    return sorted(words)


def _vector_ports(system: System) -> dict[tuple[str, bool], int]:
    ports: dict[tuple[str, bool], int] = {}
    for i in range(system.num_input_ports()):
        port = system.get_input_port(i)
        if port.get_data_type() == PortDataType.kVectorValued:
            ports[port.get_name(), True] = port.size()
    for i in range(system.num_output_ports()):
        out = system.get_output_port(i)
        if out.get_data_type() == PortDataType.kVectorValued:
            ports[out.get_name(), False] = out.size()
    return ports

"""Where the devices are and what they may do: a hardware configuration."""

import dataclasses
from pathlib import Path

import numpy as np

from drake_disasm.cell.arm_model import arm_joints
from drake_disasm.common.bounded_yaml import MOST_BYTES
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_text
from drake_disasm.common.quantity import check, quantity
from drake_disasm.mdp import TaskGeometry
from drake_disasm.safety import SafetyConfig
from drake_disasm.scenario import CONTROLS, Scenario
from drake_disasm.scenario.strict_yaml import parse

#: Of the arm that the hardware station drives.
IIWA_JOINTS = 7
_ROUNDING = 1e-9  # m


@dataclasses.dataclass
class IiwaConnection:
    """The arm, behind drake-iiwa-driver."""

    control: str = quantity(
        "position", "", "mode of the Sunrise application that runs on the cabinet",
        choices=CONTROLS,
    )  # fmt: skip
    lcm_url: str = quantity("", "", "of LCM; empty is LCM's own default")
    command_channel: str = quantity("IIWA_COMMAND", "", "LCM channel")
    status_channel: str = quantity("IIWA_STATUS", "", "LCM channel")
    status_period: float = quantity(
        0.005, "s", "between the driver's messages", low=0.001, high=0.1
    )


@dataclasses.dataclass
class SensorConnection:
    """The OnRobot HEX behind its Compute Box."""

    address: str = quantity("192.168.1.1", "", "of the Compute Box")
    port: int = quantity(49152, "1", "UDP", low=1, high=65535)
    period: float = quantity(0.01, "s", "between samples", low=0.002, high=0.5)
    filter_hz: float = quantity(
        15.0, "Hz", "of the box's low-pass: 0 (none), 500, 150, 50, 15, 5 or 1.5",
        low=0.0, high=500.0,
    )  # fmt: skip


@dataclasses.dataclass
class GripperConnection:
    """The Robotiq 2F-140 by Modbus."""

    transport: str = quantity(
        "rtu_over_tcp", "", "how its registers are reached",
        choices=("rtu_over_tcp", "tcp", "serial"),
    )  # fmt: skip
    address: str = quantity("192.168.1.11", "", "host, or the serial port's path")
    port: int = quantity(502, "1", "TCP", low=1, high=65535)
    device_id: int = quantity(9, "1", "Modbus", low=0, high=247)
    speed: float = quantity(0.05, "m/s", "of the fingers", low=0.03, high=0.25)
    force: float = quantity(60.0, "N", "of the fingers", low=10.0, high=125.0)
    activate: bool = quantity(
        False, "", "activate it at the start: opens and closes it fully, once"
    )


@dataclasses.dataclass
class HardwareConfig:
    """All of it; what a file does not say has these defaults."""

    iiwa: IiwaConnection = dataclasses.field(default_factory=IiwaConnection)
    ft_sensor: SensorConnection = dataclasses.field(default_factory=SensorConnection)
    gripper: GripperConnection = dataclasses.field(default_factory=GripperConnection)
    safety: SafetyConfig = dataclasses.field(default_factory=SafetyConfig)
    ready_timeout: float = quantity(
        10.0, "s", "until every device must have answered", low=0.1, high=600.0
    )
    start_distance: float = quantity(
        0.05, "rad", "of a joint from where an episode starts", low=0.001, high=0.5
    )
    tare_samples: int = quantity(
        50, "1", "readings that are averaged at the start", low=1, high=10000
    )


def load_hardware_config(path: Path) -> HardwareConfig:
    """Returns the configuration of a YAML file.

    Raises:
        DisasmError: missing file, unknown key, bad value; says which and where.
    """
    text = read_text(path, "copy models/hardware/cell.yaml and fill it in", MOST_BYTES)
    config: HardwareConfig = parse(text, HardwareConfig(), str(path))
    try:
        check(config)
    except DisasmError as error:
        raise DisasmError(f"{path}: {error}") from None
    return config


def refuse_narrow_guard(scenario: Scenario, limits: SafetyConfig) -> None:
    """Refuses a guard within the task's workspace: it would hold before the task ends.

    The task's is the one that decides; the guard is for an arm that goes on.

    Raises:
        DisasmError: names the first side of the guard's workspace that is too near.
    """
    task, margin = TaskGeometry.of(scenario), limits.workspace_margin
    for side, wanted, sign in (("low", task.low, -1.0), ("high", task.high, 1.0)):
        guarded = np.array(getattr(limits, f"workspace_{side}"))
        least = wanted + sign * margin
        short = sign * (guarded - least) < -_ROUNDING
        if short.any():
            axis = int(np.argmax(short))
            raise DisasmError(
                f"safety.workspace_{side}.{axis}: {guarded[axis]:g} m would hold the "
                f"arm before the task's workspace (task.room) and a margin end at "
                f"{least[axis]:g} m; widen it, or give the task less room"
            )


def refuse_another_arm(scenario: Scenario) -> None:
    """Refuses an arm that there is no driver of.

    Raises:
        DisasmError: says what can be done with it.
    """
    arm, joints = scenario.arm, len(arm_joints(scenario.arm))
    if arm.name != "iiwa" or joints != IIWA_JOINTS:
        raise DisasmError(
            f"arm.name: hardware drives an arm called iiwa, of {IIWA_JOINTS} joints, "
            f"and this one is '{arm.name}' of {joints}; use `station` cell, or name "
            "the iiwa in section arm"
        )


def refuse_another_control(scenario: Scenario, config: HardwareConfig) -> None:
    """Refuses a scenario that asks for another control than the cabinet runs.

    Nothing that the arm sends tells which; so the file has to say.

    Raises:
        DisasmError: names both, and how to agree.
    """
    wanted, declared = scenario.arm.control, config.iiwa.control
    if wanted != declared:
        raise DisasmError(
            f"iiwa.control: the cabinet is said to run '{declared}', the scenario's "
            f"arm.control is '{wanted}'; start the Sunrise application in that mode "
            "(docs/guides/hardware.md), then say so in the file, or change the scenario"
        )

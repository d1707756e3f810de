"""The real cell: the simulated one's ports, with devices behind them."""

import dataclasses
import time
from collections.abc import Callable, Sequence
from typing import Self

import numpy as np
from pydrake.lcm import DrakeLcm
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, DiagramBuilder

from drake_disasm.cell.arm_control import yielding
from drake_disasm.cell.arm_description import refuse_unlimited_arm
from drake_disasm.cell.arm_model import add_arm
from drake_disasm.cell.arm_wrench import ArmWrench
from drake_disasm.cell.coordinates import ArmCoordinates
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.ports import Health, check_ports
from drake_disasm.common.stopwatch import Stopwatch
from drake_disasm.devices.reading import Clock, Reading
from drake_disasm.effects import Effect
from drake_disasm.effects.refusals import refuse_on_hardware
from drake_disasm.safety import Mode, Retreat, Supervisor, guards
from drake_disasm.scenario import ArmConfig, Scenario, validate
from drake_disasm.stations.arm_over_lcm import export_status
from drake_disasm.stations.base import InitialState, Station, refuse_twins_contact
from drake_disasm.stations.cell_devices import CellDevices
from drake_disasm.stations.hardware_config import (
    HardwareConfig,
    refuse_another_arm,
    refuse_another_control,
    refuse_narrow_guard,
)
from drake_disasm.stations.wiring import export_required
from drake_disasm.systems.command_gate import CommandGate
from drake_disasm.systems.device_reader import DeviceReader

_LOOKS = 3.0  # samples of arm and sensor that are due before motion goes on
_SIZES = {"iiwa": 7, "gripper": 2, "ft_sensor": 6}
_VALUES = {
    "iiwa": "position_measured",
    "gripper": "state_measured",
    "ft_sensor": "wrench",
}


class HoldError(DisasmError):
    """The robot is held where it is; only `resume` ends that."""


class HardwareStation(Station):
    """KUKA iiwa, OnRobot HEX and Robotiq 2F-140 behind their own protocols.

    A scenario without a sensor takes the arm's own estimate of the wrench.

    Commands reach the devices through a CommandGate. `begin` connects the devices, and
    `close` disconnects them; a simulation before `begin` is refused. A dry run reads
    the devices and sends nothing.

    @system
    name: HardwareStation
    input_ports:
    - iiwa.position
    - gripper.position
    output_ports:
    - iiwa.position_commanded
    - iiwa.position_measured
    - iiwa.velocity_estimated
    - iiwa.torque_commanded
    - iiwa.torque_measured
    - iiwa.torque_external
    - iiwa.health
    - iiwa.time_measured
    - gripper.state_measured
    - gripper.health
    - gripper.time_measured
    - ft_sensor.wrench
    - ft_sensor.health
    - ft_sensor.time_measured
    @endsystem

    Attributes:
        supervisor: lets commands through, or holds.
        gate: by which commands get to the devices.
        allowed_lead: (7,) of the joints' commands before what is measured [rad].
        devices: clients by name.

    Args:
        scenario: of the task; without effects, which act on simulated plants.
        config: where the devices are, and limits.
        dry_run: whether nothing is sent to any device that moves.
        clock: tells when samples come [s].
        wait: lets a time [s] pass while devices answer.
        lcm: to reach the arm by, instead of the configured one.
    """

    kind = "hardware"
    has_velocity_input = False
    start_is_reusable = False

    def __init__(
        self,
        scenario: Scenario,
        config: HardwareConfig,
        dry_run: bool = False,
        clock: Clock = time.monotonic,
        wait: Callable[[float], None] = time.sleep,
        lcm: DrakeLcm | None = None,
    ) -> None:
        super().__init__()
        validate(scenario)
        refuse_what_is_simulated(scenario)
        refuse_another_arm(scenario)
        refuse_narrow_guard(scenario, config.safety)
        self.scenario, self.config, self.dry_run = scenario, config, dry_run
        self._set_arm()
        has_sensor = scenario.ft_sensor.place != "none"
        self._cell = CellDevices(
            config,
            not dry_run,
            clock,
            wait,
            lcm,
            None if has_sensor else self._estimated(scenario.arm),
        )
        self.devices = self._cell.clients
        refuse_another_control(scenario, config)
        self._set_cell_geometry()
        self.allowed_lead = self._allowed_lead()
        self.g_W = MultibodyPlant(0.0).gravity_field().gravity_vector()
        self.grip_command = 0.0  # closes until the fingers stall on the bolt
        self.supervisor = _supervisor(
            scenario.arm, config, self._retreat(), self.allowed_lead
        )
        builder = DiagramBuilder()
        export_status(builder, self._cell, config.iiwa)
        self._wire_gate(builder)
        for name in self.devices:
            self._export_reader(builder, name)
        builder.BuildInto(self)
        check_ports(self, self.table)

    @property
    def initial_state(self) -> InitialState:
        """See Station.

        Raises:
            DisasmError: always: only the devices know.
        """
        raise DisasmError(
            "the hardware station begins where its arm is; call station.begin(context)"
        )

    def refuse_effects(self, effects: Sequence[Effect]) -> None:
        """See Station: all of them."""
        refuse_on_hardware(effects)

    def begin(
        self, context: Context, effects: Sequence[Effect] | None = None
    ) -> InitialState:
        """See Station: waits for every device, and zeroes the sensor where the arm is.

        Raises:
            DisasmError: effects are set; a device does not answer; the arm is not at
                the start; the robot is held.
        """
        self.refuse_effects(effects or ())
        self.check()
        self.connect()
        self._cell.await_ready()
        position = self.devices["iiwa"].read().values
        self._refuse_far_start(position)
        reading = self._cell.mean_wrench()
        self.gate.begin(reading)
        return InitialState(position, reading)

    def check(self) -> None:
        """Raises HoldError, with the reason, while the robot is held."""
        if self.supervisor.mode is Mode.HOLD:
            raise HoldError(
                f"the robot is held: {self.supervisor.reason}; fix the cause, then "
                "resume"
            )

    def resume(self) -> None:
        """Ends a hold; the arm moves again once all devices are ready and the next
        command is close to where it is."""
        self._cell.commands.forget()
        self.supervisor.resume()

    def healths(self) -> dict[str, Health]:
        """Returns the present health of each device."""
        return self._cell.healths()

    def readings(self) -> dict[str, Reading]:
        """Returns the newest reading of each device."""
        return self._cell.readings()

    def measured(self) -> dict[str, np.ndarray]:
        """Returns the newest values of each device, by the port that has them."""
        return {
            f"{name}.{_VALUES[name]}": reading.values
            for name, reading in self.readings().items()
        }

    def register_part(self, name: str, stopwatch: Stopwatch) -> None:
        """See Station."""
        self.gate.add_part(name, stopwatch)

    def counts(self) -> dict[str, float | int]:
        """Returns what keeping the commands' pace has cost so far, by name."""
        counts = dataclasses.asdict(self.gate.pace.counts)
        rounded = {name: round(value, 4) for name, value in counts.items()}
        return rounded | {"clamped": self.supervisor.clamped}

    def connect(self) -> None:
        """Starts the clients; calling it again restarts the sensor's stream."""
        self._cell.connect()

    def close(self) -> None:
        """Stops the clients: no thread and no socket stays."""
        self.gate.is_open = False
        self._cell.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def pump(self) -> None:
        """Handles the arm's messages: LCM keeps one of a channel, and drops later ones.

        A simulation does so by itself, at least once a control period.
        """
        self._cell.pump()

    def _wire_gate(self, builder: DiagramBuilder) -> None:
        """Adds the gate, behind the station's inputs."""
        config = self.config
        self.gate = CommandGate(
            self.supervisor,
            self._cell,
            self.coordinates,
            self.mounting,
            self.control_period,
            _LOOKS * max(config.iiwa.status_period, config.ft_sensor.period),
            config.safety.lag_window,
        )
        builder.AddNamedSystem("gate", self.gate)
        export_required(
            builder,
            self.gate.GetInputPort("position"),
            "iiwa.position",
            "connect the commanded joint angles (7,)",
        )
        export_required(
            builder,
            self.gate.GetInputPort("opening"),
            "gripper.position",
            "connect the commanded opening, [station.grip_command] to hold the bolt",
        )

    def _export_reader(self, builder: DiagramBuilder, name: str) -> None:
        """Exports a device's health and time, and what its client has checked.

        The arm's measured position is of these: nothing that is not finite gets on.
        """
        reader = builder.AddNamedSystem(
            f"{name}_reader",
            DeviceReader(
                self.devices[name],
                _SIZES[name],
                self.control_period,
                self.config.safety.stale_after(name),
                self._cell.clock,
            ),
        )
        port = reader.GetOutputPort("values")
        builder.ExportOutput(port, f"{name}.{_VALUES[name]}")
        for quantity in ("health", "time_measured"):
            builder.ExportOutput(reader.GetOutputPort(quantity), f"{name}.{quantity}")

    def _estimated(
        self, arm: ArmConfig
    ) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
        """Returns what a sensor would read, by joint angles and external torques.

        The arm's estimate leaves out what its tool data say; a sensor does not.
        """
        by_torques = ArmWrench(arm)

        def reading(q: np.ndarray, external: np.ndarray) -> np.ndarray:
            """Returns it (6,), [f; tau] at So in S."""
            weight = self.payload.weight(by_torques.R_WF(q))
            return np.asarray(by_torques.external(q, external) + weight)

        return reading

    def _retreat(self) -> Retreat | None:
        limits = self.config.safety
        if limits.on_force == "hold":
            return None
        R_BS = self.X_SB.rotation().inverse().matrix()
        return Retreat(self.coordinates, R_BS, limits, self.control_period)

    def _allowed_lead(self) -> np.ndarray:
        assert isinstance(self.coordinates, ArmCoordinates)
        J = self.coordinates.jacobian(self.start)
        return self.config.safety.allowed_lead(yielding(self.scenario.arm, J))

    def _refuse_far_start(self, position: np.ndarray) -> None:
        away = np.abs(position - self.start)
        joint = int(np.argmax(away))
        if away[joint] > self.config.start_distance:
            start = ", ".join(f"{np.rad2deg(q):.2f}" for q in self.start)
            raise DisasmError(
                f"joint {joint + 1} is {np.rad2deg(away[joint]):.2f} degrees from "
                f"where an episode starts; jog the arm to {start} degrees"
            )


def refuse_what_is_simulated(scenario: Scenario) -> None:
    """Refuses what a scenario asks of a simulation alone.

    Raises:
        DisasmError: names the first such line.
    """
    refuse_on_hardware(scenario.effects)
    if scenario.randomisation:
        parameter = scenario.randomisation[0].parameter
        raise DisasmError(
            f"randomisation.0 ({parameter}): hardware can't be drawn anew; take it out"
        )
    refuse_twins_contact(scenario)
    if not scenario.gripper.fingers:
        raise DisasmError(
            "gripper.fingers: hardware drives two fingers; name them, or use `station` "
            "cell"
        )


def _supervisor(
    arm: ArmConfig,
    config: HardwareConfig,
    retreat: Retreat | None,
    allowed_lead: np.ndarray,
) -> Supervisor:
    """Returns the supervisor of an arm, by its model's limits and the file's."""
    plant = MultibodyPlant(0.0)
    joints = [plant.GetJointByName(name) for name in add_arm(plant, arm).joints]
    plant.Finalize()
    refuse_unlimited_arm(joints, arm.model)
    limits = config.safety
    fastest = plant.GetVelocityUpperLimits() * limits.velocity_share
    return Supervisor(
        guards(
            limits,
            plant.GetPositionLowerLimits(),
            plant.GetPositionUpperLimits(),
            allowed_lead,
        ),
        fastest,
        limits.start_tolerance,
        limits.max_jump,
        retreat,
    )

"""Clients of the real cell's devices: connecting, waiting, zeroing."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from pydrake.lcm import DrakeLcm

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.ports import Health
from drake_disasm.devices.iiwa import (
    CommandChannel,
    CommandMonitor,
    EstimatedWrench,
    IiwaStatusMonitor,
    encode_command,
)
from drake_disasm.devices.onrobot_hex import HexClient
from drake_disasm.devices.reading import Clock, Reading
from drake_disasm.devices.robotiq import RobotiqClient, RobotiqSettings
from drake_disasm.safety.robot_lock import DeviceLocks, lcm_address
from drake_disasm.stations.hardware_config import HardwareConfig
from drake_disasm.systems.device_reader import Readable

#: drake-iiwa-driver refuses commands within 0.25 s of its first status.
_LISTENS_FIRST = 0.3
_POLL = 0.001  # s: LCM keeps one message of a channel and drops later ones


class CellDevices:
    """Arm, force/torque sensor and gripper, each behind its client.

    Attributes:
        clients: by the device's name.
        is_commanded: whether anything is sent to what moves.
        lcm: by which the arm is reached.
        checked_lcm: carries the messages that the arm's monitor has accepted.
        clock: tells when samples come [s].
        commands: knows what is sent to the arm, and whether others send, too.

    Args:
        config: where the devices are, and limits.
        is_commanded: see above; also whether the gripper may be activated.
        clock: see above.
        wait: lets a time [s] pass while devices answer.
        lcm: see above; None is the configured one.
        estimated: the reading by the arm's state, see `EstimatedWrench`; None is that
            of a sensor.
    """

    def __init__(
        self,
        config: HardwareConfig,
        is_commanded: bool,
        clock: Clock,
        wait: Callable[[float], None],
        lcm: DrakeLcm | None,
        estimated: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
    ) -> None:
        self._config, self.clock, self._wait = config, clock, wait
        self.lcm = lcm or DrakeLcm(config.iiwa.lcm_url)
        self.checked_lcm = DrakeLcm("memq://")
        sensor, iiwa = config.ft_sensor, config.iiwa
        grip = dataclasses.replace(
            config.gripper, activate=config.gripper.activate and is_commanded
        )
        settings = RobotiqSettings(**dataclasses.asdict(grip))
        self._gripper = RobotiqClient(settings, clock)
        self._arm = IiwaStatusMonitor(
            self.lcm, self.checked_lcm, iiwa.status_channel, iiwa.status_period, clock
        )
        self._sensor: HexClient | EstimatedWrench = (
            EstimatedWrench(self._arm, estimated)
            if estimated
            else HexClient(
                sensor.address, sensor.port, sensor.period, sensor.filter_hz, clock
            )
        )
        self.clients: dict[str, Readable] = {
            "iiwa": self._arm,
            "gripper": self._gripper,
            "ft_sensor": self._sensor,
        }
        channel = CommandChannel(self.lcm, iiwa.command_channel)
        self.commands = CommandMonitor(channel, lambda: self._arm.commanded)
        self.is_commanded = is_commanded
        used = _used(config, self.lcm.get_lcm_url(), is_commanded, not estimated)
        self._locks = DeviceLocks(used)

    def connect(self) -> None:
        """Starts the clients; calling it again restarts the sensor's stream.

        Raises:
            DisasmError: another program on this machine has one of the devices.
        """
        self._locks.acquire()
        if self.is_commanded:
            self.commands.start()
        self._sensor.start()
        self._gripper.start()

    def close(self) -> None:
        """Stops the clients: no thread and no socket stays."""
        self._sensor.stop()
        self._gripper.stop()
        self.commands.stop()
        self._locks.release()

    def listens(self) -> bool:
        """Returns whether the arm's driver sends, and has for long enough.

        To a driver that has just been started a command is an error.
        """
        # Later than the guard looks for the same: its reason is the better one.
        now, limit = self.clock(), 2.0 * self._config.safety.stale_arm
        sends = self._arm.read().health(now, limit) is Health.READY
        return sends and self._arm.sending_for(now) >= _LISTENS_FIRST

    @property
    def foreign(self) -> str:
        """Why somebody else commands the arm; empty if nobody does, or may not."""
        return self.commands.foreign if self.is_commanded else ""

    def send(self, position: np.ndarray, time: float) -> None:
        """Sends joint positions (7,) [rad] of a time [s] to the arm's driver.

        They are noted first: they come back as others' commands do.
        """
        self.commands.sent(position)
        channel = self._config.iiwa.command_channel
        self.lcm.Publish(channel, encode_command(position, time))

    def grip(self, opening: float) -> None:
        """Sends an opening [m] to the gripper."""
        self._gripper.command(opening)

    def pump(self) -> None:
        """Handles the arm's messages that have come."""
        for lcm in (self.lcm, self.checked_lcm):
            while lcm.HandleSubscriptions(0):
                pass

    def let_pass(self, duration: float) -> None:
        """Lets a time [s] pass, and handles the arm's messages."""
        self._wait(duration)
        self.pump()

    def readings(self) -> dict[str, Reading]:
        """Returns the newest reading of each device."""
        self.pump()
        return {name: device.read() for name, device in self.clients.items()}

    def healths(self) -> dict[str, Health]:
        """Returns the present health of each device."""
        now, limits = self.clock(), self._config.safety
        return {
            name: reading.health(now, limits.stale_after(name))
            for name, reading in self.readings().items()
        }

    def await_ready(self) -> None:
        """Waits until all devices are ready, and until the arm's driver takes commands.

        Raises:
            DisasmError: one of them does not become ready in time, or somebody else
                commands the arm.
        """
        begun = self.clock()
        while True:
            health = self.healths()
            waited = self.clock() - begun
            if self.foreign:
                raise DisasmError(self.foreign)
            not_ready = [n for n, h in health.items() if h is not Health.READY]
            if not not_ready and waited >= _LISTENS_FIRST and self.listens():
                return
            if waited > self._config.ready_timeout:
                raise DisasmError(self._silence(not_ready))
            self._wait(_POLL)

    def mean_wrench(self) -> np.ndarray:
        """Returns the mean (6,) of the sensor's readings, each of another time.

        Raises:
            DisasmError: the sensor does not send enough of them in time.
        """
        taken: dict[float, np.ndarray] = {}
        deadline = self.clock() + self._config.ready_timeout
        while len(taken) < self._config.tare_samples:
            if self.clock() > deadline:
                raise DisasmError(self._silence(["ft_sensor"]))
            self.let_pass(_POLL)
            reading = self.clients["ft_sensor"].read()
            taken[reading.time] = reading.values
        return np.asarray(np.mean(list(taken.values()), axis=0))

    def _silence(self, names: Sequence[str]) -> str:
        """Returns the message for devices that are not ready."""
        readings, health = self.readings(), self.healths()
        each = [
            f"{name} is {health[name].name}"
            + (f" ({readings[name].error})" if readings[name].error else "")
            for name in names
        ]
        return (
            f"not ready after {self._config.ready_timeout:g} s: {'; '.join(each)}; "
            "see docs/guides/hardware.md, what to check first"
        )


def _used(
    config: HardwareConfig, lcm_url: str, is_commanded: bool, has_sensor: bool
) -> dict[str, str]:
    """Returns the devices that are one program's alone: address to what it does.

    Another program's dry run would take the sensor's stream, and break into the
    gripper's requests.
    """
    arm = lcm_address(lcm_url, config.iiwa.command_channel)
    sensor, gripper = config.ft_sensor, config.gripper
    is_serial = gripper.transport == "serial"
    port = "" if is_serial else f":{gripper.port}"
    used = {f"gripper at {gripper.address}{port}": "talks to the gripper"}
    if has_sensor:
        stream = f"ft_sensor at {sensor.address}:{sensor.port}"
        used = {stream: "has the sensor's stream"} | used
    return ({arm: "commands this robot"} if arm and is_commanded else {}) | used

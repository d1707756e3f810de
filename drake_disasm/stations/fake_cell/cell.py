"""A simulated cell behind the devices' own protocols, in place of a real one.

It runs in step with whoever calls `advance`, in virtual time, so that a test has the
same trajectory each time; `drake-disasm fake-cell` advances it in real time.
"""

import dataclasses
import time
from collections.abc import Callable
from typing import Self

import numpy as np
from drake import lcmt_iiwa_command, lcmt_iiwa_status
from pydrake.common import RandomGenerator
from pydrake.lcm import DrakeLcm

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.timing import boundary
from drake_disasm.devices.onrobot_hex.fake_box import FakeHexBox
from drake_disasm.devices.reading import Reading
from drake_disasm.devices.robotiq.fake_gripper import FakeRobotiqGripper
from drake_disasm.devices.robotiq.registers import Stroke
from drake_disasm.scenario import Scenario
from drake_disasm.stations.cell import CellStation
from drake_disasm.stations.hardware_config import HardwareConfig

#: Of the arm's status messages.
IIWA_FAULTS = ("", "loss", "frozen", "reorder", "nan", "jump", "short", "header")
JUMP = 0.3  # rad, of the fault "jump"
_DEAF = 0.25  # s after the first status, as in kuka_driver.cc
_RESTART = 1.5  # s without the driver
_ARRIVES = 0.2  # s, on a busy machine


class FakeCell:
    """Arm, sensor and gripper of a simulated cell, as devices on the loopback.

    It behaves as drake-iiwa-driver does: measured and commanded torques have KUKA's
    sign, and a command within 0.25 s of the first status stops it.

    Attributes:
        time: virtual [s]; the clock of whoever listens to the devices.
        hex, gripper: the devices behind sockets, with their faults.
        fault: of the arm's status, one of IIWA_FAULTS.
        commands: how many the arm has received.
        commanded: (7,) the last of them [rad]; the start before the first.

    Args:
        scenario: of the simulated cell; its effects are hidden in the readings.
        lcm: over which the arm talks.
        seed: of the sensor's noise, which starts at power-up and not with an episode:
            the same seed gives other readings than a simulated station's.
    """

    def __init__(self, scenario: Scenario, lcm: DrakeLcm, seed: int = 0) -> None:
        self.station = CellStation(scenario)
        self.simulator = self.station.at_start(scenario.effects)
        self._context = self.simulator.get_mutable_context()
        number = int(np.random.SeedSequence(seed).generate_state(2)[0])
        noise = self.station.sensor_noise
        noise.SetRandomContext(
            self.station.part_context(noise, self._context), RandomGenerator(number)
        )
        self.simulator.Initialize()
        self._steps = round(self.station.settling_time / self.station.control_period)
        self.simulator.AdvanceTo(boundary(self._steps, self.station.control_period))
        self._start = self._context.Clone(), self._steps
        self._force_at_start = self._evaluate("ft_sensor.wrench")[:3]
        self._lcm, self._channels = lcm, HardwareConfig().iiwa
        lcm.Subscribe(self._channels.command_channel, self._obey)
        self.time, self._first_status = 0.0, np.nan
        self.hex = FakeHexBox(clock=lambda: self.time)
        self.gripper = FakeRobotiqGripper()
        opening = float(self._evaluate("gripper.state_measured")[0])
        self.gripper.position = self.gripper.object_at = Stroke().request(opening)
        self.fault, self.commands = "", 0
        self.commanded = self.station.start
        self._late: bytes | None = None
        self._utime, self._restarted_at = 0, 0.0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        """Switches all devices off."""
        self.hex.stop()
        self.gripper.stop()

    def jog_to_start(self) -> None:
        """Puts the arm back to where an episode starts, the bolt gripped at A."""
        while self._lcm.HandleSubscriptions(0):
            pass  # commands that were on their way
        start, self._steps = self._start
        self._context.SetTimeStateAndParametersFrom(start)
        self.simulator.Initialize()
        self.commanded = self.station.start

    def clock(self) -> float:
        """Returns the virtual time [s]."""
        return self.time

    def config(self) -> HardwareConfig:
        """Returns the configuration by which a hardware station finds it."""
        config = HardwareConfig()
        control = self.station.scenario.arm.control
        config.iiwa = dataclasses.replace(config.iiwa, control=control)
        config.ft_sensor = dataclasses.replace(
            config.ft_sensor,
            address="127.0.0.1",
            port=self.hex.port,
            period=self.station.control_period,
        )
        config.gripper = dataclasses.replace(
            config.gripper, address="127.0.0.1", port=self.gripper.port
        )
        return config

    def advance(self, heard: Callable[[], bool] = lambda: True) -> None:
        """Advances the cell by a control period under the newest command; then sends.

        The arm receives a command at the end of the period, as over a network: it
        follows a control period later than one in the same diagram.

        Args:
            heard: whether the sensor's sample has arrived; waited for, so that the
                sockets' own time plays no part.
        """
        self._lcm.HandleSubscriptions(0)
        position = self.station.GetInputPort("iiwa.position")
        position.FixValue(self._context, self.commanded)
        self._steps += 1
        self.simulator.AdvanceTo(boundary(self._steps, self.station.control_period))
        self.send_measurements(heard)

    def send_measurements(self, heard: Callable[[], bool] = lambda: True) -> None:
        """Lets a control period pass, and sends the measurements at its end."""
        self.time += self.station.control_period
        self._send_status()
        if self.hex.started:
            self.hex.send(self._evaluate("ft_sensor.wrench").tolist())
            comes = self.hex.fault not in ("loss", "delay", "reorder")
            deadline = time.monotonic() + (_ARRIVES if comes else 0.0)
            while not heard() and time.monotonic() < deadline:
                time.sleep(1e-5)

    def restart(self, device: str) -> None:
        """Starts a device anew, as after a loss of power.

        Args:
            device: "iiwa" (its driver), "ft_sensor" or "gripper".
        """
        if device == "iiwa":
            self._restarted_at = self.time + _RESTART
            self._first_status = np.nan
        elif device == "ft_sensor":
            self.hex.restart()
        else:
            self.gripper.restart()

    def skip(self, periods: int) -> None:
        """Lets control periods pass in which nothing is simulated, and nothing sent.

        For a machine too slow for real time: the devices' clocks go on, and what they
        would have sent is lost.
        """
        self.time += periods * self.station.control_period
        self.hex.sequence = (self.hex.sequence + periods) % 2**32

    def position_measured(self) -> np.ndarray:
        """Returns the arm's true joint angles (7,) [rad]."""
        return self._evaluate("iiwa.position_measured")

    def load(self) -> np.ndarray:
        """Returns the sensor's force (3,) since the start, in its axes [N]."""
        return self._evaluate("ft_sensor.wrench")[:3] - self._force_at_start

    def _evaluate(self, port: str) -> np.ndarray:
        return self.station.GetOutputPort(port).Eval(self._context)

    def _obey(self, data: bytes) -> None:
        if self.time < self._restarted_at:
            return
        message = lcmt_iiwa_command.decode(data)
        since = self.time - self._first_status
        if not since > _DEAF:  # NaN before the first status
            raise DisasmError("the iiwa driver stops: a command came before it listens")
        count = len(message.joint_position)
        if count != len(self.commanded):
            raise DisasmError(f"the iiwa driver stops: a command is of {count} joints")
        if not np.isfinite(message.joint_position).all():
            raise DisasmError("the iiwa driver stops: a command is not finite")
        self.commands += 1
        self.commanded = np.array(message.joint_position)

    def _send_status(self) -> None:
        if self.time < self._restarted_at:
            return
        if np.isnan(self._first_status):
            self._first_status = self.time
        data = self._status().encode()
        if self.fault == "short":
            data = data[:20]
        elif self.fault == "header":
            data = bytes(8) + data[8:]
        elif self.fault == "reorder":
            data, self._late = self._late or data, data
        if self.fault != "loss":
            self._lcm.Publish(self._channels.status_channel, data)

    def _status(self) -> lcmt_iiwa_status:
        message = lcmt_iiwa_status()
        if self.fault != "frozen":
            self._utime = round(1e6 * (self.time - self._restarted_at))
        message.utime, message.num_joints = self._utime, 7
        q = self.position_measured().copy()
        if self.fault in ("nan", "jump"):
            q[3] = np.nan if self.fault == "nan" else q[3] + JUMP
        message.joint_position_measured = q.tolist()
        message.joint_position_commanded = self.commanded.tolist()
        message.joint_position_ipo = self.commanded.tolist()
        for name, port, sign in (
            ("joint_velocity_estimated", "velocity_estimated", 1.0),
            ("joint_torque_measured", "torque_measured", -1.0),
            ("joint_torque_commanded", "torque_commanded", -1.0),
            ("joint_torque_external", "torque_external", 1.0),
        ):
            setattr(message, name, (sign * self._evaluate(f"iiwa.{port}")).tolist())
        return message


def arrival(read: Callable[[], Reading]) -> Callable[[], bool]:
    """Returns a function: whether anything, valid or not, has arrived since now."""
    before = read()
    return lambda: read() is not before

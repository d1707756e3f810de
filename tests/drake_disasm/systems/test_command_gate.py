"""The gate: when it waits, what it sends, and what it keeps from the devices."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_disasm.devices.reading import Reading
from drake_disasm.safety import Mode, Supervisor
from drake_disasm.systems.command_gate import CommandGate
from drake_disasm.systems.device_reader import DeviceReader
from tests.refusals import refused

PERIOD = 0.01  # s


class _Robot:
    """Plays devices that send once a period, and counts what they are sent."""

    foreign = ""

    def __init__(self, is_commanded: bool = True) -> None:
        self.is_commanded, self.is_deaf, self.now = is_commanded, False, 5.0
        self.ticks = 1e-6  # rad/s, by which the measured angles tell the time
        self.sent: list[tuple[float, np.ndarray]] = []
        self.openings: list[float] = []

    def clock(self) -> float:
        return self.now

    def let_pass(self, duration: float) -> None:
        self.now += duration

    def read(self) -> Reading:
        return Reading(np.full(2, self.ticks * self.now), time=self.now)

    def readings(self) -> dict[str, Reading]:
        return {"iiwa": self.read(), "ft_sensor": Reading(np.zeros(6), self.now)}

    def listens(self) -> bool:
        return not self.is_deaf

    def send(self, position: np.ndarray, time: float) -> None:
        self.sent.append((self.now, position))

    def grip(self, opening: float) -> None:
        self.openings.append(opening)


class _Coordinates:
    size = 2

    def pose(self, q: np.ndarray) -> RigidTransform:
        return RigidTransform()


def _behind_gate(robot: _Robot) -> tuple[Simulator, CommandGate, DeviceReader]:
    """Returns a diagram with a reader that was added before the gate."""
    builder = DiagramBuilder()
    reader = builder.AddSystem(DeviceReader(robot, 2, PERIOD, 1.0, robot.clock))
    supervisor = Supervisor([], np.ones(2), 0.1, 0.1)
    gate = CommandGate(supervisor, robot, _Coordinates(), None, PERIOD, 3 * PERIOD, 1.0)
    gate.is_open = True
    builder.AddSystem(gate)
    for port, value in (("position", [0.001, 0.0]), ("opening", [0.04])):
        source = builder.AddSystem(ConstantVectorSource(value))
        builder.Connect(source.get_output_port(), gate.GetInputPort(port))
    return Simulator(builder.Build()), gate, reader


def test_commands_leave_at_their_rate_and_devices_are_read_after_the_wait() -> None:
    robot = _Robot()
    simulator, gate, reader = _behind_gate(robot)
    simulator.Initialize()
    assert not robot.sent  # a simulation that is not advanced moves nothing
    for k in range(1, 12):
        simulator.AdvanceTo(k * PERIOD - 1e-3)
        times = [when for when, _ in robot.sent]
        assert np.diff(times) == pytest.approx(np.full(k - 1, PERIOD))
        context = reader.GetMyContextFromRoot(simulator.get_context())
        seen = reader.GetOutputPort("values").Eval(context)
        assert seen == pytest.approx(robot.ticks * times[-1], rel=1e-12)
    assert robot.openings == [0.04] * 3  # once in 0.05 s
    assert np.array_equal(gate.sent, [0.001, 0.0])


def test_a_dry_run_and_a_deaf_arm_are_sent_nothing() -> None:
    dry = _Robot(is_commanded=False)
    _behind_gate(dry)[0].AdvanceTo(0.1)
    assert dry.sent == [] == dry.openings
    robot = _Robot()
    simulator, gate, _ = _behind_gate(robot)
    simulator.AdvanceTo(0.055)
    robot.is_deaf, count = True, len(robot.sent)
    simulator.AdvanceTo(0.085)
    assert gate.supervisor.mode is Mode.HOLD and "listen" in gate.supervisor.reason
    assert len(robot.sent) == count and gate.pace.counts.held == 3


def test_a_stall_between_decision_and_sending_keeps_the_command_back() -> None:
    robot = _Robot()
    simulator, gate, _ = _behind_gate(robot)
    simulator.AdvanceTo(0.025)
    listened, count = gate.supervisor.command, len(robot.sent)

    def stalled(situation: object) -> np.ndarray:
        robot.now += 1.0
        return listened(situation)

    gate.supervisor.command = stalled
    simulator.AdvanceTo(0.035)
    assert len(robot.sent) == count and gate.pace.counts.held == 1
    gate.supervisor.command = listened
    begun = robot.now
    simulator.AdvanceTo(0.045)
    assert robot.sent[-1][0] == pytest.approx(begun + 3 * PERIOD)


def test_nothing_is_sent_before_anything_was_measured() -> None:
    robot = _Robot()
    robot.ticks = np.nan
    with refused("station.begin(context)"):
        _behind_gate(robot)[0].AdvanceTo(0.1)
    assert not robot.sent

"""The hardware station against a fake cell: ports, trajectory, refusals, leftovers."""

import os
import threading
from collections.abc import Callable

import numpy as np
import psutil
import pytest
from drake import lcmt_iiwa_command
from fault_runs import in_lockstep
from pydrake.lcm import DrakeLcm
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.ports import cell_ports, port_differences
from drake_disasm.effects import GroovePose
from drake_disasm.policies import make_policy
from drake_disasm.safety import Mode
from drake_disasm.scenario import load_scenario
from drake_disasm.stations.fake_cell.cell import FakeCell, arrival
from drake_disasm.stations.hardware import HardwareStation, HoldError
from drake_disasm.stations.hardware_config import HardwareConfig
from tests.refusals import refused


@pytest.fixture
def station() -> HardwareStation:
    config = HardwareConfig(ready_timeout=0.4)
    config.ft_sensor.address = config.gripper.address = "127.0.0.1"
    port = 20_000 + os.getpid() % 20_000  # nobody else's: each port is locked
    config.ft_sensor.port, config.gripper.port = port, port
    return HardwareStation(load_scenario("removal"), config, lcm=DrakeLcm("memq://"))


def test_ports_are_the_simulated_cells_and_a_dry_run_has_nothing_that_sends(
    station, cell, dry
):
    table = cell_ports("iiwa", 7)
    assert station.table == cell.table == table
    for each in (station, cell, dry):
        assert port_differences(each, table) == []
    assert station.gate.robot.is_commanded and not dry.gate.robot.is_commanded


@pytest.mark.parametrize(("override", "words"), [
    ("effects=[!GroovePose {ry: 0.01}]", ["effects.0", "!GroovePose"]),
    ("effects=[!CommandGain {x: 0.01}]", ["effects.0", "!CommandGain"]),
    ("contact.model=impact", ["contact.model", "'impact'", "twin"]),
])  # fmt: skip
def test_what_hardware_cannot_do_is_named_when_it_is_built(override, words):
    with refused(*words):
        HardwareStation(load_scenario("removal", [override]), HardwareConfig())


@pytest.fixture
def dry(station: HardwareStation) -> HardwareStation:
    scenario, config = station.scenario, station.config
    return HardwareStation(scenario, config, dry_run=True, lcm=DrakeLcm("memq://"))


def _simulated(station: HardwareStation) -> Simulator:
    """Returns the program of a user who never heard of TaskSimulation."""
    builder = DiagramBuilder()
    builder.AddSystem(station)
    commands = {"iiwa.position": station.start, "gripper.position": [0.0]}
    for name in commands:
        source = builder.AddSystem(ConstantVectorSource(commands[name]))
        builder.Connect(source.get_output_port(), station.GetInputPort(name))
    return Simulator(builder.Build())


def test_it_does_not_run_before_it_is_connected(station: HardwareStation) -> None:
    """One clear error, neither NaN nor a hang; its default Context knows no start."""
    with refused("effects.0"):
        station.begin(station.CreateDefaultContext(), [GroovePose(ry=0.01)])
    with station, refused("iiwa is NO_", "gripper is NO_", "ft_sensor is NO_DATA"):
        station.begin(station.CreateDefaultContext())
    with refused("not connected", "station.begin(context)"):
        _simulated(station).AdvanceTo(0.1)
    with refused("where its arm is", "station.begin"):
        _ = station.initial_state


def test_torques_have_drakes_sign_and_an_arm_elsewhere_is_not_begun_with() -> None:
    with in_lockstep(load_scenario("removal"), make_policy("straight")) as parts:
        simulation, station, cell = parts
        simulation.reset(0)
        for name in ("torque_measured", "torque_commanded", "torque_external"):
            real = simulation.evaluate(station, f"iiwa.{name}")
            context = cell.simulator.get_context()
            truth = cell.station.GetOutputPort(f"iiwa.{name}").Eval(context)
            assert real == pytest.approx(truth, abs=1.0)
        # Against gravity, which Drake counts as positive at joint 4 here.
        q4 = simulation.evaluate(station, "iiwa.torque_measured")[3]
        assert abs(q4) > 2.0
        station.start = station.start + 0.1  # where the arm is not
        with refused("degrees from where an episode starts"):
            simulation.reset(0)


def test_a_hold_stays_until_resumed_and_commands_go_nowhere() -> None:
    with in_lockstep(load_scenario("removal"), make_policy("straight")) as parts:
        simulation, station, cell = parts
        simulation.reset(0)
        simulation.step()
        cell.hex.fault = "jump"
        with pytest.raises(HoldError, match=r"force \d+\.\d N on the gripper"):
            simulation.step()
        cell.hex.fault = ""
        held = cell.commanded
        for _ in range(3):
            with pytest.raises(HoldError):
                simulation.step()
        assert np.abs(cell.commanded - held).max() < 1e-3
        with pytest.raises(HoldError):
            simulation.reset(0)
        station.resume()
        assert station.supervisor.mode is Mode.WAITING
        simulation.reset(0)
        simulation.step()
        assert station.supervisor.mode is Mode.ACTIVE, station.supervisor.reason


def test_no_thread_and_no_socket_is_left() -> None:
    threads = set(threading.enumerate())
    sockets = len(psutil.Process().net_connections())
    with in_lockstep(load_scenario("removal"), make_policy("straight")) as parts:
        assert parts[2].commands == 0  # none before the driver listens
        parts[0].reset(0)
        assert set(threading.enumerate()) > threads
    assert set(threading.enumerate()) == threads
    assert len(psutil.Process().net_connections()) == sockets


@pytest.mark.parametrize("stall", [0.05, 0.24])
def test_time_that_was_lost_stays_lost(stall: float) -> None:
    """After a stall commands go on at their rate, and the joints at their speed."""
    stalled: list[float] = []
    sent: list[tuple[float, np.ndarray]] = []

    def thinks(s: np.ndarray) -> np.ndarray:
        if len(sent) > 45 and not stalled:
            stalled.append(cell.time)
            for _ in range(round(stall / station.control_period)):
                cell.advance(arrival(station.devices["ft_sensor"].read))
        return np.array([1e-3, 0, 0, 0, 0, 0])

    with in_lockstep(load_scenario("removal"), thinks) as (simulation, station, cell):
        robot = station.gate.robot
        send = robot.send

        def noted(q: np.ndarray, time: float) -> None:
            sent.append((cell.time, q.copy()))
            send(q, time)

        robot.send = noted
        simulation.reset(0)
        for _ in range(8):
            simulation.step()
        assert station.supervisor.mode is Mode.ACTIVE, station.supervisor.reason
        counts = station.counts()
    times = np.array([when for when, _ in sent])
    way = np.abs(np.diff([q for _, q in sent], axis=0)).max(axis=1)
    speed = way / np.diff(times)
    assert np.diff(times).min() > 0.0045  # never sooner than the period, nearly
    after = times[1:] > stalled[0]
    assert after.sum() > 50
    assert speed[after].max() < 1.2 * speed[~after].max()
    assert counts["stalls"] == 1
    assert counts["slipped"] == pytest.approx(stall + 0.01, abs=0.011)
    assert counts["longest_stall"] == pytest.approx(stall, abs=0.006)


@pytest.mark.parametrize(("where", "periods", "words"), [
    (0.003, 60, "policy took 0.300 s"),
    # No gap alone is too long; together they are, and the policy is named.
    (-1.0, 20, "too slow; of its time take: policy "),
])  # fmt: skip
def test_a_policy_that_is_late_once_or_by_habit_ends_in_a_hold(where, periods, words):
    cells: list[FakeCell] = []

    def thinks(s: np.ndarray) -> np.ndarray:
        if s[0] > where:
            for _ in range(periods if cells else 0):
                cells[0].advance(arrival(station.devices["ft_sensor"].read))
        return np.array([1e-3, 0, 0, 0, 0, 0])

    with in_lockstep(load_scenario("removal"), thinks) as (simulation, station, cell):
        simulation.reset(0)
        cells.append(cell)
        with pytest.raises(HoldError) as caught:
            for _ in range(40):
                simulation.step()
        assert station.supervisor.mode is Mode.HOLD
        assert words in str(caught.value)


def _command(cell: FakeCell, away: float) -> None:
    """Commands the arm as another program does: joint 2 away [rad] from where it is."""
    message = lcmt_iiwa_command()
    message.num_joints = 7
    message.joint_position = (cell.commanded + away * np.eye(7)[1]).tolist()
    cell._lcm.Publish("IIWA_COMMAND", message.encode())


def test_another_commander_ends_in_a_hold_and_in_a_refusal_to_begin() -> None:
    cells: list[FakeCell] = []

    def is_joined(s: np.ndarray) -> np.ndarray:
        if s[0] > 0.003 and cells:
            _command(cells.pop(), 1e-5)
        return np.array([1e-3, 0, 0, 0, 0, 0])

    with in_lockstep(load_scenario("removal"), is_joined) as parts:
        simulation, station, cell = parts
        cells.append(cell)
        simulation.reset(0)
        with pytest.raises(HoldError, match="a command that is not ours came on IIWA"):
            for _ in range(10):
                simulation.step()
        station.resume()
        assert station.supervisor.mode is Mode.WAITING
        advance = cell.advance

        def joined(heard: Callable[[], bool] = lambda: True) -> None:
            _command(cell, 1e-5)
            advance(heard)

        cell.advance = joined  # type: ignore[method-assign]
        with pytest.raises(DisasmError, match="another program commands this robot"):
            simulation.reset(0)
        cell.advance = advance  # type: ignore[method-assign]
        simulation.reset(0)
        simulation.step()
        assert station.supervisor.mode is Mode.ACTIVE, station.supervisor.reason


def test_a_sensor_whose_stream_another_program_has_is_left_alone(station, dry):
    """Even by a dry run: the box streams to its last client."""
    with station:
        station.connect()
        with pytest.raises(DisasmError, match="has the sensor's stream"):
            dry.connect()
    with dry:
        dry.connect()

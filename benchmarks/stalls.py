"""What a stall of the hardware station's diagram does on the wire and at the sensor.

A fake cell plays the devices in a process of its own. In another one the station slides
the bolt, and stands still once: in its policy, its inverse kinematics, its sender, or
anywhere (SIGSTOP). Commands are counted on the wire, by the time at which the operating
system received them. `python benchmarks/stalls.py` prints the table of
docs/results/hardware-timing.md.
"""

import dataclasses
import multiprocessing as mp
import os
import re
import socket
import struct
import threading
import time
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
from drake import lcmt_iiwa_command
from pydrake.lcm import DrakeLcm
from results import Cell, add_results_argument, markdown, write_result
from tqdm import tqdm

from drake_disasm.common import options, program
from drake_disasm.common.files import write_json
from drake_disasm.devices.datagrams import receive, stamp_arrivals
from drake_disasm.mdp import Outcome
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.stations.fake_cell.cell import FakeCell
from drake_disasm.stations.fake_cell.real_time import RealTime
from drake_disasm.stations.hardware import HardwareStation, HoldError
from drake_disasm.stations.hardware_config import HardwareConfig
from drake_disasm.task.simulation import TaskSimulation

_NAME = "benchmarks/stalls.py"
COLUMNS = (
    *("stall [s]", "where", "commands in 0.1 s", "least gap [ms]"),
    *("joint speed [mrad/s]", "force [N]", "slipped [s]", "ended by"),
)
STALLS = (0.0, 0.01, 0.05, 0.1, 0.24, 1.0, 3.0)  # s
PLACES = ("policy", "solver", "sender", "anywhere")
_GROUP = "239.255.76.67"
#: The played cell must keep real time, on a machine that others use too.
QUICK_ENOUGH = "simulation.cell_time_step=0.005"
_WINDOW = 0.1  # s, over which commands are counted
_SPAN = 4  # commands over which the joints' speed is taken
_STEPS_AFTER = 12
_EARLIEST, _LATEST = 5, 60  # step of the stall


@dataclasses.dataclass(frozen=True)
class StallRun:
    """What one stall did.

    Attributes:
        place, stall: where, and how long [s].
        rate: greatest number of commands within 0.1 s.
        gap: least time between two commands [s].
        speed: greatest of any joint over four commands, on the wire [rad/s].
        force: greatest at the sensor, zeroed at the start [N].
        slipped: by how much the diagram's time fell behind [s].
        ended: by what.
    """

    place: str
    stall: float
    rate: int
    gap: float
    speed: float
    force: float
    slipped: float
    ended: str


def play(pipe: Connection, port: int) -> None:
    """Plays a cell in real time; answers what came over the wire, and forces."""
    go_first(2)
    scenario = load_scenario("removal", [QUICK_ENOUGH])
    lcm = DrakeLcm(_lcm_url(port))
    with FakeCell(scenario, lcm) as cell, _Wire(port) as wire:
        config = cell.config()
        pipe.send((config.ft_sensor.port, config.gripper.port))
        pace, forces = RealTime(cell), list[float]()
        while True:
            cell.advance()
            pace.keep()
            forces.append(float(np.linalg.norm(cell.load())))
            if not pipe.poll():
                continue
            if pipe.recv() == "jog":
                cell.jog_to_start()
                forces.clear()
                wire.clear()
                pipe.send(None)
            else:
                pipe.send((max(forces, default=0.0), *wire.commands()))


class _Wire:
    """Listens to the arm's commands on LCM's multicast group."""

    def __init__(self, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        self._socket.bind((_GROUP, port))
        member = struct.pack("4sl", socket.inet_aton(_GROUP), socket.INADDR_ANY)
        self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
        self._socket.settimeout(0.2)
        stamp_arrivals(self._socket)
        self._found: list[tuple[float, np.ndarray]] = []
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._listen, name="wire")
        self._channel = HardwareConfig().iiwa.command_channel.encode() + b"\0"

    def __enter__(self) -> "_Wire":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        self._thread.join()
        self._socket.close()

    def clear(self) -> None:
        """Forgets what came so far."""
        self._found = []

    def commands(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns times (n,) [s] and joint angles (n, 7) [rad] since `clear`."""
        found = list(self._found)
        times = np.array([when for when, _ in found])
        return times, np.array([q for _, q in found]).reshape(-1, 7)

    def _listen(self) -> None:
        while not self._stopping.is_set():
            try:
                data, when = receive(self._socket, 65536, time.monotonic)
            except TimeoutError:
                continue
            payload = data[8:]  # magic and number of a short LCM message
            if payload.startswith(self._channel):
                message = lcmt_iiwa_command.decode(payload[len(self._channel) :])
                self._found.append((when, np.array(message.joint_position)))


def go_first(priority: int) -> None:
    """Asks for the processor before others, as devices have one of their own."""
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(priority))
    except OSError:
        print("no real-time priority here: other work may cause stalls", flush=True)


class _Staller:
    """Stands still once, when its turn comes."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def __call__(self) -> None:
        """Stands still, if it is to."""
        seconds, self.seconds = self.seconds, 0.0
        if seconds:
            time.sleep(seconds)

    def before(self, call: Callable[..., object]) -> Callable[..., object]:
        """Returns a call that stands still first, if it is to."""

        def stalled(*arguments: object) -> object:
            """Stands still if it is to, then calls."""
            self()
            return call(*arguments)

        return stalled


def _lcm_url(port: int) -> str:
    return f"udpm://{_GROUP}:{port}?ttl=0"


def drive(pipe: Connection, port: int, ports: tuple[int, int]) -> None:
    """Slides the bolt on a hardware station, and stands still where it is told to."""
    go_first(1)
    config = HardwareConfig()
    config.iiwa.lcm_url = _lcm_url(port)
    config.ft_sensor.address = config.gripper.address = "127.0.0.1"
    config.ft_sensor.port, config.gripper.port = ports
    config.ft_sensor.period = 0.005
    scenario = load_scenario("removal")
    stallers = {place: _Staller() for place in PLACES[:3]}
    with HardwareStation(scenario, config) as station:
        policy = make_policy("admittance")
        simulation = TaskSimulation(
            scenario, lambda _: station, stallers["policy"].before(policy)
        )
        coordinates = station.coordinates
        solve = stallers["solver"].before(coordinates.solve)
        coordinates.solve = solve  # type: ignore[method-assign, assignment]
        robot = station.gate.robot
        send = stallers["sender"].before(robot.send)
        robot.send = send  # type: ignore[method-assign, assignment]
        pipe.send(None)
        while True:
            place, stall, step, seed = pipe.recv()
            pipe.send(_one_run(simulation, station, stallers, place, stall, step, seed))


def _one_run(
    simulation: TaskSimulation,
    station: HardwareStation,
    stallers: dict[str, _Staller],
    place: str,
    stall: float,
    step: int,
    seed: int,
) -> tuple[float, str]:
    """Returns the time that slipped [s], and what ended the run."""
    station.resume()
    before = station.counts()["slipped"]
    ended = "went on"
    try:
        simulation.reset(seed)
        for number in range(step + _STEPS_AFTER):
            if number == step and place in stallers:
                stallers[place].seconds = stall
            elif number == step and stall:
                _stop_soon(stall)
            if simulation.step().outcome is not Outcome.RUNNING:
                ended = "the bolt is out"
                break
    except HoldError:
        ended = station.supervisor.reason
    return station.counts()["slipped"] - before, ended


def _stop_soon(stall: float) -> None:
    """Has another process stop this one, within a period of the task [s]."""
    wait = np.random.default_rng().uniform(0.0, 0.1)
    command = f"sleep {wait:.4f}; kill -STOP {os.getpid()}; sleep {stall}; "
    os.spawnlp(os.P_NOWAIT, "sh", "sh", "-c", f"{command} kill -CONT {os.getpid()}")


def measure(
    commands: tuple[np.ndarray, np.ndarray], period: float
) -> tuple[int, float, float]:
    """Returns greatest count in a window, least gap [s], greatest speed [rad/s].

    Args:
        commands: times (n,) [s] and joint angles (n, 7) [rad].
        period: of the commands [s]; a stamp is not exact, and a speed over four of
            them is.
    """
    times, q = commands
    counts = np.searchsorted(times, times + _WINDOW - 1e-6) - np.arange(len(times))
    way = np.abs(q[_SPAN:] - q[:-_SPAN]).max(axis=1)
    took = np.maximum(times[_SPAN:] - times[:-_SPAN], 0.1 * period)
    return int(counts.max()), float(np.diff(times).min()), float((way / took).max())


def run_all(stalls: Sequence[float], repeats: int, path: Path | None) -> list[StallRun]:
    """Runs each stall in each place; writes results as they come."""
    spawn = mp.get_context("spawn")
    (cell, cells_end), (station, stations_end) = spawn.Pipe(), spawn.Pipe()
    port = 20_000 + os.getpid() % 20_000  # not where another cell may be
    player = spawn.Process(target=play, args=(cells_end, port), daemon=True)
    player.start()
    ports = cell.recv()
    driver = spawn.Process(target=drive, args=(stations_end, port, ports), daemon=True)
    driver.start()
    station.recv()
    runs: list[StallRun] = []
    todo = [(p, s, k) for s in stalls for p in PLACES for k in range(repeats)]
    try:
        for place, stall, seed in tqdm(todo, unit="run"):
            step = int(np.random.default_rng(seed).integers(_EARLIEST, _LATEST))
            cell.send("jog")
            cell.recv()
            time.sleep(0.5)  # until the sensor is at rest
            station.send((place, stall, step, seed))
            slipped, ended = station.recv()
            cell.send("what")
            force, *commands = cell.recv()
            rate, gap, speed = measure(tuple(commands), 0.005)
            runs.append(StallRun(place, stall, rate, gap, speed, force, slipped, ended))
            if path:
                write_json(path, [dataclasses.asdict(run) for run in runs])
    finally:
        driver.kill()
        player.kill()
    return runs


def figures_left_out(reason: str) -> str:
    """Returns a hold's reason without its figures and its remedy, to be counted."""
    return re.sub(r"-?\d+(\.\d+)?", "#", reason.split(";")[0])


def table_rows(runs: Sequence[StallRun]) -> list[tuple[Cell, ...]]:
    """Returns a row for each stall and place, the worst of its runs; see COLUMNS."""
    rows: list[tuple[Cell, ...]] = []
    for stall, place in dict.fromkeys((run.stall, run.place) for run in runs):
        same = [run for run in runs if (run.stall, run.place) == (stall, place)]
        ends = [figures_left_out(run.ended) for run in same]
        ended = "; ".join(f"{ends.count(end)} {end}" for end in dict.fromkeys(ends))
        figures = (
            1e3 * min(run.gap for run in same),
            1e3 * max(run.speed for run in same),
            max(run.force for run in same),
        )
        gap, speed, force = (round(value, 1) for value in figures)
        slipped = round(float(np.mean([run.slipped for run in same])), 2)
        rate = max(run.rate for run in same)
        rows.append((stall, place, rate, gap, speed, force, slipped, ended))
    return rows


def main(arguments: Sequence[str]) -> int:
    """Runs, and prints the table; returns the exit status."""
    parser = program.argument_parser(f"python {_NAME}", __doc__, "")
    add = parser.add_argument
    add(
        "--repeats",
        type=options.positive,
        default=5,
        metavar="N",
        help="of each (default: 5)",
    )
    add(
        "--stalls",
        type=options.nonnegative,
        nargs="+",
        default=STALLS,
        metavar="S",
        help="[s]",
    )
    add("--output", type=Path, metavar="FILE", help="JSON, written as runs end")
    add_results_argument(parser)
    args = parser.parse_args(arguments)
    rows = table_rows(run_all(args.stalls, args.repeats, args.output))
    print(markdown(COLUMNS, rows))
    title = "A stall of the hardware station's program"
    write_result(args.results, title, COLUMNS, rows, _NAME, arguments)
    return 0


if __name__ == "__main__":
    program.run(main)

"""Minutes of motion on the hardware station in real time, without a fault.

`python benchmarks/endurance.py --minutes 10` plays a cell in another process, moves
the bolt to and fro, and prints whether anything tripped, and how old samples were.
"""

import contextlib
import gc
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import psutil
from pydrake.systems.framework import Context
from results import Cell, add_results_argument, markdown, write_result
from tqdm import tqdm

from drake_disasm.common import options, program
from drake_disasm.scenario import load_scenario
from drake_disasm.stations.hardware import HardwareStation, HoldError
from drake_disasm.stations.hardware_config import load_hardware_config
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm.visualization import MeshcatView, start_meshcat

_NAME = "benchmarks/endurance.py"
COLUMNS = ("time", "mean [ms]", "99 % [ms]", "greatest [ms]")
_FAKE_CELL = str(Path(__file__).parents[1] / "tools" / "fake_cell.py")
#: Not where another cell may be.
_LCM = f"udpm://239.255.76.67:{20_000 + os.getpid() % 20_000}?ttl=0"
_NEAR, _FAR, _STEP = 0.005, 0.02, 0.001  # m
_YIELDS = 5e-5  # m/N, in a step: the grip creeps, and a stiff way would press ever more


class Shuttle:
    """A policy that goes to and fro along the groove, and yields across it."""

    def __init__(self) -> None:
        self._step = _STEP

    def __call__(self, s: np.ndarray) -> np.ndarray:
        """Returns the action (6,) for a state (12,)."""
        if s[0] > _FAR or (s[0] < _NEAR and self._step < 0.0):
            self._step = -_STEP if s[0] > _FAR else _STEP
        action = np.zeros(6)
        action[0] = self._step
        action[1:3] = _YIELDS * s[7:9]
        return action


class Ages:
    """How old samples are at each control step, and a command's way to its echo."""

    def __init__(self, station: HardwareStation) -> None:
        self._station = station
        self.ages: dict[str, list[float]] = {name: [] for name in station.devices}
        self.times: dict[str, list[float]] = {name: [] for name in station.devices}
        self.echoes: list[float] = []
        self._sent: list[tuple[float, np.ndarray]] = []

    def monitor(self, root: Context) -> None:
        """Notes what is known after a step of the diagram."""
        now, station = time.monotonic(), self._station
        for name, reading in station.readings().items():
            self.ages[name].append(reading.age(now))
            self.times[name].append(reading.time)
        context, sent = station.GetMyContextFromRoot(root), station.gate.sent
        if not self._sent or not np.array_equal(sent, self._sent[-1][1]):
            self._sent = [*self._sent[-40:], (now, sent.copy())]
        echo = station.GetOutputPort("iiwa.position_commanded").Eval(context)
        for number, (when, q) in enumerate(self._sent):
            if np.array_equal(q, echo):
                self.echoes.append(now - when)
                del self._sent[: number + 1]
                break

    def rows(self) -> dict[str, list[float]]:
        """Returns what was noted [s], by what it is."""
        rows = {f"{name}, age of the newest sample": a for name, a in self.ages.items()}
        rows["iiwa, command to its echo in the status"] = self.echoes
        for name, times in self.times.items():
            rows[f"{name}, between samples"] = np.diff(np.unique(times)).tolist()
        return rows

    def table_rows(self) -> list[tuple[Cell, ...]]:
        """Returns name, mean, 99 % and greatest of each row, as COLUMNS says."""
        rows: list[tuple[Cell, ...]] = []
        for name, values in self.rows().items():
            ms = 1e3 * np.array(values)
            figures = (ms.mean(), np.percentile(ms, 99), ms.max())
            rows.append((name, *(round(float(figure), 1) for figure in figures)))
        return rows


def run(config: Path, minutes: float, views: Sequence[MeshcatView] = ()) -> Ages:
    """Runs, prints what happened, and returns what was noted.

    Args:
        config: where the devices are.
        minutes: how long.
        views: that watch.
    """
    steps = round(600 * minutes)
    scenario = load_scenario("removal", [f"task.steps={steps + 1}"])
    with HardwareStation(scenario, load_hardware_config(config)) as station:
        simulation = TaskSimulation(scenario, lambda _: station, Shuttle(), views)
        simulation.reset(0)
        ages = Ages(station)
        simulation.simulator.set_monitor(ages.monitor)
        begun, trips = time.monotonic(), 0
        try:
            for _ in tqdm(range(steps), unit="step", mininterval=5):
                simulation.step()
        except HoldError as error:
            trips = 1
            print(error)
        took = time.monotonic() - begun
        print(f"{simulation.steps} steps in {took:.1f} s, {trips} trips, "
              f"{station.supervisor.clamped} commands clamped")  # fmt: skip
        for name, reading in station.readings().items():
            print(f"{name}: {reading.counters.text}")
        return ages


@contextlib.contextmanager
def playing(*options: str) -> Iterator[tuple[Path, "subprocess.Popen[str]"]]:
    """Plays a cell in another process; yields the file by which it is found, and it.

    Args:
        options: of fake_cell.py.
    """
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "fake.yaml"
        fake = subprocess.Popen(
            [
                *(sys.executable, _FAKE_CELL, "--hardware-config", str(config)),
                *("--lcm-url", _LCM, *options),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            while not config.exists():
                time.sleep(0.1)
            yield config, fake
        finally:
            fake.terminate()  # Ctrl-C may be ignored, as behind nohup
            fake.wait()


def _open() -> tuple[int, int]:
    """Returns how many threads run, and how many sockets are open."""
    gc.collect()
    return threading.active_count(), len(psutil.Process().net_connections("inet"))


def main(arguments: Sequence[str]) -> int:
    """Plays the cell in another process, and runs; returns the exit status."""
    tqdm.monitor_interval = 0  # a thread of its own
    parser = program.argument_parser(f"python {_NAME}", __doc__, "")
    parser.add_argument("--minutes", type=options.above_zero, default=10.0, metavar="N")
    parser.add_argument("--meshcat", action="store_true", help="with a page, unwatched")
    add_results_argument(parser)
    args = parser.parse_args(arguments)
    views = [MeshcatView(start_meshcat())] if args.meshcat else []
    with playing() as (config, _):
        before = _open()
        rows = run(config, args.minutes, views).table_rows()
        print(markdown(COLUMNS, rows))
        print(f"threads and sockets before {before}, after {_open()}")
    title = f"Ages of samples in {args.minutes:g} minutes of motion"
    write_result(args.results, title, COLUMNS, rows, _NAME, arguments)
    return 0


if __name__ == "__main__":
    program.run(main)

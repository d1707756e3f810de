"""Motion on the hardware station while everything around it fails now and then.

A fake cell plays the devices. The bolt moves to and fro, episode after episode, while
the policy stands still at random, messages of arm and sensor get lost, and devices are
restarted. A hold ends an episode; the arm is jogged back and the next one begins, as a
person would do. `python benchmarks/disturbed.py --minutes 60 --output DIR` prints what
ended the episodes, the greatest forces, and whether any row of the log was lost.
"""

import collections
import contextlib
import re
import subprocess
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from endurance import Shuttle, playing
from results import Cell, add_results_argument, write_result
from stalls import QUICK_ENOUGH, figures_left_out, go_first
from tqdm import tqdm

from drake_disasm.common import options, program
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import write_text
from drake_disasm.common.progress import ProgressUpdate
from drake_disasm.logs import LogWriter, read_log
from drake_disasm.scenario import load_scenario
from drake_disasm.stations.hardware import HardwareStation, HoldError
from drake_disasm.stations.hardware_config import load_hardware_config
from drake_disasm.task.episode import run_episode
from drake_disasm.task.recording import EpisodeRecorder, transitions_header
from drake_disasm.task.simulation import TaskSimulation

_NAME = "benchmarks/disturbed.py"
_STEPS = 200  # of an episode that nothing ends
_STALLS_EVERY, _FAULTS_EVERY = 3.0, 12.0  # s, on average
_STALL = (0.01, 0.4)  # s, shortest and longest; their logarithm is uniform
_SHORT, _LONG = (0.01, 0.04), (0.1, 1.0)  # s, of losses
_SAID = re.compile(r"greatest force ([\d.]+) N")


class Stalling:
    """A policy that stands still at random."""

    def __init__(self, seed: int) -> None:
        self._policy, self._rng = Shuttle(), np.random.default_rng(seed)
        self._next = time.monotonic() + self._rng.exponential(_STALLS_EVERY)
        self.stalls = 0

    def __call__(self, s: np.ndarray) -> np.ndarray:
        """Returns the action (6,) for a state (12,)."""
        if time.monotonic() > self._next:
            time.sleep(float(np.exp(self._rng.uniform(*np.log(_STALL)))))
            self._next = time.monotonic() + self._rng.exponential(_STALLS_EVERY)
            self.stalls += 1
        return self._policy(s)


class Disturber:
    """Causes losses and restarts in a fake cell, from a thread of its own.

    Attributes:
        caused: how often each.
    """

    def __init__(self, fake: "subprocess.Popen[str]", seed: int) -> None:
        self._fake, self._rng = fake, np.random.default_rng(seed)
        self._lock, self._stopping = threading.Lock(), threading.Event()
        self.caused: collections.Counter[str] = collections.Counter()
        self._thread = threading.Thread(target=self._run, name="disturber")

    def __enter__(self) -> "Disturber":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        self._thread.join()

    def say(self, words: str) -> None:
        """Types something at the fake cell."""
        with self._lock, contextlib.suppress(BrokenPipeError):
            assert self._fake.stdin
            self._fake.stdin.write(f"{words}\n")
            self._fake.stdin.flush()

    def jog(self) -> None:
        """Ends all faults, and has the arm back at the start."""
        self.say("")
        self.say("start")
        self._answer("the arm is at the start")

    def force(self) -> float:
        """Returns the greatest force at the sensor since the start [N]."""
        self.say("force")
        found = _SAID.search(self._answer("greatest force"))
        assert found
        return float(found[1])

    def _answer(self, beginning: str) -> str:
        assert self._fake.stdout
        return next(line for line in self._fake.stdout if line.startswith(beginning))

    def _run(self) -> None:
        while not self._stopping.wait(self._rng.exponential(_FAULTS_EVERY)):
            device = str(self._rng.choice(["iiwa", "ft_sensor", "gripper"]))
            kinds = ["restart"] if device == "gripper" else ["restart", "short", "long"]
            kind = str(self._rng.choice(kinds))
            self.caused[f"{device} {kind}"] += 1
            if kind == "restart":
                self.say(f"{device} restart")
                continue
            self.say(f"{device} loss")
            self._stopping.wait(
                self._rng.uniform(*(_SHORT if kind == "short" else _LONG))
            )
            self.say("")


class Tally:
    """What happened so far; printed at the end, and kept as it comes."""

    def __init__(self) -> None:
        self.ends: collections.Counter[str] = collections.Counter()
        self.forces: list[float] = []
        self.steps: list[int] = []
        self.reasons: list[str] = []

    def text(self) -> str:
        """Returns it in words."""
        lines = [f"{len(self.forces)} episodes, {sum(self.steps)} steps"]
        lines += [
            f"  {count} ended by: {end}" for end, count in self.ends.most_common()
        ]
        if self.forces:
            most = f"greatest {max(self.forces):.1f} N"
            lines.append(
                f"force: {most}, median of episodes {np.median(self.forces):.1f}"
            )
        return "\n".join(lines)


@contextlib.contextmanager
def _ended(tally: Tally) -> Iterator[None]:
    """Takes note of what ends an episode; figures in reasons are left out."""
    try:
        yield
        tally.ends["its last step"] += 1
    except (HoldError, DisasmError) as error:
        reason = str(error).removeprefix("the robot is held: ")
        tally.reasons.append(reason)
        tally.ends[figures_left_out(reason)] += 1


def run(minutes: float, folder: Path, seed: int) -> Tally:
    """Runs episodes until the time is over, into a log in the folder."""
    tally, end = Tally(), time.monotonic() + 60 * minutes
    scenario = load_scenario("removal", [f"task.steps={_STEPS}"])
    header = transitions_header(
        scenario,
        "hardware",
        program.provenance(f"python {_NAME}", [], seed),
    )
    writer = LogWriter(folder / "log", header)
    with (
        playing("--set", QUICK_ENOUGH) as (config, fake),
        Disturber(fake, seed) as disturber,
        HardwareStation(scenario, load_hardware_config(config)) as station,
        tqdm(total=round(60 * minutes), unit="s") as bar,
    ):
        policy = Stalling(seed)
        simulation = TaskSimulation(scenario, lambda _: station, policy)
        while time.monotonic() < end:
            disturber.jog()
            station.resume()
            _one_episode(simulation, station, writer, tally)
            tally.forces.append(disturber.force())
            bar.update(round(60 * minutes - max(0.0, end - time.monotonic())) - bar.n)
            text = f"{tally.text()}\ncaused: {dict(disturber.caused)}"
            text += f", {policy.stalls} stalls"
            counts = {n: r.counters.text for n, r in station.readings().items()}
            text += f"\npace: {station.counts()}\ndevices: {counts}\n"
            text += "".join(f"{reason}\n" for reason in tally.reasons)
            write_text(folder / "tally.txt", text)
    print(tally.text())
    return tally


def _one_episode(
    simulation: TaskSimulation,
    station: HardwareStation,
    writer: LogWriter,
    tally: Tally,
) -> None:
    """Runs and records one episode, however it ends."""
    done = 0

    def count(update: ProgressUpdate) -> None:
        """Takes note of the steps done."""
        nonlocal done
        done = int(update.done)

    with _ended(tally), writer.begin_episode() as episode:
        recorder = EpisodeRecorder(simulation, episode)
        run_episode(simulation, len(tally.forces), recorder, count)
    if done:
        tally.steps.append(done)
        writer.note(pace=station.counts())


def rows_lost(folder: Path, tally: Tally) -> int:
    """Returns how many of the steps are not in the log."""
    episodes = [e for e in read_log(folder / "log").episodes if e.rows > 1]
    kept = [episode.rows - 1 for episode in episodes]
    if len(kept) < len(tally.steps):
        return sum(tally.steps) - sum(kept)
    return sum(max(0, s - k) for s, k in zip(tally.steps, kept, strict=False))


def table_rows(tally: Tally, lost: int) -> list[tuple[Cell, ...]]:
    """Returns what happened as rows of a name and a figure."""
    forces = tally.forces or [0.0]
    usual = round(float(np.median(forces)), 1)
    return [
        ("episodes", len(tally.forces)),
        ("steps", sum(tally.steps)),
        *((f"ended by: {end}", count) for end, count in tally.ends.most_common()),
        ("greatest force [N]", round(max(forces), 1)),
        ("median of the episodes' greatest forces [N]", usual),
        ("rows of the log lost", lost),
    ]


def main(arguments: Sequence[str]) -> int:
    """Runs, and prints what happened; returns the exit status."""
    tqdm.monitor_interval = 0  # a thread of its own
    parser = program.argument_parser(f"python {_NAME}", __doc__, "")
    add = parser.add_argument
    add("--minutes", type=options.above_zero, default=10.0, metavar="N")
    add("--seed", type=options.seed, default=0)
    add("--output", type=Path, default=Path("out/disturbed"), metavar="DIR")
    add_results_argument(parser)
    args = parser.parse_args(arguments)
    go_first(1)
    args.output.mkdir(parents=True, exist_ok=True)
    tally = run(args.minutes, args.output, args.seed)
    lost = rows_lost(args.output, tally)
    print(f"rows lost: {lost}")
    title = f"{args.minutes:g} minutes with stalls, losses and restarts"
    rows = table_rows(tally, lost)
    write_result(args.results, title, ("what", "figure"), rows, _NAME, arguments)
    return 0


if __name__ == "__main__":
    program.run(main)

"""Measures speed and memory, each figure in this run on this machine.

Prints one table: the figure, what it is compared with in the same run, and their
ratio. Figures are medians of repeats, in a process of one thread. It is a
measurement, not a test: nothing here passes or fails.
"""

import argparse
import functools
import os
import statistics
import subprocess
import sys
import tempfile
import time
import timeit
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import batch_speed
import endurance
import numpy as np
import psutil
import training_speed
from effect_matrix import (
    COUNTS,
    LEVELS,
    closing_time,
    counted,
    in_words,
    run_matrix,
)
from objective_speed import (
    SIZES,
    THESIS_S,
    cores,
    evaluation_time,
    jacobian_times,
    recorded_log,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from results import Cell, add_results_argument, significant, write_result
from tqdm import tqdm
from update_speed import measure_updates

from drake_disasm.common import options, program
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import make_folder, write_json
from drake_disasm.common.quantity import closest
from drake_disasm.common.timing import boundary
from drake_disasm.mdp import Outcome
from drake_disasm.policies import LearnedPolicy, Network, TaskView, make_policy
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.stations import make_station
from drake_disasm.stations.hardware_config import load_hardware_config
from drake_disasm.task.diagram import add_motion
from drake_disasm.task.simulation import TaskSimulation

_NAME = "benchmarks/benchmark.py"
_REPEATS = 5
_CLOSING_AIM_S = 300.0
_LATENCY_MINUTES = 0.5
_LATENCIES = ("iiwa_age", "gripper_age", "ft_sensor_age", "echo")
_SCENARIO = "removal_turned"  # the bolt is in contact nearly all the time
_POLICY = "admittance"
_WIDTHS = (12, 128, 128, 128, 6)  # of the policy whose inference is timed


@dataclass(frozen=True)
class Figure:
    """One row.

    Attributes:
        key: the design's fixed name.
        value: as measured.
        unit: of the value.
        reference: what it is compared with.
        ratio: value over reference (or the other way, as `reference` says).
    """

    key: str
    value: float
    unit: str
    reference: str = ""
    ratio: float | None = None


def _episode(simulation: TaskSimulation, seed: int) -> tuple[float, int]:
    """Returns the wall time [s] and steps of one episode, without its reset."""
    simulation.reset(seed)
    start, steps = time.perf_counter(), 0
    outcome = Outcome.RUNNING
    while outcome is Outcome.RUNNING:
        outcome, steps = simulation.step().outcome, steps + 1
    return time.perf_counter() - start, steps


def measure_speed(station: str) -> Iterator[Figure]:
    """Yields real-time factor and steps per second of a station."""
    simulation = _simulation(station)
    _episode(simulation, 0)  # warms up
    runs = [_episode(simulation, seed) for seed in range(_REPEATS)]
    per_step = statistics.median(wall / steps for wall, steps in runs)
    period = simulation.scenario.task.period
    yield Figure(
        f"{station}_real_time_factor",
        period / per_step,
        "1",
        "real time",
        period / per_step,
    )
    yield Figure(
        f"{station}_steps_per_s", 1.0 / per_step, "1/s", "10 Hz", 0.1 / per_step
    )


def measure_reset(station: str) -> Iterator[Figure]:
    """Yields the cost of a reset in place, compared with a new diagram."""
    simulation = _simulation(station)
    simulation.reset(0)
    reset = _median_time(lambda: simulation.reset(1), 50)
    build = _median_time(lambda: _simulation(station).reset(0), _REPEATS)
    yield Figure(
        f"{station}_reset_ms", 1e3 * reset, "ms", "building and settling", reset / build
    )


def measure_python_share() -> Iterator[Figure]:
    """Yields the share of a twin step that Drake alone would not need.

    The reference replays the episode's commanded rates through the same station
    with Drake's C++ systems only: the same motion and contact, no Python at all.
    """
    simulation = _simulation("twin")
    rates = _commanded_rates(simulation)
    wholes, replays = [], []
    for _ in range(_REPEATS):  # in turns: what else runs here falls on both
        wall, steps = _episode(simulation, 0)
        wholes.append(wall / steps)
        replays.append(_replay(simulation.scenario, rates) / len(rates))
    # The fastest of each: other work on the machine only ever adds time.
    whole, drake = min(wholes), min(replays)
    yield Figure(
        "twin_python_share", 1.0 - drake / whole, "1", "Drake alone", drake / whole
    )


def _commanded_rates(simulation: TaskSimulation) -> list[np.ndarray]:
    """Returns the commanded rate (6,) of each period of an episode."""
    simulation.reset(0)
    rates, outcome = [], Outcome.RUNNING
    while outcome is Outcome.RUNNING:
        outcome = simulation.step().outcome
        rates.append(
            simulation.evaluate(simulation.systems.pose_target, "velocity").copy()
        )
    return rates


def _replay(scenario: Scenario, rates: list[np.ndarray]) -> float:
    """Returns the wall time [s] that Drake alone takes for the same motion."""
    builder = DiagramBuilder()
    station = builder.AddNamedSystem("station", make_station("twin", scenario))
    source = builder.AddNamedSystem("rate", ConstantVectorSource(np.zeros(6)))
    add_motion(builder, source.get_output_port(), station)
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    root = simulator.get_mutable_context()
    value = source.get_mutable_source_value(source.GetMyMutableContextFromRoot(root))
    start = time.perf_counter()
    for k, commanded in enumerate(rates):
        value.SetFromVector(commanded)
        simulator.AdvanceTo(boundary(k + 1, scenario.task.period))
    return time.perf_counter() - start


def measure_latency() -> Iterator[Figure]:
    """Yields the 99 % quantile of ages and delays, compared with what is stale.

    Of the hardware station with a fake cell in another process, in real time.
    """
    with endurance.playing() as (config, _):
        limits = load_hardware_config(config).safety
        try:
            noted = endurance.run(config, _LATENCY_MINUTES)
        except DisasmError as error:
            tqdm.write(f"hardware_..._ms left out: {error}")
            return
    for name, ages in noted.ages.items():
        stale = limits.stale_after(name)
        age = float(np.percentile(ages, 99))
        key = f"hardware_{name}_age_ms"
        yield Figure(key, 1e3 * age, "ms", "when it is stale", age / stale)
    echo = float(np.percentile(noted.echoes, 99))
    stale = limits.stale_after("iiwa")
    yield Figure("hardware_echo_ms", 1e3 * echo, "ms", "a stale arm", echo / stale)


def measure_batches() -> Iterator[Figure]:
    """Yields steps per second of twins in batches, compared with the diagram's."""
    for key, value, ratio in batch_speed.speeds():
        yield Figure(key, value, "1/s", "the diagram with IMPACT", ratio)


def measure_training() -> Iterator[Figure]:
    """Yields the time of a training, compared with stable-baselines3's."""
    ours, theirs = training_speed.beside_sb3()
    ratio = ours / theirs if theirs else None
    reference = "stable-baselines3" if theirs else "(stable-baselines3 is not there)"
    yield Figure("training_chapter4_s", ours, "s", reference, ratio)


def measure_lockstep() -> Iterator[Figure]:
    """Yields the time of trainings in lockstep, compared with one by one."""
    together, alone = training_speed.side_by_side()
    key, reference = f"training_lockstep_{training_speed.SEEDS}_s", "one by one"
    yield Figure(key, together, "s", reference, together / alone)


def measure_batch_memory() -> Iterator[Figure]:
    """Yields peak memory of batches of twins in NumPy, compared with one twin's."""
    one = _peak_mib(batch_speed.command(1))
    for count in batch_speed.SIZES:
        peak = _peak_mib(batch_speed.command(count)) if count > 1 else one
        yield Figure(f"peak_mib_batch_{count}", peak, "MiB", "one twin", peak / one)


def tool(name: str) -> list[str]:
    """Returns the command that runs a program of tools/."""
    return [sys.executable, str(Path(__file__).parents[1] / "tools" / f"{name}.py")]


def measure_memory() -> Iterator[Figure]:
    """Yields peak memory of the programs, compared with bare imports."""
    peak = _peak_mib([*tool("simulate"), "--no-meshcat"])
    bare = _peak_mib([sys.executable, "-c", "import pydrake.all"])
    yield Figure("peak_mib_simulate", peak, "MiB", "import pydrake.all", peak / bare)
    with tempfile.TemporaryDirectory() as folder:
        training = [
            "--preset",
            "chapter4",
            "--episodes",
            "20",
            "--out",
            f"{folder}/out",
        ]
        peak = _peak_mib([*tool("train"), *training])
    bare = _peak_mib([sys.executable, "-c", "import torch, pydrake.all"])
    yield Figure(
        "peak_mib_train", peak, "MiB", "import torch, pydrake.all", peak / bare
    )
    with recorded_log(100) as log, tempfile.TemporaryDirectory() as folder:
        options = ["--preset", "thesis", "--cycles", "2", "--workers", "1"]
        fitting = ["--log", str(log), "--parameters", "contact.friction", *options]
        peak = _peak_mib([*tool("identify"), *fitting, "--out", f"{folder}/out"])
    bare = _peak_mib([sys.executable, "-c", "import scipy.stats, pydrake.all"])
    yield Figure(
        "peak_mib_identify", peak, "MiB", "import scipy, pydrake.all", peak / bare
    )


def measure_objective(contact: str, prefix: str) -> Iterator[Figure]:
    """Yields the time of evaluating the objective, compared with the thesis's."""
    with recorded_log(max(SIZES)) as log:
        both = {}
        for size in SIZES:
            both[size] = evaluation_time(log, size, cores(), 3, contact)
            reference = "the thesis's 10 minutes"
            ratio = both[size] / THESIS_S
            yield Figure(f"{prefix}_{size}_s", both[size], "s", reference, ratio)
        alone = evaluation_time(log, SIZES[0], 1, 2, contact)
    reference = f"{cores()} cores"
    ratio = alone / both[SIZES[0]]
    yield Figure(f"{prefix}_883_one_core_s", alone, "s", reference, ratio)


def measure_jacobian() -> Iterator[Figure]:
    """Yields the time of all candidates' derivatives, compared with evaluations."""
    with recorded_log(SIZES[0]) as log:
        for workers, name in ((cores(), "s"), (1, "one_core_s")):
            one, value, count = jacobian_times(log, SIZES[0], workers)
            key, reference = f"jacobian_impact_883_{name}", f"{count} evaluations"
            yield Figure(key, value, "s", reference, value / (count * one))


def measure_closing(contact: str, key: str) -> Iterator[Figure]:
    """Yields the time from a log to the verdict."""
    value = closing_time(SIZES[0], cores(), contact)
    yield Figure(key, value, "s", "300 s, the aim", value / _CLOSING_AIM_S)


def measure_update_speed(name: str) -> Iterator[Figure]:
    """Yields DDPG updates per second of a preset, compared with stable-baselines3."""
    ours, theirs = measure_updates(name)
    ratio = ours / theirs if theirs else None
    reference = "stable-baselines3" if theirs else "(stable-baselines3 is not there)"
    yield Figure(f"updates_per_s_{name}", ours, "1/s", reference, ratio)
    if ratio:
        yield Figure(f"updates_ratio_sb3_{name}", ratio, "1", reference, ratio)


def _peak_mib(command: list[str]) -> float:
    """Returns the greatest resident memory of a process [MiB]."""
    with subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        watched, peak = psutil.Process(process.pid), 0
        while process.poll() is None:
            try:
                memory = watched.memory_info()
            except psutil.NoSuchProcess:
                break
            peak = max(peak, memory.rss)
            time.sleep(0.01)
    if process.returncode:
        raise DisasmError(f"{' '.join(command)} failed; run it by hand to see why")
    return peak / 2**20


def _simulation(station: str) -> TaskSimulation:
    return TaskSimulation(load_scenario(_SCENARIO), station, make_policy(_POLICY))


def measure_inference() -> Iterator[Figure]:
    """Yields the time of one call of a policy, compared with torch's network alone."""
    generator = np.random.default_rng(0)
    sizes = list(zip(_WIDTHS[1:], _WIDTHS, strict=False))
    network = Network(
        tuple(generator.normal(0.0, 0.1, size).astype(np.float32) for size in sizes),
        tuple(np.zeros(rows, np.float32) for rows, _ in sizes),
    )
    policy = LearnedPolicy(network, TaskView(np.ones(12), np.ones(6)))
    observation = generator.standard_normal(12)
    ours = _short_time(lambda: policy(observation))
    theirs = _torch_inference(network)
    reference, ratio = ("the network in torch", ours / theirs) if theirs else ("", None)
    yield Figure("policy_inference_us", 1e6 * ours, "us", reference, ratio)


def _torch_inference(network: Network) -> float | None:
    """Returns the time [s] of the same network in eager torch, if there is torch."""
    try:
        import torch
    except ImportError:
        return None
    layers: list[torch.nn.Module] = []
    for weight, bias in zip(network.weights, network.biases, strict=True):
        layer = torch.nn.Linear(weight.shape[1], weight.shape[0])
        values = {"weight": torch.from_numpy(weight), "bias": torch.from_numpy(bias)}
        layer.load_state_dict(values)
        layers += [layer, torch.nn.ReLU()]
    module, x = torch.nn.Sequential(*layers[:-1]), torch.ones(_WIDTHS[0])
    with torch.inference_mode():
        return _short_time(lambda: module(x))


def _short_time(work: Callable[[], object]) -> float:
    """Returns the time [s] of what takes microseconds, many at a time."""
    return statistics.median(timeit.repeat(work, number=1000, repeat=20)) / 1000


def _median_time(work: Callable[[], object], repeats: int) -> float:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


#: Which keys each measurement gives, in the order of the table.
MEASUREMENTS: dict[tuple[str, ...], Callable[[], Iterator[Figure]]] = {
    ("cell_real_time_factor", "cell_steps_per_s"): lambda: measure_speed("cell"),
    ("twin_real_time_factor", "twin_steps_per_s"): lambda: measure_speed("twin"),
    ("twin_python_share",): measure_python_share,
    ("cell_reset_ms",): lambda: measure_reset("cell"),
    ("twin_reset_ms",): lambda: measure_reset("twin"),
    ("policy_inference_us",): measure_inference,
    (
        *(f"diagram_{contact}_steps_per_s" for contact in batch_speed.CONTACTS),
        *(f"batch_{kind}_{count}_steps_per_s" for kind, count in batch_speed.BATCHES),
    ): measure_batches,
    **{
        (f"updates_per_s_{name}", f"updates_ratio_sb3_{name}"): functools.partial(
            measure_update_speed, name
        )
        for name in ("chapter3", "chapter4", "chapter5")
    },
    **{
        tuple(f"{prefix}_{of}_s" for of in ("883", "1776", "883_one_core")): (
            functools.partial(measure_objective, contact, prefix)
        )
        for contact, prefix in (
            ("hydroelastic", "objective"),
            ("impact", "objective_impact"),
        )
    },
    ("jacobian_impact_883_s", "jacobian_impact_883_one_core_s"): measure_jacobian,
    ("close_loop_883_s",): lambda: measure_closing("hydroelastic", "close_loop_883_s"),
    ("close_loop_impact_883_s",): lambda: measure_closing(
        "impact", "close_loop_impact_883_s"
    ),
    ("training_chapter4_s",): measure_training,
    (f"training_lockstep_{training_speed.SEEDS}_s",): measure_lockstep,
    tuple(f"hardware_{of}_ms" for of in _LATENCIES): measure_latency,
    ("peak_mib_simulate", "peak_mib_train", "peak_mib_identify"): measure_memory,
    tuple(f"peak_mib_batch_{n}" for n in batch_speed.SIZES): measure_batch_memory,
}


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    keys = [key for group in MEASUREMENTS for key in group]
    known = f"keys: {', '.join(keys)}"
    parser = program.argument_parser("python benchmarks/benchmark.py", __doc__, known)
    parser.add_argument("--only", nargs="+", metavar="KEY", help="run a part")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write figures")
    add_results_argument(parser)
    parser.add_argument(
        "--effects",
        type=Path,
        metavar="DIR",
        help="instead: blind tests of closing the loop, each effect at three sizes, "
        "several, none, one that the library lacks; takes hours, Ctrl-C and the "
        "same command go on; writes results.jsonl, effects.md, confusion.png",
    )
    for name, usual, words in COUNTS:
        parser.add_argument(
            f"--{name.replace('_', '-')}",
            type=options.count,
            default=usual,
            metavar="N",
            help=f"with --effects: {words} (default: {usual})",
        )
    parser.add_argument(
        "--levels",
        type=options.above_zero,
        nargs="+",
        default=LEVELS,
        metavar="X",
        help="with --effects: sizes of single effects, times the noise "
        "(default: 1 2 5)",
    )
    parser.add_argument(
        "--first-seed",
        type=options.seed,
        default=0,
        metavar="N",
        help="with --effects: of the seeds, which count up from it; none that a "
        "threshold was chosen by (default: 0)",
    )
    args = parser.parse_args(arguments)
    for key in args.only or []:
        if key not in keys:
            raise DisasmError(f"--only {key}: no such figure; {closest(key, keys)}")
    return args


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    if args.effects:
        counts = {name: getattr(args, name) for name, _, _ in COUNTS}
        found = run_matrix(args.effects, counts, args.first_seed, args.levels)
        print(in_words(found))
        head = ("logs", "counted", "passed", "of", "95 % interval [%]")
        table_of = ("Blind tests of closing the loop", head, counted(found))
        write_result(args.results, *table_of, _NAME, arguments)
        return 0
    wanted = set(args.only) if args.only else {k for g in MEASUREMENTS for k in g}
    groups = {g: m for g, m in MEASUREMENTS.items() if wanted & set(g)}
    figures: list[Figure] = []
    for measure in tqdm(groups.values(), unit="group", leave=False):
        figures += [figure for figure in measure() if figure.key in wanted]
    print(table(figures))
    if args.json:
        make_folder(args.json.parent)
        write_json(args.json, {f.key: f.value for f in figures})
    write_result(args.results, *as_rows(figures), _NAME, arguments)
    return 0


def as_rows(
    figures: list[Figure],
) -> tuple[str, Sequence[str], Sequence[Sequence[Cell]]]:
    """Returns the figures as title, columns and rows of a result."""
    columns = ("figure", "value", "unit", "compared with", "ratio")
    rows = [
        (f.key, significant(f.value), f.unit, f.reference, _ratio(f.ratio))
        for f in figures
    ]
    return "Speed and memory", columns, rows


def _ratio(ratio: float | None) -> str:
    return "" if ratio is None else f"{ratio:.3g}"


def table(figures: list[Figure]) -> str:
    """Returns the figures as a table for a terminal."""
    width = max([26, *(len(figure.key) for figure in figures)])
    lines = [f"{'figure':{width}} {'value':>10} {'unit':5} {'ratio':>8}  compared with"]
    for f in figures:
        ratio = _ratio(f.ratio)
        lines.append(
            f"{f.key:{width}} {f.value:10.4g} {f.unit:5} {ratio:>8}  {f.reference}"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    program.run(main)

"""Prints the tables and draws the figure of docs/identification.md.

python -m tests.sysid.measurements steps            time steps against accuracy
python -m tests.sysid.measurements recovery twin    ten noise seeds, known truth
python -m tests.sysid.measurements recovery cell
python -m tests.sysid.measurements recovery impact  a twin with IMPACT
python -m tests.sysid.measurements thesis FIGURE    the thesis's three settings
python -m tests.sysid.measurements package          our Bees and bees_algorithm
python -m tests.sysid.measurements surrogate        with and without, equal budget
"""

import argparse
import dataclasses
import json
import tempfile
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from drake_disasm.common.executors import WorkerPool
from drake_disasm.logs import Log, read_log
from drake_disasm.policies import Exploring, make_policy
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.task.recording import record_transitions
from drake_disasm.task.simulation import TaskSimulation
from sysid.identification.gauss_newton import gauss_newton
from sysid.identification.result import MethodResult
from sysid.identification.search import Search
from sysid.identification.settings import SearchSettings
from sysid.identification.uncertainty import uncertainty
from sysid.models.twin import TwinModel
from sysid.objective import Objective
from sysid.optimise import BeesAlgorithm, BeesSettings, Box
from sysid.optimise.bees import Stop
from sysid.parameters import Parameter
from sysid.scenario_parameters import Request, scenario_parameters
from sysid.workers import Workers
from tests.sysid.optimise.functions import STANDARD
from tests.sysid.optimise.test_against_package import ours, theirs

TRUTH = load_scenario("removal_turned")
BOUNDS = (
    Request("contact.friction", 0.0, 0.6),
    Request("lock.clearance", 2e-4, 8e-4),
    Request("GroovePose.ry", -0.08, 0.08),
    Request("GroovePose.z", -5e-4, 5e-4),
    Request("gripper.stiffness.2", 200.0, 2000.0),
)
#: The thesis's contact in the twin, and the parameters of its table 4.2.
IMPACT = load_scenario("removal_turned", ["contact.model=impact"])
IMPACT_BOUNDS = tuple(
    Request(f"contact.impact.{name}")
    for name in ("stiffness", "exponent", "damping", "depth")
)
STIFFNESS = Request("contact.impact.stiffness", 10.0, 1e5, scale="log")
EXPONENT = Request("contact.impact.exponent")
#: Off the truth by some ten times what a log fixes: the valley, not the bottom.
START = np.array([0.23, 4.3e-4, 0.0365, 2e-5, 650.0])
EXPLORATION = 1.5e-4  # m
HUBER = 3.0


def record(
    folder: Path, scenario: Scenario, model: str, transitions: int, seed: int
) -> Log:
    """Records episodes of `admittance` with exploration until there are enough."""
    policy = Exploring(make_policy("admittance"), EXPLORATION, seed)
    simulation = TaskSimulation(scenario, model, policy)
    return record_transitions(folder, simulation, transitions, seed)


@dataclasses.dataclass(frozen=True)
class Case:
    """What is recovered from what.

    Attributes:
        truth: scenario that is recorded.
        station: that records it, "cell" or "twin".
        model: scenario that is fitted, at its nominal values.
        requests: its free parameters.
        start: of the descent, near the truth.
    """

    truth: Scenario
    station: str
    model: Scenario
    requests: tuple[Request, ...]
    start: np.ndarray

    def fitted(self, log: Log, transitions: int, coarse: bool = True) -> TwinModel:
        """Returns the model of a log."""
        scenario, parameters = scenario_parameters(self.model, self.requests)
        model = TwinModel([log], scenario, parameters, coarse=coarse)
        return model.first(transitions)

    def true_values(self) -> tuple[tuple[Parameter, ...], np.ndarray]:
        """Returns the parameters and their true values."""
        _, parameters = scenario_parameters(self.truth, self.requests)
        return parameters, np.array([p.nominal for p in parameters])


REMOVAL = load_scenario("removal")
CASES = {
    "twin": Case(TRUTH, "twin", REMOVAL, BOUNDS, START),
    "cell": Case(TRUTH, "cell", REMOVAL, BOUNDS, START),
    # Slow sliding says nothing of IMPACT's damping and its depth. Stiffness by its
    # logarithm: what the log fixes, k p^e at some depth, is then a straight valley.
    "impact": Case(
        IMPACT,
        "twin",
        load_scenario("removal", ["contact.model=impact"]),
        (*BOUNDS[:3], STIFFNESS, EXPONENT),
        np.array([0.23, 4.3e-4, 0.0365, 1200.0, 1.05]),
    ),
}


def measure_recovery(name: str, seeds: int = 10) -> None:
    """Prints values and intervals for logs of ten noise seeds, and their coverage."""
    case = CASES[name]
    parameters, truth = case.true_values()
    rows = []
    with tempfile.TemporaryDirectory() as folder, Workers(2) as workers:
        for seed in range(seeds):
            begin = time.perf_counter()
            log = record(
                Path(folder) / str(seed), case.truth, case.station, 883, 1000 * seed
            )
            # A twin's log in the twin's own steps: what is left is the sensor's noise.
            fitted = case.fitted(log, 883, coarse=case.station == "cell")
            objective = Objective(fitted, workers, HUBER)
            quarter = Objective(objective.model.thin(4), workers, HUBER)
            near = gauss_newton(quarter, quarter.scaling.to_unit(case.start), 10)
            linearisation = gauss_newton(objective, near.u, 3)
            spread = uncertainty(linearisation, objective.model.measurements.episode)
            scaling, theta = (
                objective.scaling,
                objective.scaling.from_unit(linearisation.u),
            )
            inside = []
            for interval in (spread.gauss_newton, spread.bootstrap):
                low, high = (
                    scaling.from_unit(linearisation.u + side) for side in interval.T
                )
                inside.append((low < truth) & (truth < high))
            rows.append((theta, high - low, *inside))
            print(
                f"seed {seed}: f {objective.value(linearisation.residual):.3f} "
                f"at truth {objective(truth)[0]:.3f}",
                " ".join(f"{v:.5g}" for v in theta),
                f"block {spread.block}, {time.perf_counter() - begin:.0f} s",
                flush=True,
            )
            _print_recovery(parameters, truth, rows)


def _print_recovery(
    parameters: tuple[Parameter, ...], truth: np.ndarray, rows: list
) -> None:
    theta, width, by_gn, by_bootstrap = (
        np.array(part) for part in zip(*rows, strict=True)
    )
    if len(rows) < 2:
        return
    print("| parameter | truth | mean | spread | 95 % half width | GN | bootstrap |")
    print("|---|---|---|---|---|---|---|")
    for i, p in enumerate(parameters):
        print(
            f"| {p.name} | {truth[i]:.5g} | {theta[:, i].mean():.5g} | "
            f"{theta[:, i].std(ddof=1):.2g} | {width[:, i].mean() / 2:.2g} | "
            f"{by_gn[:, i].sum()}/{len(theta)} | "
            f"{by_bootstrap[:, i].sum()}/{len(theta)} |"
        )
    print(f"coverage: {by_gn.mean():.2f} and {by_bootstrap.mean():.2f}", flush=True)


def measure_steps() -> None:
    """Prints cost and error of time steps against the finest, noise-free."""
    quiet = load_scenario(
        "removal_turned",
        ["simulation.twin_time_step=0.00125", "ft_sensor.noise=[0, 0, 0, 0, 0, 0]"],
    )
    with tempfile.TemporaryDirectory() as folder:
        log = record(Path(folder) / "log", quiet, "twin", 320, 0)
    for time_step in (0.00125, 0.0025, 0.005, 0.01, 0.02):
        for coarse in (False, True):
            _print_step(log, time_step, coarse)


def _print_step(log: Log, time_step: float, coarse: bool) -> None:
    overrides = [f"simulation.twin_time_step={time_step}"]
    scenario, parameters = scenario_parameters(
        load_scenario("removal_turned", overrides), [Request("contact.friction")]
    )
    objective = Objective(
        TwinModel([log], scenario, parameters, coarse=coarse), Workers(), HUBER
    )
    theta = np.array([parameters[0].nominal])
    objective(theta)
    begin = time.perf_counter()
    residual = objective.residuals(theta)[0]
    cost = 1e3 * (time.perf_counter() - begin) / len(residual)
    noise = objective.model.measurements.noise
    force = np.abs(residual * noise)[:, 6:9].max(axis=1)
    median, most, nearly_all = np.quantile(force, [0.5, 0.95, 0.99])
    print(
        f"| {1e3 * time_step:g} | {'20 ms first' if coarse else '-'} | {cost:.1f} | "
        f"{objective.value(residual):.2f} | {median:.4f} | {most:.3f} | "
        f"{nearly_all:.2f} |",
        flush=True,
    )


THESIS_SETTINGS = {
    "883 transitions, 10 cycles": (883, 10, BeesSettings.thesis()),
    "1776 transitions, 10 cycles": (1776, 10, BeesSettings.thesis()),
    "883 transitions, 20 cycles": (883, 20, BeesSettings.thesis()),
    "883 transitions, 20 cycles of 16": (883, 20, BeesSettings()),
}
THESIS = Case(TRUTH, "cell", IMPACT, IMPACT_BOUNDS, START)


def measure_thesis(figure: Path) -> None:
    """Draws objective against evaluations for the thesis's settings, five seeds."""
    with tempfile.TemporaryDirectory() as folder:
        log = record(Path(folder) / "log", THESIS.truth, THESIS.station, 1776, 0)
        jobs = [
            (str(log.folder), setting, method, seed)
            for setting in reversed(THESIS_SETTINGS)  # the longest first
            for seed in range(5)
            for method in ("bees", "nlopt")
        ]
        with WorkerPool(2) as pool:
            traces = pool.map(_thesis_run, jobs)
    kept = [
        dict(zip(("setting", "method", "seed"), job[1:], strict=True)) | found
        for job, found in zip(jobs, traces, strict=True)
    ]
    figure.with_suffix(".json").write_text(json.dumps(kept))
    draw_thesis(figure)


def _thesis_run(job: tuple) -> dict:
    """Returns the values and the best point of one search, on one core."""
    folder, setting, method, seed = job
    transitions, cycles, colony = THESIS_SETTINGS[setting]
    objective = Objective(THESIS.fitted(read_log(folder), transitions), Workers())
    settings = SearchSettings(
        cycles=cycles, local_evaluations=0, bees=colony, seed=seed
    )
    found: MethodResult = Search(method, [objective], settings).run()
    theta = objective.scaling.from_unit(found.u).tolist()
    print(*job[1:], f"{found.value:.2f}", np.round(theta, 3), flush=True)
    return {"values": found.stages[0].trace.values, "theta": theta}


def draw_thesis(figure: Path) -> None:
    """Draws the traces that `measure_thesis` kept."""
    kept = json.loads(figure.with_suffix(".json").read_text())
    drawn = Figure(figsize=(13.0, 3.6), layout="constrained")
    axes = drawn.subplots(1, len(THESIS_SETTINGS), sharey=True)
    for ax, setting in zip(axes, THESIS_SETTINGS, strict=True):
        for entry in (e for e in kept if e["setting"] == setting):
            colour = {"bees": "#d98c00", "nlopt": "#2060a0"}[entry["method"]]
            best = np.minimum.accumulate(entry["values"])
            label = entry["method"] if entry["seed"] == 0 else None
            ax.step(range(1, len(best) + 1), best, color=colour, label=label, lw=1.0)
        ax.set_title(setting, fontsize=9)
        ax.set_xlabel("evaluations")
        ax.legend(fontsize=8)
    axes[0].set_ylabel("objective, best so far")
    drawn.savefig(figure, dpi=110)


def measure_package(seeds: int = 10) -> None:
    """Prints the best values of our Bees and of the package at equal evaluations."""
    print(
        "| function | ours, median (best ... worst) | bees_algorithm |\n|---|---|---|"
    )
    for name in STANDARD:
        found = [[find(name, seed) for seed in range(seeds)] for find in (ours, theirs)]
        cells = [f"{np.median(f):.3g} ({min(f):.2g} ... {max(f):.2g})" for f in found]
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


def measure_surrogate(seeds: int = 5) -> None:
    """Prints what proposals in place of scouts are worth, at equal evaluations."""
    from sysid.optimise.surrogate import propose

    colony, stop = BeesSettings(4, 2, 2, 0, 0), Stop(evaluations=128)
    with tempfile.TemporaryDirectory() as folder, Workers(2) as workers:
        log = record(Path(folder) / "log", TRUTH, "twin", 883, 0)
        model = CASES["twin"].fitted(log, 883).thin(14)
        objective = Objective(model, workers, HUBER)
        for seed in range(seeds):
            values = []
            for hook in (None, propose):
                bees = BeesAlgorithm(Box.unit(5), colony, seed, hook)
                trace = bees.run(
                    lambda u: objective(objective.scaling.from_unit(u)), stop=stop
                )
                values.append(trace.best_value)
            print(
                f"seed {seed}: alone {values[0]:.2f}, with {values[1]:.2f}", flush=True
            )


def main() -> None:
    """Runs one of the measurements."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what")
    parser.add_argument("argument", nargs="?", default="")
    args = parser.parse_args()
    measurements = {
        "steps": measure_steps,
        "recovery": lambda: measure_recovery(args.argument),
        "thesis": lambda: measure_thesis(Path(args.argument)),
        "package": measure_package,
        "surrogate": measure_surrogate,
    }
    measurements[args.what]()


if __name__ == "__main__":
    main()

"""How exactly identification finds known parameters, and what its settings cost.

Measurements, each of which prints a table:

  steps      accuracy and cost of the twin's time steps, on a noise-free log
  recovery   values and coverage of the intervals for logs of several noise seeds
  thesis     the search in the thesis's three settings, by Bees and by NLopt; a figure
  surrogate  the search with and without a surrogate, at equally many evaluations
"""

import argparse
import dataclasses
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from answers import complete
from matplotlib.figure import Figure
from results import Cell, add_results_argument, write_result

from drake_disasm.common import options, program
from drake_disasm.common.executors import WorkerPool
from drake_disasm.common.files import make_folder, write_figure
from drake_disasm.common.finished_work import FinishedWork
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
from sysid.optimise.surrogate import propose
from sysid.parameters import Parameter
from sysid.scenario_parameters import ParameterRequest, scenario_parameters
from sysid.workers import Workers

TRUTH = load_scenario("removal_turned")
BOUNDS = (
    ParameterRequest("contact.friction", 0.0, 0.6),
    ParameterRequest("part.clearance", 2e-4, 8e-4),
    ParameterRequest("GroovePose.ry", -0.08, 0.08),
    ParameterRequest("GroovePose.z", -5e-4, 5e-4),
    ParameterRequest("gripper.stiffness.2", 200.0, 2000.0),
)
#: The thesis's contact in the twin, and the parameters of its table 4.2.
IMPACT = load_scenario("removal_turned", ["contact.model=impact"])
IMPACT_BOUNDS = tuple(
    ParameterRequest(f"contact.impact.{name}")
    for name in ("stiffness", "exponent", "damping", "depth")
)
STIFFNESS = ParameterRequest("contact.impact.stiffness", 10.0, 1e5, scale="log")
EXPONENT = ParameterRequest("contact.impact.exponent")
#: Off the truth by some ten times what a log fixes: the valley, not the bottom.
START = np.array([0.23, 4.3e-4, 0.0365, 2e-5, 650.0])
EXPLORATION = 1.5e-4  # m
HUBER = 3.0
_TRANSITIONS = 883
_PROGRAM = "benchmarks/identification_accuracy.py"
_EXAMPLES = """examples:
  python benchmarks/identification_accuracy.py steps
  python benchmarks/identification_accuracy.py recovery --case twin --seeds 10
  python benchmarks/identification_accuracy.py thesis --out out/thesis
"""

#: Caption, heads and rows of a table.
Table = tuple[str, tuple[str, ...], list[list[Cell]]]


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
    requests: tuple[ParameterRequest, ...]
    start: np.ndarray

    def fitted(self, log: Log, transitions: int) -> TwinModel:
        """Returns the model of a log."""
        scenario, parameters = scenario_parameters(self.model, self.requests)
        model = TwinModel([log], scenario, parameters)
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


def measure_recovery(args: argparse.Namespace) -> Table:
    """Returns values, intervals and coverage for logs of several noise seeds."""
    case = CASES[args.case]
    path = args.out / f"recovery_{args.case}.jsonl"
    with Workers(2) as workers:
        found = complete(path, args.seeds, lambda seed: _recovered(case, seed, workers))
    parameters, truth = case.true_values()
    theta, low, high, block = (
        np.array([each[key] for each in found])
        for key in ("theta", "low", "high", "bootstrap")
    )
    inside = (low < truth) & (truth < high)
    by_bootstrap = (block[:, 0] < truth) & (truth < block[:, 1])
    rows: list[list[Cell]] = [
        [
            p.name,
            f"{truth[i]:.5g}",
            f"{theta[:, i].mean():.5g}",
            f"{np.std(theta[:, i], ddof=min(1, len(found) - 1)):.2g}",
            f"{(high - low)[:, i].mean() / 2:.2g}",
            f"{inside[:, i].sum()} / {len(found)}",
            f"{by_bootstrap[:, i].sum()} / {len(found)}",
        ]
        for i, p in enumerate(parameters)
    ]
    total = [f"{100 * x.mean():.0f} %" for x in (inside, by_bootstrap)]
    rows.append(["all", "", "", "", "", *total])
    heads = ("parameter", "truth", "mean", "spread", "95 % half width")
    cover = ("inside, Gauss-Newton", "inside, bootstrap")
    return f"Recovered parameters, {args.case}", (*heads, *cover), rows


def _recovered(case: Case, seed: int, workers: Workers) -> dict[str, object]:
    """Returns the values and both intervals of one noise seed, in the file's units."""
    with tempfile.TemporaryDirectory() as folder:
        log = record(
            Path(folder) / "log", case.truth, case.station, _TRANSITIONS, 1000 * seed
        )
        fitted = case.fitted(log, _TRANSITIONS)
    objective = Objective(fitted, workers, HUBER)
    quarter = Objective(objective.model.thin(4), workers, HUBER)
    near = gauss_newton(quarter, quarter.scaling.to_unit(case.start), 10)
    best = gauss_newton(objective, near.u, 3)
    spread = uncertainty(best, objective.model.measurements.episode)
    theta = objective.scaling.from_unit(best.u)
    print(f"seed {seed}:", " ".join(f"{v:.5g}" for v in theta), flush=True)
    gauss, bootstrap = (
        [objective.scaling.from_unit(best.u + side).tolist() for side in interval.T]
        for interval in (spread.gauss_newton, spread.bootstrap)
    )
    low, high = gauss
    return {"theta": theta.tolist(), "low": low, "high": high, "bootstrap": bootstrap}


def measure_steps(args: argparse.Namespace) -> Table:
    """Returns cost and error of time steps against the finest, noise-free."""
    quiet = load_scenario(
        "removal_turned",
        ["simulation.twin_time_step=0.00125", "ft_sensor.noise=[0, 0, 0, 0, 0, 0]"],
    )
    with tempfile.TemporaryDirectory() as folder:
        log = record(Path(folder) / "log", quiet, "twin", 320, 0)
    rows = [_step(log, h) for h in (0.00125, 0.0025, 0.005, 0.01, 0.02)]
    heads = ("time step [ms]", "cost [ms/transition]")
    errors = ("median", "95 %", "99 %")
    forces = tuple(f"force error, {quantile} [N]" for quantile in errors)
    return "Time steps of the twin", (*heads, "objective", *forces), rows


def _step(log: Log, time_step: float) -> list[Cell]:
    overrides = [f"simulation.twin_time_step={time_step}"]
    scenario, parameters = scenario_parameters(
        load_scenario("removal_turned", overrides),
        [ParameterRequest("contact.friction")],
    )
    objective = Objective(TwinModel([log], scenario, parameters), Workers(), HUBER)
    theta = np.array([parameters[0].nominal])
    objective(1.01 * theta)  # what was simulated once is known
    begin = time.perf_counter()
    residual = objective.residuals(theta)[0]
    cost = 1e3 * (time.perf_counter() - begin) / len(residual)
    noise = objective.model.measurements.noise
    force = np.abs(residual * noise)[:, 6:9].max(axis=1)
    median, most, nearly_all = np.quantile(force, [0.5, 0.95, 0.99])
    figures = (cost, objective.value(residual), median, most, nearly_all)
    return [f"{1e3 * time_step:g}", *(f"{figure:.3g}" for figure in figures)]


THESIS_SETTINGS = {
    "883 transitions, 10 cycles": (883, 10, BeesSettings.thesis()),
    "1776 transitions, 10 cycles": (1776, 10, BeesSettings.thesis()),
    "883 transitions, 20 cycles": (883, 20, BeesSettings.thesis()),
    "883 transitions, 20 cycles of 16": (883, 20, BeesSettings()),
}
THESIS = Case(TRUTH, "cell", IMPACT, IMPACT_BOUNDS, START)


def measure_thesis(args: argparse.Namespace) -> Table:
    """Returns the best objectives in the thesis's settings; draws their courses."""
    work = FinishedWork(args.out / "thesis", what="searches of the thesis's settings")
    jobs = [
        (setting, method, seed)
        for seed in range(args.seeds)
        for setting in reversed(THESIS_SETTINGS)  # the longest first
        for method in ("bees", "nlopt")
    ]
    log = args.out / "thesis_log"
    if not log.exists():
        record(log, THESIS.truth, THESIS.station, 1776, 0)
    with WorkerPool(2) as pool:
        for seed in range(args.seeds):
            left = [j for j in jobs if j[2] == seed and work.get(j) is None]
            found = pool.map(_thesis_run, [(str(log), *job) for job in left])
            work.keep_all(zip(left, found, strict=True))
    searches = {job: work.get(job)["values"] for job in jobs}
    write_figure(args.out / "thesis.png", _thesis_figure(searches), dpi=110)
    rows: list[list[Cell]] = []
    for setting in THESIS_SETTINGS:
        for method in ("bees", "nlopt"):
            best = [min(searches[setting, method, s]) for s in range(args.seeds)]
            figures = (np.median(best), min(best), max(best))
            rows.append([setting, method, *(f"{figure:.4g}" for figure in figures)])
    heads = ("setting", "method", "objective, median", "least", "largest")
    return "Searches in the thesis's settings", heads, rows


def _thesis_run(job: tuple[str, str, str, int]) -> dict[str, list[float]]:
    """Returns the values and the best point of one search, on one core."""
    folder, setting, method, seed = job
    transitions, cycles, colony = THESIS_SETTINGS[setting]
    objective = Objective(THESIS.fitted(read_log(folder), transitions), Workers())
    settings = SearchSettings(
        cycles=cycles, local_evaluations=0, bees=colony, seed=seed
    )
    found: MethodResult = Search(method, [objective], settings).run()
    theta = objective.scaling.from_unit(found.u).tolist()
    return {"values": list(found.stages[0].trace.values), "theta": theta}


def _thesis_figure(searches: dict[tuple[str, str, int], list[float]]) -> Figure:
    """Returns the courses of all searches, a panel for each setting."""
    drawn = Figure(figsize=(13.0, 3.6), layout="constrained")
    axes = drawn.subplots(1, len(THESIS_SETTINGS), sharey=True)
    for ax, setting in zip(axes, THESIS_SETTINGS, strict=True):
        for (own, method, seed), values in searches.items():
            if own == setting:
                colour = {"bees": "#d98c00", "nlopt": "#2060a0"}[method]
                best = np.minimum.accumulate(values)
                label = method if seed == 0 else None
                ax.step(range(1, len(best) + 1), best, color=colour, label=label, lw=1)
        ax.set_title(setting, fontsize=9)
        ax.set_xlabel("evaluations")
        ax.legend(fontsize=8)
    axes[0].set_ylabel("objective, best so far")
    return drawn


def measure_surrogate(args: argparse.Namespace) -> Table:
    """Returns what proposals in place of scouts gain, at equal evaluations."""
    with tempfile.TemporaryDirectory() as folder, Workers(2) as workers:
        log = record(Path(folder) / "log", TRUTH, "twin", _TRANSITIONS, 0)
        model = CASES["twin"].fitted(log, _TRANSITIONS).thin(14)
        objective = Objective(model, workers, HUBER)
        rows: list[list[Cell]] = [
            [seed, *_searched(objective, seed)] for seed in range(args.seeds)
        ]
    heads = ("seed", "objective alone", "objective with a surrogate")
    return "Searches of 128 evaluations", heads, rows


def _searched(objective: Objective, seed: int) -> Iterator[str]:
    """Yields the best value of a search without and with proposals."""
    colony, stop = BeesSettings(4, 2, 2, 0, 0), Stop(evaluations=128)
    for hook in (None, propose):
        bees = BeesAlgorithm(Box.unit(len(BOUNDS)), colony, seed, hook)
        trace = bees.run(lambda u: objective(objective.scaling.from_unit(u)), stop=stop)
        yield f"{trace.best_value:.3g}"


MEASUREMENTS = {
    "steps": measure_steps,
    "recovery": measure_recovery,
    "thesis": measure_thesis,
    "surrogate": measure_surrogate,
}


def main(arguments: Sequence[str]) -> int:
    """Runs one of the measurements and prints its table; returns the exit status."""
    parser = program.argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    parser.add_argument("measurement", choices=MEASUREMENTS, help="see above")
    parser.add_argument(
        "--case", choices=CASES, default="twin",
        help="what recovery fits: a log of the twin, of the cell, or of the twin with "
        "IMPACT (default: twin)",
    )  # fmt: skip
    parser.add_argument(
        "--seeds", type=options.positive, default=5, metavar="N",
        help="logs, or searches of each kind (default: 5)",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, default=Path("out/identification"), metavar="DIR",
        help="keeps what recovery and thesis found, and they go on from there "
        "(default: out/identification)",
    )  # fmt: skip
    add_results_argument(parser)
    args = parser.parse_args(arguments)
    make_folder(args.out)
    title, columns, rows = MEASUREMENTS[args.measurement](args)
    lines = [columns, ["---"] * len(columns), *rows]
    print("\n".join(f"| {' | '.join(map(str, line))} |" for line in lines))
    write_result(args.results, title, columns, rows, _PROGRAM, arguments)
    return 0


if __name__ == "__main__":
    program.run(main)

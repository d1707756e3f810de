"""The best values of our Bees Algorithm and of the published package.

Both get equally many evaluations of five standard functions (Pham and Castellani 2009),
all with the minimum 0.
"""

import math
from collections.abc import Callable, Sequence

import bees_algorithm
import numpy as np
from results import add_results_argument, write_result

from drake_disasm.common import options, program
from drake_disasm.common.arrays import Array
from sysid.optimise import BeesAlgorithm, BeesSettings, Box
from sysid.optimise.bees import Stop

EVALUATIONS = 3000
SETTINGS = BeesSettings(
    10, 5, 10, 1, 15, stagnation_limit=10, shrink=0.8, neighbourhood=1.0
)
_PROGRAM = "benchmarks/bees_comparison.py"
_EXAMPLES = """example:
  python benchmarks/bees_comparison.py --seeds 10
"""
_TITLE = "Best values: median (best to worst)"
_COLUMNS = ("function", "drake_disasm", "bees_algorithm")


def sphere(x: Array) -> Array:
    """Returns the sum of squares of points (n, d)."""
    return np.sum(x**2, axis=1)


def rosenbrock(x: Array) -> Array:
    """Returns Rosenbrock's valley of points (n, d)."""
    return np.sum(
        100.0 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1 - x[:, :-1]) ** 2, axis=1
    )


def ackley(x: Array) -> Array:
    """Returns Ackley's function of points (n, d)."""
    n = x.shape[1]
    root = np.sqrt(np.sum(x**2, axis=1) / n)
    waves = np.sum(np.cos(2 * np.pi * x), axis=1) / n
    return 20 + math.e - 20 * np.exp(-0.2 * root) - np.exp(waves)


def rastrigin(x: Array) -> Array:
    """Returns Rastrigin's function of points (n, d)."""
    return np.sum(x**2 - 10 * np.cos(2 * np.pi * x) + 10, axis=1)


def griewank(x: Array) -> Array:
    """Returns Griewank's function of points (n, d)."""
    i = np.sqrt(np.arange(1, x.shape[1] + 1))
    return 1 + np.sum(x**2, axis=1) / 4000 - np.prod(np.cos(x / i), axis=1)


#: Function, half width of the box, dimensions; all have the minimum 0.
STANDARD: dict[str, tuple[Callable[[Array], Array], float, int]] = {
    "sphere": (sphere, 100.0, 6),
    "rosenbrock": (rosenbrock, 2.0, 4),
    "ackley": (ackley, 32.0, 4),
    "rastrigin": (rastrigin, 5.12, 3),
    "griewank": (griewank, 100.0, 3),
}


def ours(name: str, seed: int) -> float:
    """Returns the best value that our search finds."""
    function, half, size = STANDARD[name]
    box = Box.of([-half] * size, [half] * size)
    bees = BeesAlgorithm(box, SETTINGS, seed)
    return bees.run(function, stop=Stop(evaluations=EVALUATIONS)).best_value


def theirs(name: str, seed: int) -> float:
    """Returns the best value that the package finds with the same colony."""
    function, half, size = STANDARD[name]
    parameters = bees_algorithm.BeesParameters(
        n_scouts=SETTINGS.scouts,
        n_sites=SETTINGS.sites,
        n_elite_sites=SETTINGS.elite_sites,
        n_foragers_site=SETTINGS.recruits,
        n_foragers_elite=SETTINGS.elite_recruits,
        stagnation_limit=SETTINGS.stagnation_limit,
        shrink_factor=1.0 - SETTINGS.shrink,
    )
    cycles = (EVALUATIONS - SETTINGS.initial) // SETTINGS.per_cycle
    search = bees_algorithm.BeesAlgorithm(
        function,
        ([-half] * size, [half] * size),
        parameters,
        direction="minimize",
        vectorized=True,
        seed=seed,
    )
    return search.optimize(max_iterations=cycles).score


def main(arguments: Sequence[str]) -> int:
    """Runs both on each function and prints the table; returns the exit status."""
    parser = program.argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    parser.add_argument(
        "--seeds", type=options.positive, default=10, metavar="N",
        help="searches of each (default: 10)",
    )  # fmt: skip
    add_results_argument(parser)
    args = parser.parse_args(arguments)
    rows = []
    for name in STANDARD:
        found = [[f(name, seed) for seed in range(args.seeds)] for f in (ours, theirs)]
        cells = [f"{np.median(f):.3g} ({min(f):.2g} to {max(f):.2g})" for f in found]
        rows.append([name, *cells])
        print(f"| {' | '.join(rows[-1])} |", flush=True)
    write_result(args.results, _TITLE, _COLUMNS, rows, _PROGRAM, arguments)
    return 0


if __name__ == "__main__":
    program.run(main)

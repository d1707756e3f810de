"""How well the twin predicts the cell's transitions, with nothing hidden and no fit.

    python benchmarks/twin_against_cell.py --scenario removal --steps 800

The cell is recorded under `admittance` with exploration. Each of its steps is then
predicted by the twin that follows from the same scenario, from the measured state, and
from how far the twin has the grip give at the end of the step before. The residuals
are in units of the sensor's noise, and of what the twin states of itself: the noise and
the error that it is known to make of forces.
"""

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from results import Cell, add_results_argument, markdown, write_result

from drake_disasm.common.program import ProgressBar, argument_parser, run
from drake_disasm.logs import read_log
from drake_disasm.mdp import STATE_NAMES
from drake_disasm.policies import Exploring, make_policy
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.task.recording import record_transitions
from drake_disasm.task.simulation import TaskSimulation
from sysid.models.measurements import Measurements
from sysid.models.twin import TwinModel
from sysid.parameters import nominal_values

_NAME = "benchmarks/twin_against_cell.py"
_EXPLORATION = 1.5e-4  # m


def main(arguments: Sequence[str]) -> int:
    """Records, predicts and prints the table."""
    options = parse(arguments)
    scenarios = {name: load_scenario(name, options.set) for name in options.scenario}
    columns = ("scenario", "quantile", "unit", *STATE_NAMES)
    rows: list[tuple[Cell, ...]] = []
    for name, scenario in scenarios.items():
        folder = options.log / name if options.log else None
        error, measured = errors(scenario, options.steps, folder, options.station)
        for unit, size in (("noise", measured.noise), ("stated", measured.sigma)):
            for label, row in _rows(error / size):
                numbers = (round(float(value), 2) for value in row)
                rows.append((name, label, unit, *numbers))
    print(markdown(columns, rows))
    title = f"Residuals of the twin's predictions of the {options.station}"
    write_result(options.results, title, columns, rows, _NAME, arguments)
    return 0


def errors(
    scenario: Scenario, steps: int, folder: Path | None = None, station: str = "cell"
) -> tuple[np.ndarray, Measurements]:
    """Returns the twin's errors (n, 12), wrench at the sensor, and what was measured.

    Args:
        scenario: of cell and twin.
        steps: to record, at least.
        folder: keeps the log, or has it already; None: a temporary one.
        station: that is recorded.
    """
    with tempfile.TemporaryDirectory() as temporary:
        log = folder or Path(temporary) / "log"
        if not log.exists():
            policy = Exploring(make_policy("admittance", scenario), _EXPLORATION, 0)
            simulation = TaskSimulation(scenario, station, policy)
            with ProgressBar("step") as progress:
                record_transitions(log, simulation, steps, progress=progress)
        model = TwinModel([read_log(log)], scenario, ()).with_begins(nominal_values(()))
    measured = model.measurements
    predicted = model.predict(nominal_values(()), slice(0, measured.rows))
    return predicted - measured.values, measured


def _rows(residual: np.ndarray) -> list[tuple[str, np.ndarray]]:
    size = np.abs(residual)
    return [
        ("rms", np.sqrt(np.mean(residual**2, axis=0))),
        ("median / 0.67", np.median(size, axis=0) / 0.6745),
        ("95 % / 1.96", np.quantile(size, 0.95, axis=0) / 1.96),
    ]


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = argument_parser(f"python {_NAME}", __doc__, "")
    add_results_argument(parser)
    parser.add_argument("--scenario", nargs="+", default=["removal"], metavar="NAME")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="of each"
    )
    parser.add_argument("--steps", type=int, default=800, help="to record, at least")
    parser.add_argument(
        "--station", default="cell", choices=("cell", "twin"), help="that is recorded"
    )
    parser.add_argument(
        "--log",
        type=Path,
        help="folder that keeps the logs, by the names of the scenarios; a log that is "
        "there already is not recorded again",
    )
    return parser.parse_args(arguments)


if __name__ == "__main__":
    run(main)

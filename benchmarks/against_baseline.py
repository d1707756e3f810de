"""How a policy compares with the scripted one, in the same episodes of the cell.

    python benchmarks/against_baseline.py --policy removal_randomised --episodes 400

Every episode draws the scenario's ranges anew, from a seed that both policies get. A
line is written for each as it ends; the same command goes on from there. Prints
success, mean and peak force and steps by the groove's angle, and the mean difference
with its 95 % interval (paired, normal).
"""

import argparse
import dataclasses
import itertools
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from results import Cell, add_results_argument, markdown, write_result

from drake_disasm.common import options
from drake_disasm.common.program import ProgressBar, argument_parser, run
from drake_disasm.common.progress import ProgressUpdate
from drake_disasm.learning.statistics import wilson_interval
from drake_disasm.mdp import Outcome
from drake_disasm.policies import resolve_policy
from drake_disasm.scenario import draw, load_scenario
from drake_disasm.task.episode import run_episode
from drake_disasm.task.simulation import TaskSimulation

_NAME = "benchmarks/against_baseline.py"
COLUMNS = (
    *("angle", "policy", "success (95 % interval)", "bolt out"),
    *("mean force [N]", "mean peak force [N]", "greatest force [N]", "steps"),
)
_BASELINE, _ANGLE = "admittance", "effects.0.ry"
_EDGES = np.array([0.0, 2.0, 4.0, 6.0])  # degrees either way
_FIGURES = ("mean_force", "max_force", "steps")
_FIRST_SEED = 500_000  # of no training or validation

Row = dict[str, Any]


def main(arguments: Sequence[str]) -> int:
    """Runs what is missing of the episodes, and prints the table."""
    args = parse(arguments)
    args.out.mkdir(parents=True, exist_ok=True)
    found = {}
    for name in (args.policy, _BASELINE):
        of = f"{Path(name).stem}_{Path(args.scenario).stem}_{args.station}"
        path = args.out / f"{of}.jsonl"
        found[name] = _episodes(path, name, args)
    own, baseline = found[args.policy], found[_BASELINE]
    rows, note = table_rows(own, baseline), "; ".join(differences(own, baseline))
    print(f"{markdown(COLUMNS, rows)}\n{note}")
    title = f"{args.policy} and {_BASELINE} in the same episodes of the {args.station}"
    note = f"Mean difference with its 95 % interval: {note}."
    write_result(args.results, title, COLUMNS, rows, _NAME, arguments, note)
    return 0


def table_rows(own: Sequence[Row], baseline: Sequence[Row]) -> list[tuple[Cell, ...]]:
    """Returns the rows of the table, as COLUMNS says: by angle, and all.

    Args:
        own, baseline: of the same episodes.
    """
    degrees = np.abs(np.rad2deg([row["angle"] for row in own]))
    rows: list[tuple[Cell, ...]] = []
    bins = [
        (f"{low:g} to {high:g} deg", (degrees >= low) & (degrees < high))
        for low, high in itertools.pairwise(_EDGES)
    ]
    for label, which in [*bins, ("all", np.ones(len(own), bool))]:
        for name, episodes in (("policy", own), (_BASELINE, baseline)):
            part = [row for row, taken in zip(episodes, which, strict=True) if taken]
            if part:
                rows.append((label, name, *_figures(part)))
    return rows


def _figures(rows: Sequence[Row]) -> tuple[Cell, ...]:
    won = sum(row["success"] for row in rows)
    low, high = wilson_interval(won, len(rows))
    out = sum(row["bolt_is_out"] for row in rows)
    force, peak, steps = (np.array([row[f] for row in rows]) for f in _FIGURES)
    success = f"{won} / {len(rows)} ({100 * low:.1f} to {100 * high:.1f} %)"
    forces = (force.mean(), peak.mean(), peak.max())
    mean, peaks, most = (round(float(value), 2) for value in forces)
    return success, out, mean, peaks, most, round(float(steps.mean()), 1)


def differences(own: Sequence[Row], baseline: Sequence[Row]) -> list[str]:
    """Returns the mean difference of each figure with its interval, in words."""
    lines = []
    for figure in _FIGURES:
        pairs = zip(own, baseline, strict=True)
        less = np.array([one[figure] - other[figure] for one, other in pairs])
        half = 1.96 * less.std(ddof=1) / np.sqrt(len(less))
        usual = np.mean([row[figure] for row in baseline])
        lines.append(
            f"{figure}: {less.mean():+.3g} ({less.mean() - half:+.3g} to "
            f"{less.mean() + half:+.3g}), {100 * less.mean() / usual:+.0f} %"
        )
    return lines


def _episodes(path: Path, name: str, args: argparse.Namespace) -> list[Row]:
    """Returns the rows of a policy's episodes; runs those that a file lacks."""
    scenario = load_scenario(args.scenario, args.set)
    lines = path.read_text().splitlines() if path.exists() else []
    rows = [json.loads(line) for line in lines[: args.episodes]]
    if len(rows) == args.episodes:
        return rows
    policy = resolve_policy(name, scenario)
    simulation = TaskSimulation(scenario, args.station, policy)
    with ProgressBar("episode") as bar, path.open("a") as stream:
        while len(rows) < args.episodes:
            seed = args.seed + len(rows)
            summary = dataclasses.asdict(run_episode(simulation, seed))
            summary["success"] = summary.pop("outcome") is Outcome.SUCCESS
            drawn = draw(scenario, seed)
            rows.append(summary | {"drawn": drawn, "angle": drawn.get(_ANGLE, 0.0)})
            print(json.dumps(rows[-1]), file=stream, flush=True)
            bar(ProgressUpdate(name, len(rows), args.episodes))
    return rows


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = argument_parser(f"python {_NAME}", __doc__, "")
    add_results_argument(parser)
    parser.add_argument("--policy", default="removal_randomised", metavar="NAME")
    parser.add_argument("--scenario", default="removal_randomised", metavar="NAME")
    parser.add_argument("--set", nargs="+", default=[], metavar="KEY=VALUE")
    parser.add_argument("--station", default="cell", choices=("cell", "twin"))
    parser.add_argument("--episodes", type=options.positive, default=400, metavar="N")
    parser.add_argument("--seed", type=options.seed, default=_FIRST_SEED, metavar="S")
    parser.add_argument("--out", type=Path, default=Path("out/against_baseline"))
    return parser.parse_args(arguments)


if __name__ == "__main__":
    run(main)

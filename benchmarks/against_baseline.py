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

from drake_disasm.common import options
from drake_disasm.common.program import ProgressBar, run
from drake_disasm.common.progress import ProgressUpdate
from drake_disasm.learning.statistics import wilson_interval
from drake_disasm.mdp import Outcome
from drake_disasm.policies import resolve_policy
from drake_disasm.scenario import draw, load_scenario
from drake_disasm.task.episode import run_episode
from drake_disasm.task.simulation import TaskSimulation

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
    print("\n".join(table(found[args.policy], found[_BASELINE])))
    return 0


def table(own: Sequence[Row], baseline: Sequence[Row]) -> list[str]:
    """Returns the lines of the table: by angle, and all.

    Args:
        own, baseline: of the same episodes.
    """
    degrees = np.abs(np.rad2deg([row["angle"] for row in own]))
    lines = ["angle | policy | success | truly out | mean force | peak force | steps"]
    bins = [
        (f"{low:g} to {high:g} deg", (degrees >= low) & (degrees < high))
        for low, high in itertools.pairwise(_EDGES)
    ]
    for label, which in [*bins, ("all", np.ones(len(own), bool))]:
        for name, rows in (("policy", own), (_BASELINE, baseline)):
            part = [row for row, taken in zip(rows, which, strict=True) if taken]
            if part:
                lines.append(f"{label} | {name} | {_figures(part)}")
    return [*lines, *_differences(own, baseline)]


def _figures(rows: Sequence[Row]) -> str:
    won = sum(row["success"] for row in rows)
    low, high = wilson_interval(won, len(rows))
    out = sum(row["bolt_is_out"] for row in rows)
    force, peak, steps = (np.array([row[f] for row in rows]) for f in _FIGURES)
    return (
        f"{won}/{len(rows)} ({100 * low:.1f} to {100 * high:.1f} %) | {out} | "
        f"{force.mean():.3f} N | {peak.mean():.2f}, at most {peak.max():.1f} N | "
        f"{steps.mean():.1f}"
    )


def _differences(own: Sequence[Row], baseline: Sequence[Row]) -> list[str]:
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
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
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

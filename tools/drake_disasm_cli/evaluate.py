"""Evaluates policies: N episodes each, without exploration, for each setting.

Prints one line per policy and setting: P (mean episodic reward), instability (its
standard deviation), success with Wilson's 95 % interval, and the forces on the bolt.
The same seeds give the same episodes.
"""

import argparse
import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path

from drake_disasm.common import options, program
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.executors import WorkerPool
from drake_disasm.common.files import make_folder, write_json
from drake_disasm.common.progress import Progress
from drake_disasm.learning.evaluation import Evaluation, evaluate, summed_up
from drake_disasm.policies import resolve_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm_cli import common

_EXAMPLES = """examples:
  drake-disasm evaluate --policy admittance straight --station cell --episodes 10
  drake-disasm evaluate --policy out/first/seed_000/policy.npz my_policy.py:Mine \\
      --station twin --sweep imprecision=0,0.0001,0.0003,0.0005
  drake-disasm evaluate --policy removal_randomised admittance \\
      --scenario removal_turned --sweep effects.0.ry=-0.0698,-0.0349,0,0.0349,0.0698
  drake-disasm evaluate --policy admittance --set 'effects=[!SensorBias {fx: 2}]'
"""


@dataclasses.dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes:
        policy: its name, as on the command line.
        setting: what the sweep sets, as key=value; or nothing.
        scenario: name or file.
        overrides: all of them.
        station: "cell" or "twin".
        seeds: of the episodes.
    """

    policy: str
    setting: str
    scenario: str
    overrides: tuple[str, ...]
    station: str
    seeds: range


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm evaluate", __doc__, _EXAMPLES)
    common.add_scenario_arguments(parser)
    add = parser.add_argument
    common.add_policies_argument(add)
    common.add_station_argument(add, "cell", "what the policies act on")
    add(
        "--psi",
        type=options.nonnegative,
        metavar="M",
        help="imprecision of the robot [m], e.g. 0.0003 (default: the scenario's)",
    )
    add(
        "--sweep",
        metavar="KEY=V1,V2,...",
        help="one line for each value of a field of the scenario",
    )
    add(
        "--episodes",
        type=options.positive,
        default=10,
        metavar="N",
        help="(default: 10)",
    )
    add(
        "--seed",
        type=options.seed,
        default=0,
        help="of the first episode; the next ones count on (default: 0)",
    )
    common.add_workers_argument(parser)
    add("--json", type=Path, metavar="FILE", help="also write the figures")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    rows = list(_rows(args))
    for row in rows:  # errors are reported before anything runs
        resolve_policy(row.policy, load_scenario(row.scenario, row.overrides))
    found: dict[Row, Evaluation] = {}
    try:
        with (
            program.ProgressBar(unit="episode") as bar,
            WorkerPool(args.workers, process_per_job=True, progress=bar) as pool,
        ):
            found.update(pool.run(_run, rows))
    finally:
        ordered = {row: found[row] for row in rows if row in found}
        if ordered:
            print(table(ordered))
    if args.json:
        _write_json(
            args.json,
            ordered,
            program.provenance("drake-disasm evaluate", arguments, args.seed),
        )
    return 0


def _rows(args: argparse.Namespace) -> Iterator[Row]:
    overrides = list(args.overrides)
    if args.psi is not None:
        overrides.append(f"imprecision={args.psi}")
    for setting in _settings(args.sweep):
        for policy in args.policy:
            yield Row(
                policy,
                setting,
                args.scenario,
                (*overrides, *([setting] if setting else [])),
                args.station,
                range(args.seed, args.seed + args.episodes),
            )


def _settings(sweep: str | None) -> list[str]:
    if not sweep:
        return [""]
    key, separator, values = sweep.partition("=")
    if not separator or not values:
        raise DisasmError(f"--sweep {sweep}: write it as key=value,value,...")
    return [f"{key}={value}" for value in values.split(",")]


def _run(row: Row, progress: Progress) -> Evaluation:
    """Returns one row's figures; runs in a worker process."""
    scenario = load_scenario(row.scenario, row.overrides)
    policy = resolve_policy(row.policy, scenario)
    simulation = TaskSimulation(scenario, row.station, policy)
    return summed_up(evaluate(simulation, row.seeds, progress=progress))


def table(found: dict[Row, Evaluation]) -> str:
    """Returns the figures as a table for a terminal."""
    width = max(12, *(len(_name(row)) for row in found))
    lines = [
        f"{'policy':{width}}      P  instab.  success         (95 %)   out  steps  "
        "mean F  mean peak  peak F  mean T  peak T"
    ]
    for row, e in found.items():
        low, high = 100 * e.success_low, 100 * e.success_high
        lines.append(
            f"{_name(row):{width}} {e.performance:6.1f} {e.instability:8.2f}  "
            f"{e.successes:3d}/{e.episodes:<3d}  ({low:3.0f} to {high:3.0f} %)  "
            f"{e.truly_out:4d} {e.steps:6.1f} {e.mean_force:5.2f} N "
            f"{e.mean_peak_force:8.2f} N {e.peak_force:5.2f} N {e.mean_torque:7.3f} "
            f"{e.peak_torque:7.3f}"
        )
    return "\n".join(lines)


def _name(row: Row) -> str:
    return f"{row.policy}  {row.setting}".strip()


def _write_json(path: Path, found: dict[Row, Evaluation], origin: dict) -> None:
    rows = [
        {
            "policy": row.policy,
            "scenario": row.scenario,
            "setting": row.setting,
            "station": row.station,
        }
        | dataclasses.asdict(figures)
        for row, figures in found.items()
    ]
    make_folder(path.parent)
    write_json(path, {"provenance": origin, "rows": rows})

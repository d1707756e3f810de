"""Finds which physical effect a model lacks to explain a measured log, and adds it.

The log says what is modelled: readings of a force/torque sensor at rest, or joint
torques of an arm. The model is fitted; what is left is tested against every effect of
the library on data that were not fitted; those that pass are added one by one. Prints
what was missing, its parameters, and the error before and after. Writes the scenario
with the effects in it, `result.json`, and a report that opens offline.
"""

import argparse
import json
import os
from collections.abc import Sequence
from pathlib import Path

import cli
import numpy as np

from drake_disasm.errors import DisasmError
from drake_disasm.scenario import dump_scenario, load_scenario
from drake_disasm.writing import write_atomically
from sysid.identification.split import split_episodes
from sysid.logs import read_logs
from sysid.models import ScenarioModel
from sysid.models.from_logs import ModelChoice, model_of
from sysid.report import closing_page
from sysid.tracing.pipeline import Closed, close_loop
from sysid.tracing.plain import to_mapping
from sysid.workers import Workers

_KINDS = ("static_wrench", "joint_motion")
_EXAMPLES = """examples:
  python tools/close_loop.py --log readings --out out/sensor     a static_wrench log
  python tools/close_loop.py --log run_1 run_2 --held-out run_2 --out out/arm
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = argparse.ArgumentParser(
        prog="close_loop.py",
        description=__doc__,
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("--log", nargs="+", required=True, metavar="DIR", help="logs of one kind")
    add(
        "--scenario",
        metavar="NAME|FILE",
        help="what the model begins with (default: what the log states)",
    )
    add("--urdf", metavar="FILE", help="the arm of a joint_motion log")
    add(
        "--held-out",
        nargs="+",
        default=[],
        metavar="NAME",
        help="logs or episodes that are not fitted but judged (default: contiguous "
        "blocks in turn)",
    )
    add(
        "--workers",
        type=cli.positive,
        default=os.cpu_count() or 1,
        metavar="N",
        help="processes (default: one per core)",
    )
    add("--out", required=True, type=Path, metavar="DIR", help="a folder")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    logs = read_logs(args.log)
    if logs[0].header.kind not in _KINDS:
        raise DisasmError(
            f"{logs[0].folder}: a log of kind '{logs[0].header.kind}'; effects are "
            f"traced in logs of {' and '.join(_KINDS)} only, so far; fit it by "
            "tools/identify.py"
        )
    scenario = load_scenario(args.scenario) if args.scenario else None
    model = model_of(logs, ModelChoice(scenario=scenario, urdf=args.urdf))
    assert isinstance(model, ScenarioModel)
    names = model.measurements.names
    train, test = split_episodes(names, args.held_out or 0.0)
    origin = cli.provenance("close_loop", arguments, 0)
    with Workers(args.workers) as workers:
        closed = close_loop(model, train, test, np.inf, workers, _tell)
    _write(args.out, closed, origin)
    print(closed.verdict.text)
    print(f"report: {args.out / 'report.html'}")
    return 0


def _tell(line: str) -> None:
    cli.stop_if_interrupted()
    print(line, flush=True)


def _write(folder: Path, closed: Closed, origin: dict[str, object]) -> None:
    scenario = closed.last.model.scenario_at(closed.last.theta)
    result = to_mapping(closed) | {"provenance": origin}
    files = {
        "scenario.yaml": dump_scenario(scenario),
        "result.json": json.dumps(result, indent=2) + "\n",
        "report.html": closing_page(closed, origin),
    }
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        data = text.encode()
        write_atomically(folder / name, lambda stream, data=data: stream.write(data))


if __name__ == "__main__":
    cli.run(main)

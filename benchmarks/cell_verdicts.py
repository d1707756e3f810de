"""What closing the loop says of logs of the cell: no effect hidden, or one in each.

Records each log (of a scenario, `removal` unless another is given, `admittance` with
0.15 mm of exploration, 440 transitions) and judges it by the twin of the same
scenario, whose contact may be IMPACT. Run `null` first: effects are four to
ten times as large as the first null log would show with 80 % probability. `strong`
ones are a drag of 600 N s/m and a patch of friction of 1.0, in turn, in logs of the
twin itself with IMPACT contact (200 transitions): where its stated error ends.
"""

import copy
import math
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from answers import (
    Answer,
    Count,
    add_arguments,
    complete,
    no_verdict,
    of_verdict,
    read_answers,
    report,
    said,
)

from drake_disasm.common import options, program
from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import Effect, GrooveViscousFriction, RustyPatch
from drake_disasm.logs import Log, read_log
from drake_disasm.policies import Exploring, make_policy
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.task.recording import record_transitions
from drake_disasm.task.simulation import TaskSimulation
from sysid.effect_selection.close_loop import close_loop
from sysid.models.from_logs import ModelChoice, model_of
from sysid.validation.blind_tests import observable_effects

_STEPS = {"null": 440, "effect": 440, "strong": 200}  # recorded at least
_EPISODES = 20  # seeds from one log to the next
_SEEDS = {"null": 3000, "effect": 7000, "strong": 57000}
_EXPLORATION = 1.5e-4  # m
_TIMES = (4.0, 10.0)  # the limit of detection
_MOST = 0.5  # of the way to an amplitude's bound; beyond it the cell may not start
_FAR = _MOST / _TIMES[1]
_DRAG, _PATCH = 600.0, 1.0  # N s/m, 1: strong ones
_PLACES, _WIDTHS = (0.01, 0.05), (0.004, 0.03)  # m, of strong patches
_PROGRAM = "benchmarks/cell_verdicts.py"
_EXAMPLES = """examples:
  python benchmarks/cell_verdicts.py null --logs 50
  python benchmarks/cell_verdicts.py effect --logs 50 --time-budget 30
  python benchmarks/cell_verdicts.py strong --logs 20 --time-budget 30
  python benchmarks/cell_verdicts.py null --scenario iiwa_bayonet --contact impact \\
      --out out/bayonet_verdicts
"""


def record(folder: Path, scenario: Scenario, kind: str, seed: int) -> Log:
    """Returns a log with what is hidden; one that is there already is read."""
    if not (folder / "done").exists():
        shutil.rmtree(folder, ignore_errors=True)  # of a run that was stopped
        policy = Exploring(make_policy("admittance", scenario), _EXPLORATION, seed)
        station = "twin" if kind == "strong" else "cell"
        simulation = TaskSimulation(scenario, station, policy)
        record_transitions(folder, simulation, _STEPS[kind], seed)
        (folder / "done").touch()
    return read_log(folder)


def strong(number: int) -> Effect:
    """Returns the effect of a strong case: a drag or a patch somewhere, in turn."""
    if number % 2 == 0:
        return GrooveViscousFriction(_DRAG)
    random = np.random.default_rng([_SEEDS["strong"], number])
    width = math.exp(random.uniform(*np.log(_WIDTHS)))
    return RustyPatch(_PATCH, random.uniform(*_PLACES), width)


def draw(number: int, limits: list[list[Any]], scenario: Scenario) -> Effect:
    """Returns the effect of a case: another kind for each, as far as there are."""
    random = np.random.default_rng(_SEEDS["effect"])
    known = {str(row[0]) for row in limits if row[2] and row[3] < _FAR}
    kinds = [kind for kind in observable_effects(scenario) if kind.__name__ in known]
    order = np.concatenate(
        [random.permutation(len(kinds)) for _ in range(1 + number // len(kinds))]
    )
    kind, random = kinds[order[number]], np.random.default_rng([7000, number])
    own = [row for row in limits if row[0] == kind.__name__ and row[2]]
    own = [row for row in own if row[3] < _FAR]
    _, field, size, _, shape = own[int(random.integers(len(own)))]
    pairs = (part.split("=") for part in str(shape).split(", ") if part)
    shapes = {name: float(value) for name, value in pairs}
    return kind(**{str(field): float(size) * random.uniform(*_TIMES)}, **shapes)


def answer(log: Log, scenario: Scenario, time_budget: float = math.inf) -> Answer:
    """Returns what closing the loop says of a log, within a time [s]."""
    model = model_of([log], ModelChoice(scenario=scenario, fixed=True))
    try:
        closed = close_loop(model, time_budget=time_budget)
    except DisasmError as error:
        return no_verdict("refused", str(error))
    found = closed.verdict
    residual = closed.last.linearisation.residual
    return of_verdict(found) | {
        "provisional": closed.is_provisional,
        "text": closed.text,
        "rms": np.sqrt(np.mean(residual**2, axis=0)).round(2).tolist(),
        "limits": [
            [x.effect, x.field, x.amplitude, x.share, x.shape] for x in found.limits
        ],
    }


def _case(
    kind: str, number: int, out: Path, scenario: Scenario, time_budget: float
) -> Answer:
    """Returns the answer to a case, within a time [s], with what was put in."""
    real, hidden, name = copy.deepcopy(scenario), "", ""
    is_strong = kind == "strong"
    if not is_strong:
        real.contact.model = "hydroelastic"  # the only one that the cell has
    if kind != "null":
        limits = [] if is_strong else _limits(out / "null.jsonl")
        effect = strong(number) if is_strong else draw(number, limits, scenario)
        real.effects, hidden, name = [effect], repr(effect), type(effect).__name__
    seed = _SEEDS[kind] + _EPISODES * number
    try:
        log = record(out / f"{kind}_{number}", real, kind, seed)
    except RuntimeError as error:
        return no_verdict("not recorded", str(error))
    return {"hidden": hidden, "kind": name} | answer(log, scenario, time_budget)


def _limits(path: Path) -> list[list[Any]]:
    """Returns the limits of detection of the first null log that was judged."""
    for each in read_answers(path):
        if limits := each.get("limits"):
            return list(limits)
    raise DisasmError(f"{path}: no null log was judged; run `null --logs 1` first")


def _counts(kind: str, answers: list[Answer]) -> list[Count]:
    """Returns alarms of null logs, or effects named."""
    if kind == "null":
        what = "an effect is confirmed or ambiguous (false alarm)"
        alarms = sum(bool(a["names"]) for a in answers)
        return [Count(kind, what, alarms, answers)]
    first = [a["names"][:1] == [a["kind"]] for a in answers]
    named = [a["kind"] in said(a) for a in answers]
    explained = [a["ending"] == "explained" for a in answers]
    rows = (
        ("the effect is first", first),
        ("the effect is confirmed, or in an ambiguous set", named),
        ("the same, and explained", map(all, zip(named, explained, strict=True))),
    )
    return [Count(kind, what, sum(right), answers) for what, right in rows]


def main(arguments: Sequence[str]) -> int:
    """Judges logs of the cell and prints the table; returns the exit status."""
    parser = program.argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    parser.add_argument("kind", choices=sorted(_SEEDS), help="what is hidden")
    parser.add_argument(
        "--time-budget",
        type=options.above_zero_or_inf,
        default=math.inf,
        metavar="MIN",
        help="of each log; its answer may be provisional, and stays (default: none)",
    )
    parser.add_argument(
        "--scenario", default="removal", metavar="NAME|FILE", help="default: removal"
    )
    parser.add_argument(
        "--contact",
        choices=("hydroelastic", "impact"),
        help="of the twin that judges (default: the scenario's; strong: impact)",
    )
    add_arguments(parser, 50, "cell_verdicts")
    args = parser.parse_args(arguments)
    scenario, path = load_scenario(args.scenario), args.out / f"{args.kind}.jsonl"
    contact = args.contact or ("impact" if args.kind == "strong" else None)
    scenario.contact.model = contact or scenario.contact.model
    seconds = 60.0 * args.time_budget
    answers = complete(
        path,
        args.logs,
        lambda number: _case(args.kind, number, args.out, scenario, seconds),
    )
    counts = _counts(args.kind, answers)
    report(counts, "Verdicts on logs of the cell", _PROGRAM, arguments, args.results)
    return 0


if __name__ == "__main__":
    program.run(main)

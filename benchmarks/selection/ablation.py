"""What each setting of a selector is worth: halved, doubled, or switched.

Runs a selector over some cases with its default settings, and again with one setting
changed: numbers are halved and doubled, switches are switched, all of a tuple is
scaled. The table says how many answers changed, and what that did to the scores (see
`judge.py --help`), as changes in numbers of effects and of logs. A setting that changes
no answer does nothing on these cases; where it is not even read it is not tried.

The selector's module has, in addition to `select`, the functions `defaults()`, which
returns the settings by name, `asked(case, changes)` and `settings_read(case)`, the
names of those that it reads: `frozen` and `current` do.
"""

import argparse
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from results import Cell, add_results_argument, markdown, write_result

from drake_disasm.common import options
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.finished_work import FinishedWork
from drake_disasm.common.program import ProgressBar, argument_parser, run
from drake_disasm.common.progress import ProgressUpdate
from selection.answer import Answer, Case
from selection.cases import case_of, chosen
from selection.judge import add_folder_arguments, asked
from selection.scores import Judged

_PROGRAM = "benchmarks/selection/ablation.py"
_EXAMPLES = """examples:
  python benchmarks/selection/ablation.py --selector current --limit 20
  python benchmarks/selection/ablation.py --selector frozen --settings alpha min_gain
"""
_CASES = ("joint/*/[23]_*", "joint/one/*", "static100/*", "real/rack*", "real/ft*")
_COLUMNS = (
    *("setting", "value", "default", "answers changed", "named", "in set"),
    *("logs with wrong names", "false none", "alarms", "error after", "time"),
    "read in",
)
_TITLE = "What each setting is worth"

#: Name of a setting and its value; nothing for the defaults.
Change = tuple[str, Any] | tuple[()]


def variants(name: str, value: Any) -> list[tuple[str, Any]]:
    """Returns a setting with other values.

    Args:
        name: of the setting.
        value: its default: a switch, a number, or a tuple of numbers.
    """
    if isinstance(value, bool):
        return [(name, not value)]
    found = [scaled(value, factor) for factor in (0.5, 2.0)]
    return [(name, other) for other in found if other != value and other is not None]


def scaled(value: Any, factor: float) -> Any:
    """Returns a number, or each of a list of numbers, times a factor.

    Whole numbers stay whole and at least 1; None of what is no number.
    """
    if isinstance(value, list | tuple):
        return [scaled(item, factor) for item in value]
    if isinstance(value, int):
        return max(1, round(value * factor)) if value else value
    return value * factor if isinstance(value, float) else None


def main(arguments: Sequence[str]) -> int:
    """Runs the selector with each setting changed, and prints the table."""
    args = parse(arguments)
    selector = _selector(args.selector)
    logs = (args.logs or args.out / "cases").resolve()
    cases = [case_of(name, logs) for name in chosen(args.cases)[: args.limit]]
    settings = selector.defaults()
    _refuse_unknown(args.settings, settings)
    changes: list[Change] = [()]
    for name in args.settings or settings:
        changes += variants(name, settings[name])
    kept = FinishedWork(args.out / "ablation" / args.selector)
    read = {case.name: _read(kept, selector, case) for case in cases}
    baseline: list[Judged] = []
    rows: list[list[Cell]] = []
    print(markdown(_COLUMNS, rows), flush=True)
    with ProgressBar(unit="variant") as progress:
        for number, change in enumerate(changes, start=1):
            # Where a setting is not read, the answer is that with the defaults.
            used = [change if _matters(change, read[c.name]) else () for c in cases]
            found = [
                Judged(c, _answer(kept, selector, c, own))
                for c, own in zip(cases, used, strict=True)
            ]
            baseline = baseline or found
            default = settings[change[0]] if change else "-"
            rows.append([*row(change, default, baseline, found), sum(map(bool, used))])
            print(f"| {' | '.join(map(str, rows[-1]))} |", flush=True)
            progress(ProgressUpdate("ablation", number, len(changes)))
    write_result(args.results, _TITLE, _COLUMNS, rows, _PROGRAM, arguments)
    return 0


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    add = parser.add_argument
    add("--selector", default="current", help="its module (default: current)")
    add(
        "--cases", nargs="+", default=list(_CASES), metavar="PATTERN",
        help="names of cases, as in judge.py (default: small ones of all kinds)",
    )  # fmt: skip
    add(
        "--limit", type=options.positive, default=20, metavar="N",
        help="only the first N of them (default: 20)",
    )  # fmt: skip
    add("--settings", nargs="+", metavar="NAME", help="only these (default: all)")
    add_folder_arguments(add)
    add_results_argument(parser)
    return parser.parse_args(arguments)


def row(
    change: Change, default: Any, baseline: Sequence[Judged], found: Sequence[Judged]
) -> list[Cell]:
    """Returns a row of _COLUMNS: of the defaults numbers, of a change differences."""
    one, two = _counts(baseline), _counts(found)
    took = [sum(j.answer.seconds for j in own) for own in (baseline, found)]
    error = _errors(found) / max(_errors(baseline), 1e-300)
    if not change:
        shown = [str(count) for count in two]
        return ["defaults", "-", "-", 0, *shown, "1", f"{took[1]:.0f} s"]
    changed = sum(
        _said(a.answer) != _said(b.answer) for a, b in zip(baseline, found, strict=True)
    )
    differences = [
        f"{b - a:+d}" if b != a else "0" for a, b in zip(one, two, strict=True)
    ]
    times = f"x {took[1] / max(took[0], 1e-9):.2f}"
    value = str(change[1])
    return [
        change[0],
        value,
        str(default),
        changed,
        *differences,
        f"x {error:.3f}",
        times,
    ]


def _counts(found: Sequence[Judged]) -> tuple[int, ...]:
    """Returns numbers: named, in set, logs with wrong names, false none, alarms."""
    kept = [j for j in found if not j.case.left_out]
    return (
        sum(j.named for j in kept),
        sum(j.in_set for j in kept),
        sum(bool(j.wrong) for j in found),
        sum(j.is_false_none for j in found),
        sum(j.is_alarm for j in found),
    )


def _errors(found: Sequence[Judged]) -> float:
    """Returns the geometric mean of the errors after, of those that are known."""
    known = [j.answer.after for j in found if j.answer.after]
    return float(np.exp(np.mean(np.log(known)))) if known else float("nan")


def _said(answer: Answer) -> tuple[Any, ...]:
    sets = {name: set(rivals) for name, rivals in answer.ambiguous.items()}
    return answer.ending, set(answer.confirmed), set(answer.suggested), sets


def _matters(change: Change, read: Sequence[str]) -> bool:
    return not change or change[0] in read


def _answer(kept: FinishedWork, selector: Any, case: Case, change: Change) -> Answer:
    key = [*change, case.name]
    if kept.get(key) is None:
        settings = dict([change]) if change else {}
        kept.keep(key, asked(lambda each: selector.asked(each, settings), case).plain)
    return Answer.of_plain(kept.get(key))


def _read(kept: FinishedWork, selector: Any, case: Case) -> list[str]:
    key = ["read", case.name]
    if kept.get(key) is None:
        kept.keep(key, sorted(selector.settings_read(case)))
    found: list[str] = kept.get(key)
    return found


def _selector(name: str) -> Any:
    """Returns a selector's module.

    Raises:
        DisasmError: it has no settings.
    """
    module = importlib.import_module(f"selection.{name}")
    if not hasattr(module, "settings_read"):
        raise DisasmError(
            f"`selector` {name}: has no settings; its module needs defaults(), "
            "asked(case, changes) and settings_read(case), as current has"
        )
    return module


def _refuse_unknown(names: Sequence[str] | None, known: dict[str, Any]) -> None:
    for name in names or ():
        if name not in known:
            raise DisasmError(
                f"`settings` {name}: no such setting; known: {', '.join(known)}"
            )


if __name__ == "__main__":
    run(main)

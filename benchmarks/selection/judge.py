"""Runs selectors of effects over logs with known contents, and scores them.

A selector is told a log and says which effects its model lacks: confirmed, suggested,
ambiguous (see `selection/answer.py`). It is the function `select` of a module in
benchmarks/selection: `sketch`, `bic`, `group_lasso`, `frozen` (the package at commit
afdf342), `current` (the package), or one of your own.

Cases are made when they are first asked for. Their names are paths:

  joint/one/2x/white/JointDelay_0   an arm's torques, one effect, at twice the noise
  filter/...                        the same through the filter of import-log
  unmodelled/...                    an arm that does what no library has, too
  static100/..., static900/...      readings of a sensor: 100 poses, or 900 rows
  cell/...                          transitions of the cell; minutes each
  real/ur10e_unloaded/first         a real recording: whole, first or second half
  more/...                          more of the same, with other seeds

The kind of effect in a name is the one that is tried first; where a motion can't show
it at that size, the next of the list is hidden.

`fast` stands for all that takes seconds, `all` for those and the cell's.

How to read the table. "named": hidden effects that are confirmed by name. "in set":
these, and those in the ambiguous set of a name. "wrong names": logs in which a name is
confirmed that was not put in, nor has one in its set that was. "false none": ending
"none" though effects of twice the noise or more are there. "alarms": logs without an
effect in which one is confirmed. "coverage": 95 % intervals that hold the true value.
"error": on another recording, relative to what was measured, medians; "least": of the
true model. An effect that the library lacks may have another's name with the same
error: a drift is the begin of a warm-up. So logs of what is left out are counted apart.
"time": of the processor, from the log's folder to the answer; set OMP_NUM_THREADS=1, so
that it is that of a clock on an idle machine.
"""

import argparse
import importlib
import shutil
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from real_data import MissingDataError
from results import add_results_argument, markdown, write_result

from drake_disasm.common import options
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.finished_work import FinishedWork
from drake_disasm.common.program import ProgressBar, argument_parser, run
from drake_disasm.common.progress import ProgressUpdate
from selection import scores
from selection.answer import FAILED, Answer, Case, Select, refusal
from selection.cases import case_of, chosen

_PROGRAM = "benchmarks/selection/judge.py"
_EXAMPLES = """examples:
  python benchmarks/selection/judge.py --selector sketch --cases 'real*'
  python benchmarks/selection/judge.py --selector sketch bic --cases fast --limit 60
  python benchmarks/selection/judge.py --selector current --cases 'joint/*' --fresh
  python benchmarks/selection/judge.py --cases fast --list
"""
_TITLE = "Effect selection, judged"


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    add = parser.add_argument
    add(
        "--selector", nargs="+", default=["sketch"], metavar="NAME",
        help="modules of benchmarks/selection with a function select "
        "(default: sketch)",
    )  # fmt: skip
    add(
        "--cases", nargs="+", default=["fast"], metavar="PATTERN",
        help="names of cases, with * and ?, or fast or all (default: fast)",
    )  # fmt: skip
    add(
        "--limit", type=options.positive, metavar="N",
        help="only the first N of the cases, in an order that mixes all kinds",
    )  # fmt: skip
    add_folder_arguments(add)
    add("--fresh", action="store_true", help="forget the selectors' kept answers")
    add("--list", action="store_true", help="print the names of the cases, and end")
    add("--each", action="store_true", help="print a line for each case, too")
    add_results_argument(parser)
    return parser.parse_args(arguments)


def add_folder_arguments(add: Callable[..., object]) -> None:
    """Adds the folders of answers and of cases' logs to a program's arguments."""
    add(
        "--out", type=Path, default=Path("out/judge"), metavar="FOLDER",
        help="keeps answers; a run that was stopped goes on from there "
        "(default: out/judge)",
    )  # fmt: skip
    add(
        "--logs", type=Path, default=None, metavar="FOLDER",
        help="keeps the logs of cases (default: cases in the folder of --out)",
    )  # fmt: skip


def main(arguments: Sequence[str]) -> int:
    """Asks the selectors, and prints the tables."""
    args = parse(arguments)
    names = chosen(args.cases)[: args.limit]
    if args.list:
        print("\n".join(sorted(names)))
        return 0
    logs = (args.logs or args.out / "cases").resolve()
    found = {}
    with ProgressBar(unit="case") as progress:
        for selector in args.selector:
            kept = args.out / "answers" / selector
            if args.fresh:
                shutil.rmtree(kept, ignore_errors=True)
            select = selector_of(selector)
            found[selector] = judged(
                select, names, logs, FinishedWork(kept), progress, selector
            )
    print_tables(found, args.each)
    rows = scores.table(found)
    write_result(args.results, _TITLE, scores.COLUMNS, rows, _PROGRAM, arguments)
    return 0


def selector_of(name: str) -> Select:
    """Returns the selector of a module's name.

    Raises:
        DisasmError: there is no such module, or it has no `select`.
    """
    try:
        module = importlib.import_module(f"selection.{name}")
    except ModuleNotFoundError as error:
        if error.name != f"selection.{name}":
            raise
        raise DisasmError(
            f"`selector` {name}: no module of benchmarks/selection; take sketch, bic, "
            "group_lasso, frozen or current, or write one with a function select"
        ) from None
    select: Select | None = getattr(module, "select", None)
    if select is None:
        raise DisasmError(f"`selector` {name}: the module has no function select")
    return select


def judged(
    select: Select,
    names: Sequence[str],
    logs: Path,
    kept: FinishedWork,
    progress: ProgressBar,
    stage: str,
) -> list[scores.Judged]:
    """Returns cases with their answers; those that are kept are not asked for again.

    But those at which the selector failed are. Cases whose data are missing are left
    out.

    Args:
        select: answers.
        names: of the cases.
        logs: folder of the cases.
        kept: the answers so far.
        progress: is told.
        stage: what is told of.
    """
    found = []
    for number, name in enumerate(names, start=1):
        try:
            case = case_of(name, logs)
        except MissingDataError as error:
            progress(ProgressUpdate(stage, message=f"{name} is left out: {error}"))
            continue
        known = kept.get(name)
        if known is None or known["text"].startswith(FAILED):
            kept.keep(name, asked(select, case).plain)
        found.append(scores.Judged(case, Answer.of_plain(kept.get(name))))
        said = ", ".join(found[-1].answer.confirmed) or found[-1].answer.ending
        message = f"{name}: {said}"[:100]
        progress(ProgressUpdate(stage, number, len(names), message=message))
    return found


def asked(select: Select, case: Case) -> Answer:
    """Returns a selector's answer, with its time if it does not say that itself.

    A log that it refuses, or at which it fails, has an answer, too.
    """
    begin = time.process_time()
    try:
        answer = select(case)
    except DisasmError as error:
        answer = refusal(error)
    except Exception as error:  # a selector's failure is a result, too
        answer = Answer("refused", text=f"{FAILED}{type(error).__name__}: {error}")
    if answer.seconds:
        return answer
    took = time.process_time() - begin
    return Answer(**vars(answer) | {"seconds": took})


def print_tables(found: dict[str, list[scores.Judged]], each: bool) -> None:
    """Prints what was judged, as Markdown."""
    if each:
        for selector, own in found.items():
            for j in own:
                print(f"{selector}: {j.case.name}: {line(j)}")
        print()
    print(markdown(scores.COLUMNS, scores.table(found)))
    halves = scores.halves_table(found)
    if halves:
        print(f"\n{markdown(scores.HALVES_COLUMNS, halves)}")
    real = scores.real_table(found)
    if real:
        print(f"\n{markdown(scores.REAL_COLUMNS, real)}")
    for selector, own in found.items():
        failed = [j for j in own if j.answer.text.startswith(FAILED)]
        if failed:
            first = f"{failed[0].case.name}: {failed[0].answer.text}"
            print(f"\n{selector}: failed at {len(failed)} cases, the first {first}")


def line(judged: scores.Judged) -> str:
    """Returns a case and its answer in a line."""
    case, answer = judged.case, judged.answer
    rivals = [n for own in answer.ambiguous.values() for n in own]
    parts = [
        f"{scores.in_short(case.hidden)} -> {answer.ending}",
        scores.in_short(answer.confirmed),
        f"suggested {scores.in_short(answer.suggested)}" if answer.suggested else "",
        f"wrong {scores.in_short(judged.wrong)}" if judged.wrong else "",
        f"rivals {scores.in_short(rivals)}" if rivals else "",
        f"{answer.seconds:.1f} s",
        answer.text if answer.ending in ("refused", "too short") else "",
    ]
    return " | ".join(part for part in parts if part)


if __name__ == "__main__":
    run(main)

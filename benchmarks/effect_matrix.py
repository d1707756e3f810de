"""Blind tests of closing the loop: the confusion matrix, null logs, and more."""

import os
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from objective_speed import recorded_log

from drake_disasm.common.executors import WorkerPool
from drake_disasm.common.files import make_folder, write_figure, write_text
from drake_disasm.common.finished_work import FinishedWork
from drake_disasm.common.program import ProgressBar
from drake_disasm.effects import GroovePose
from drake_disasm.logs import read_log
from drake_disasm.scenario import Scenario, load_scenario
from sysid.effect_selection.close_loop import close_loop
from sysid.models.twin import TwinModel
from sysid.validation.blind_tests import (
    Answer,
    Case,
    left_out_cases,
    null_cases,
    pair_cases,
    run_cases,
    single_cases,
)
from sysid.validation.synthetic_logs import transitions_log
from sysid.validation.tables import confusion_figure, errors_table, table
from sysid.workers import Workers

LEVELS = (1.0, 2.0, 5.0)
CORRELATIONS = (0.0, 0.5)
_LEFT_OUT_LEVEL = 5.0
_PAIR_LEVEL = 3.0
_STEPS, _TURN = 80, 0.0349066  # of an episode; rad, as in removal_turned


def run_matrix(folder: Path, seeds: int, nulls: int, pairs: int, first: int = 0) -> str:
    """Runs the blind tests; returns what they show, as Markdown.

    Answers that are in the folder already are not asked for again.

    Args:
        folder: gets `results.jsonl` with the answers, `effects.md` and `confusion.png`.
        seeds: of each effect at each level.
        nulls: logs without an effect, of each correlation of the noise.
        pairs: logs with two effects.
        first: of the seeds.
    """
    groups: dict[str, list[Case]] = {
        "singles": single_cases(LEVELS, range(first, first + seeds)),
        "pairs": pair_cases(_PAIR_LEVEL, range(first, first + pairs)),
        "nulls": null_cases(CORRELATIONS, range(first, first + nulls)),
        "left out": left_out_cases(_LEFT_OUT_LEVEL, range(first, first + 1)),
    }
    cases = [case for group in groups.values() for case in group]
    make_folder(folder)
    with (
        ProgressBar(unit="log") as bar,
        WorkerPool(os.cpu_count() or 1, progress=bar) as pool,
    ):
        found = run_cases(cases, pool, FinishedWork(folder))
    by_key = {a.case.key: a for a in found}
    text = in_words({n: [by_key[c.key] for c in g] for n, g in groups.items()})
    write_text(folder / "effects.md", text + "\n")
    singles = [by_key[c.key] for c in groups["singles"]]
    if singles:
        write_figure(folder / "confusion.png", confusion_figure(singles), dpi=110)
    return text


def in_words(found: dict[str, list[Answer]]) -> str:
    """Returns what blind tests of each kind show, as Markdown."""
    singles, pairs, nulls, left = found.values()
    lines = [table(singles), "", errors_table(singles), ""] if singles else []
    if pairs:
        both = sum(a.in_tie for a in pairs)
        lines.append(f"two effects at once: both found in {both} of {len(pairs)} logs")
    for rho in CORRELATIONS:
        own = [a for a in nulls if a.case.correlation == rho]
        alarms = sum(a.ending != "none" for a in own)
        if own:
            lines.append(
                f"nothing there, noise correlated {rho:g}: "
                f"{alarms} alarms in {len(own)} logs"
            )
    if left:
        said = Counter(a.ending for a in left)
        lines.append(
            "an effect that the library lacks: "
            f"unexplained in {said['unexplained']}, none in {said['none']}, explained "
            f"in part by another name in {said['partly']} and wholly in "
            f"{said['explained']} of {len(left)}"
        )
    return "\n".join(lines)


@contextmanager
def _turned_log(transitions: int, scenario: Scenario) -> Iterator[Path]:
    """Yields a log of a turned groove with a scenario's contact; it goes after."""
    if scenario.contact.model == "hydroelastic":
        with recorded_log(transitions) as log:
            yield log
        return
    with tempfile.TemporaryDirectory() as folder:
        episodes = -(-transitions // _STEPS)
        turned = [GroovePose(ry=_TURN)]
        log = Path(folder) / "log"
        transitions_log(log, scenario, turned, 0, episodes, _STEPS)
        yield log


def closing_time(transitions: int, workers: int, contact: str) -> float:
    """Returns the time [s] from a log of the twin to the verdict.

    The log is of a turned groove, which the stated scenario does not know.
    """
    scenario = load_scenario("removal", [f"contact.model={contact}"])
    with _turned_log(transitions, scenario) as log:
        start = time.perf_counter()
        model = TwinModel([read_log(log)], scenario, ()).first(transitions)
        with Workers(workers) as pool:
            close_loop(model, workers=pool)
        return time.perf_counter() - start

"""Blind tests of closing the loop: the confusion matrix, null logs, and more."""

import os
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from objective_speed import recorded_log
from results import Cell

from drake_disasm.common.executors import WorkerPool
from drake_disasm.common.files import make_folder, write_figure, write_text
from drake_disasm.common.finished_work import FinishedWork
from drake_disasm.common.program import ProgressBar
from drake_disasm.effects import GroovePose
from drake_disasm.learning.statistics import wilson_interval
from drake_disasm.logs import read_log
from drake_disasm.scenario import Scenario, load_scenario
from sysid.effect_selection.close_loop import close_loop
from sysid.models.twin import TwinModel
from sysid.validation.blind_tests import (
    Answer,
    Case,
    left_out_cases,
    null_cases,
    run_cases,
    several_cases,
    single_cases,
)
from sysid.validation.synthetic_logs import transitions_log
from sysid.validation.tables import confusion_figure, errors_table, table
from sysid.workers import Workers

LEVELS = (1.0, 2.0, 5.0)  # times the noise
CORRELATIONS = (0.0, 0.5)
#: What is counted, how often by default, and what it is.
COUNTS = (
    ("seeds", 5, "of each effect at each size"),
    ("pairs", 40, "logs with two effects"),
    ("triples", 20, "logs with three effects"),
    ("nulls", 100, "logs without an effect, of each correlation of the noise"),
    ("left_out", 1, "logs of each effect, which the library lacks"),
)
_LEFT_OUT_LEVEL = 5.0
_SEVERAL_LEVEL = 3.0
_STEPS, _TURN = 80, 0.0349066  # of an episode; rad, as in removal_turned


def run_matrix(
    folder: Path,
    counts: Mapping[str, int],
    first: int = 0,
    levels: Sequence[float] = LEVELS,
) -> dict[str, list[Answer]]:
    """Runs the blind tests; returns the answers by what `COUNTS` lists.

    Answers that are in the folder already are not asked for again.

    Args:
        folder: gets `results.jsonl` with the answers, `effects.md` and `confusion.png`.
        counts: by what `COUNTS` lists.
        first: of the seeds.
        levels: sizes of single effects, times the noise.
    """
    seeds = {name: range(first, first + count) for name, count in counts.items()}
    groups: dict[str, list[Case]] = {
        "seeds": single_cases(levels, seeds["seeds"]),
        "pairs": several_cases(2, _SEVERAL_LEVEL, seeds["pairs"]),
        "triples": several_cases(3, _SEVERAL_LEVEL, seeds["triples"]),
        "nulls": null_cases(CORRELATIONS, seeds["nulls"]),
        "left_out": left_out_cases(_LEFT_OUT_LEVEL, seeds["left_out"]),
    }
    cases = [case for group in groups.values() for case in group]
    make_folder(folder)
    with (
        ProgressBar(unit="log") as bar,
        WorkerPool(os.cpu_count() or 1, progress=bar) as pool,
    ):
        # In no order, so that a part of them stands for all.
        order = np.random.default_rng(0).permutation(len(cases))
        found = run_cases([cases[i] for i in order], pool, FinishedWork(folder))
    by_key = {a.case.key: a for a in found}
    answers = {n: [by_key[c.key] for c in g] for n, g in groups.items()}
    text = in_words(answers)
    write_text(folder / "effects.md", text + "\n")
    if answers["seeds"]:
        figure = confusion_figure(answers["seeds"])
        write_figure(folder / "confusion.png", figure, dpi=110)
    return answers


def in_words(found: Mapping[str, Sequence[Answer]]) -> str:
    """Returns what blind tests of each kind show, as Markdown."""
    singles, left = found["seeds"], found["left_out"]
    lines = [table(singles), "", errors_table(singles), ""] if singles else []
    lines += [
        f"{logs}: {what}: {passed} of {count} ({interval} %)"
        for logs, what, passed, count, interval in counted(found)
    ]
    if left:
        ends = Counter(a.ending for a in left).items()
        lines.append(", ".join(f"{count} {end}" for end, count in ends))
    return "\n".join(lines)


def counted(found: Mapping[str, Sequence[Answer]]) -> list[tuple[Cell, ...]]:
    """Returns how many of each kind of log passed: kind, what, passed, of, interval."""
    singles, nulls = found["seeds"], found["nulls"]
    groups: list[tuple[str, str, list[bool]]] = []
    for level in sorted({a.case.level for a in singles}):
        own = [a.named_first for a in singles if a.case.level == level]
        groups.append((f"one effect, {level:g} times the noise", "named first", own))
    for name in ("pairs", "triples"):
        tied = [a.in_tie for a in found[name]]
        groups.append((name, "all confirmed or in an ambiguous set", tied))
    for rho in CORRELATIONS:
        own = [bool(a.names) for a in nulls if a.case.correlation == rho]
        groups.append((f"no effect, noise correlated by {rho:g}", "false alarms", own))
    open_ = [a.ending != "explained" for a in found["left_out"]]
    groups.append(("an effect that the library lacks", "not explained", open_))
    return [_row(*group) for group in groups if group[2]]


def _row(logs: str, what: str, passed: Sequence[bool]) -> tuple[Cell, ...]:
    """Returns how many passed, with Wilson's interval."""
    low, high = (100.0 * end for end in wilson_interval(sum(passed), len(passed)))
    return logs, what, sum(passed), len(passed), f"{low:.0f} to {high:.0f}"


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

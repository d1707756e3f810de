"""The confusion matrix of blind tests, as table and as figure."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.figure import Figure

from sysid.validation.blind_tests import Answer

_NOTHING = ("none", "unexplained", "refused")


def table(answers: Sequence[Answer]) -> str:
    """Returns how often each effect was named, level by level, as Markdown.

    Args:
        answers: to cases of one effect each.
    """
    levels = sorted({a.case.level for a in answers})
    head = [f"{level:g} x" for level in levels]
    lines = [
        "| effect | " + " | ".join(f"first, {h} | in a tie, {h}" for h in head) + " |",
        "|---|" + "---|---|" * len(levels),
    ]
    for name in [*_effects(answers), "all"]:
        own = [a for a in answers if name in ("all", a.case.effects[0])]
        cells = []
        for level in levels:
            at = [a for a in own if a.case.level == level]
            cells += [_share(at, lambda a: a.named_first), _share(at, _found)]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def errors_table(answers: Sequence[Answer]) -> str:
    """Returns the error on held-out episodes before and after, as Markdown."""
    levels = sorted({a.case.level for a in answers})
    lines = [
        "| effect | " + " | ".join(f"{level:g} x" for level in levels) + " |",
        "|---|" + "---|" * len(levels),
    ]
    for name in _effects(answers):
        cells = []
        for level in levels:
            at = [
                a
                for a in answers
                if a.case.effects[0] == name and a.case.level == level
            ]
            before = np.median([a.before for a in at]) if at else np.nan
            after = np.median([a.after for a in at]) if at else np.nan
            cells.append(f"{before:.2f} → {after:.2f}")
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def confusion_figure(answers: Sequence[Answer]) -> Figure:
    """Returns which effect was named first for each one put in, over all levels."""
    rows = _effects(answers)
    said = [_said(a) for a in answers]
    others = sorted({s for s in said if s not in rows and s not in _NOTHING})
    columns = [*rows, *others, *(n for n in _NOTHING if n in said)]
    counts = np.zeros((len(rows), len(columns)))
    for a, name in zip(answers, said, strict=True):
        counts[rows.index(a.case.effects[0]), columns.index(name)] += 1
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    size = (2.5 + 0.3 * len(columns), 2.0 + 0.28 * len(rows))
    figure = Figure(figsize=size, layout="constrained")
    ax = figure.subplots()
    ax.imshow(share, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for i, j in zip(*np.nonzero(counts), strict=True):
        colour = "white" if share[i, j] > 0.5 else "black"
        text = f"{counts[i, j]:.0f}"
        ax.text(j, i, text, ha="center", va="center", color=colour, fontsize=7)
    ax.set_xticks(range(len(columns)), columns, rotation=90, fontsize=7)
    ax.set_yticks(range(len(rows)), rows, fontsize=7)
    ax.set_xlabel("named first", fontsize=9)
    ax.set_ylabel("put in", fontsize=9)
    return figure


def _effects(answers: Sequence[Answer]) -> list[str]:
    return list(dict.fromkeys(a.case.effects[0] for a in answers))


def _said(answer: Answer) -> str:
    """Returns the name that leads, or the ending where there is none."""
    return answer.names[0] if answer.names else answer.ending


def _found(answer: Answer) -> bool:
    return answer.in_tie


def _share(answers: Sequence[Answer], test: Callable[[Answer], bool]) -> str:
    if not answers:
        return "-"
    return f"{sum(map(test, answers))}/{len(answers)}"

"""What answers are worth: names, sets, endings, halves, intervals, errors and time."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from results import Cell, significant

from selection.answer import Answer, Case
from selection.noise import UNMODELLED

#: What is wrong in a log with unmodelled torques is a matter of degree: an average of
#: them is friction.
_APART = ("real", UNMODELLED)
_STRONG = 2.0  # times the noise: what is smaller may be missed

COLUMNS = (
    *("selector", "logs of", "logs", "effects", "named [%]", "in set [%]"),
    *("suggested [%]", "logs with wrong names [%]", "false none [%]", "alarms [%]"),
    *("coverage [%]", "error before", "error after", "after / least"),
    "median time [s]",
)
HALVES_COLUMNS = (
    *("selector", "recording", "first", "second", "Jaccard index", "sizes agree"),
)
REAL_COLUMNS = ("selector", "recording", "ending", "confirmed", "before", "after", "s")


@dataclasses.dataclass(frozen=True)
class Judged:
    """A case, the answer to it, and its scores."""

    case: Case
    answer: Answer

    @property
    def named(self) -> int:
        """How many hidden effects are confirmed by name."""
        return len(set(self.case.hidden) & set(self.answer.confirmed))

    @property
    def in_set(self) -> int:
        """How many are confirmed, or in the ambiguous set of a name."""
        return len(set(self.case.hidden) & self._said)

    @property
    def suggested(self) -> int:
        """How many are confirmed, in a set, or suggested."""
        said = self._said | set(self.answer.suggested)
        return len(set(self.case.hidden) & said)

    @property
    def _said(self) -> set[str]:
        sets = self.answer.ambiguous
        rivals = {name for own in sets.values() for name in own}
        return {*self.answer.confirmed, *sets, *rivals}

    @property
    def wrong(self) -> tuple[str, ...]:
        """Confirmed names that were not put in, nor have one in their set that was.

        Of a real recording nobody knows.
        """
        if self.case.kind == "real":
            return ()
        sets, hidden = self.answer.ambiguous, set(self.case.hidden)
        return tuple(
            name
            for name in self.answer.confirmed
            if not hidden & {name, *sets.get(name, ())}
        )

    @property
    def is_false_none(self) -> bool:
        """Whether "none" is said where something is missing.

        At twice the noise or more; of each real recording something is known to be.
        """
        is_there = self.case.level >= _STRONG or self.case.kind == "real"
        return is_there and self.answer.ending == "none"

    @property
    def is_alarm(self) -> bool:
        """Whether anything is confirmed where nothing is missing."""
        return self.case.group == "null" and self.answer.is_named

    @property
    def to_least(self) -> float | None:
        """The held-out error over that of the true model; None if it is not known."""
        after, least = self.answer.after, self.case.least_error
        return after / least if after is not None and least else None

    @property
    def covered(self) -> tuple[bool, ...]:
        """Whether each interval of a hidden effect's parameter holds its value."""
        true, sizes = self.case.values, self.answer.sizes
        return tuple(
            low <= true[name] <= high
            for name, (_, low, high) in sizes.items()
            if name in true and name.rpartition(".")[0] in self.case.hidden
        )


def group_of(case: Case) -> str:
    """Returns what a case is counted with: "joint, one, 2x"."""
    head = case.name.removeprefix("more/").partition("/")[0]
    level = f", {case.level:g}x" if case.level else ""
    return f"{head}, {case.group}{level}"


def table(found: Mapping[str, Sequence[Judged]]) -> list[list[Cell]]:
    """Returns a row of COLUMNS for each selector and group of cases, and for all.

    Args:
        found: by selector.
    """
    rows = []
    for selector, judged in found.items():
        groups: dict[str, list[Judged]] = {}
        for each in judged:
            groups.setdefault(group_of(each.case), []).append(each)
        whole = [each for each in judged if each.case.noise not in _APART]
        simulated = [each for each in whole if not each.case.left_out]
        known = [j for j in simulated if j.case.group in ("one", "three")]
        strong = [j for j in known if j.case.level >= _STRONG]
        groups = dict(sorted(groups.items()))
        if strong:
            groups["all simulated, one and three, 2x and 5x"] = strong
        if simulated:
            groups["all simulated, none left out"] = simulated
        rows += [row(selector, name, own) for name, own in groups.items()]
    return rows


def row(selector: str, name: str, judged: Sequence[Judged]) -> list[Cell]:
    """Returns a row of COLUMNS."""
    effects = sum(len(j.case.hidden) for j in judged if not j.case.left_out)
    kept = [j for j in judged if not j.case.left_out]
    nulls = [j.is_alarm for j in judged if j.case.group == "null"]
    simulated = [bool(j.wrong) for j in judged if j.case.kind != "real"]
    must = [j.is_false_none for j in judged if j.case.level or j.case.kind == "real"]
    covered = [inside for j in judged for inside in j.covered]
    before, after = (
        [getattr(j.answer, n) for j in judged] for n in ("before", "after")
    )
    return [
        selector,
        name,
        len(judged),
        effects,
        _percent(sum(j.named for j in kept), effects),
        _percent(sum(j.in_set for j in kept), effects),
        _percent(sum(j.suggested for j in kept), effects),
        _share(simulated),
        _share(must),
        _share(nulls),
        f"{_share(covered)} of {len(covered)}" if covered else "-",
        _median(before),
        _median(after),
        _median([j.to_least for j in judged]),
        _median([j.answer.seconds for j in judged]),
    ]


def halves_table(found: Mapping[str, Sequence[Judged]]) -> list[list[Cell]]:
    """Returns a row of HALVES_COLUMNS for each selector and recording in halves.

    The last of a selector is the mean over pairs that confirm anything.
    """
    rows: list[list[Cell]] = []
    for selector, judged in found.items():
        known = {j.case.name: j for j in judged if j.case.partner}
        firsts = [
            j
            for n, j in known.items()
            if n.endswith("/first") and j.case.partner in known
        ]
        indices = []
        for first in sorted(firsts, key=lambda j: j.case.name):
            second = known[first.case.partner]
            index = jaccard(first.answer.confirmed, second.answer.confirmed)
            agree, common = compatible(first.answer, second.answer)
            name = first.case.name.split("/")[1]
            names = (in_short(j.answer.confirmed) for j in (first, second))
            shown = "-" if index is None else round(index, 2)
            rows.append([selector, name, *names, shown, f"{agree} of {common}"])
            indices += [] if index is None else [index]
        if indices:
            mean = round(float(np.mean(indices)), 2)
            rows.append([selector, f"mean of {len(indices)}", "", "", mean, ""])
    return rows


def real_table(found: Mapping[str, Sequence[Judged]]) -> list[list[Cell]]:
    """Returns a row of REAL_COLUMNS for each selector and real log."""
    return [
        [
            selector,
            j.case.name.removeprefix("real/"),
            j.answer.ending,
            in_short(j.answer.confirmed),
            _rounded(j.answer.before),
            _rounded(j.answer.after),
            round(j.answer.seconds, 1),
        ]
        for selector, judged in found.items()
        for j in sorted(judged, key=lambda j: j.case.name)
        if j.case.kind == "real"
    ]


def jaccard(first: Iterable[str], second: Iterable[str]) -> float | None:
    """Returns the Jaccard index of two sets of names; None if both are empty."""
    one, two = set(first), set(second)
    return len(one & two) / len(one | two) if one | two else None


def compatible(first: Answer, second: Answer) -> tuple[int, int]:
    """Returns how many intervals of common confirmed names overlap, and of how many."""
    names = set(first.confirmed) & set(second.confirmed)
    common = [
        name
        for name in first.sizes
        if name in second.sizes and name.rpartition(".")[0] in names
    ]
    overlap = [
        max(first.sizes[n][1], second.sizes[n][1])
        <= min(first.sizes[n][2], second.sizes[n][2])
        for n in common
    ]
    return sum(overlap), len(common)


def in_short(names: Sequence[str]) -> str:
    """Returns names in short: a kind once, with its joints' number if they are many."""
    kinds: dict[str, list[str]] = {}
    for name in names:
        kind, _, joint = name.partition(".")
        kinds.setdefault(kind, []).append(joint)
    parts = [
        kind
        if joints == [""]
        else f"{kind} ({', '.join(joints)})"
        if len(joints) < 3
        else f"{kind} ({len(joints)} joints)"
        for kind, joints in kinds.items()
    ]
    return ", ".join(parts) or "-"


def _share(found: Sequence[bool]) -> Cell:
    return _percent(sum(found), len(found))


def _percent(count: int, of: int) -> Cell:
    return round(100.0 * count / of, 1) if of else "-"


def _median(values: Sequence[float | None]) -> Cell:
    known = [v for v in values if v is not None]
    return significant(float(np.median(known)), 3) if known else "-"


def _rounded(value: float | None) -> Cell:
    return "-" if value is None else significant(value, 3)

"""Tables of branches: what agents that come from different twins do on a robot."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sysid.studies.results import mean_of, paired_difference, rate
from sysid.studies.study import Level, Table

#: Figures by seed of what is finished of a combination of levels.
Read = Callable[[dict[str, Level]], Mapping[int, Mapping[str, Any]]]
Cell = Callable[[Sequence[Mapping[str, Any]]], str]


@dataclass(frozen=True)
class BranchTables:
    """Makes tables of a row for each robot and agent, and a column for each branch.

    Attributes:
        levels: of "mismatch", "agent" and "branch" that are studied.
        texts: what each branch is, in words.
        closed: the branch that others are compared with.
    """

    levels: Mapping[str, Sequence[Level]]
    texts: Mapping[str, str]
    closed: str

    def by_branch(self, title: str, read: Read, cell: Cell) -> Table:
        """Returns a table of what all seeds of a branch do together.

        Args:
            title: above it.
            read: figures by seed.
            cell: of all seeds' figures.
        """
        branches = self.levels["branch"]

        def of_branch(own: dict[str, Level], branch: Level) -> str:
            """Returns the cell of a branch."""
            return cell(list(read(own | {"branch": branch}).values()))

        rows = [
            [*map(str, own.values()), *(of_branch(own, b) for b in branches)]
            for own in self._rows()
        ]
        columns = ["mismatch", "agent", *map(str, branches)]
        note = "; ".join(f"{name}: {self.texts[str(name)]}" for name in branches)
        return Table(title, columns, rows, note)

    def gains(
        self, title: str, read: Read, figure: Callable[[Mapping[str, Any]], float]
    ) -> Table:
        """Returns a table of what the closed branch has more than each other.

        Args:
            title: above it.
            read: figures by seed.
            figure: that is compared, of one seed.
        """
        others = [b for b in self.levels["branch"] if b != self.closed]

        def figures(own: dict[str, Level], branch: Level) -> dict[int, float]:
            """Returns the figure by seed."""
            found = read(own | {"branch": branch})
            return {seed: figure(each) for seed, each in found.items()}

        rows = [
            [
                *map(str, own.values()),
                *(
                    paired_difference(figures(own, self.closed), figures(own, b))
                    for b in others
                ),
            ]
            for own in self._rows()
        ]
        columns = ["mismatch", "agent", *(f"against {name}" for name in others)]
        note = (
            "Mean of the differences seed by seed, and its 95 % interval by Student's "
            "t; the number of pairs in brackets."
        )
        return Table(title, columns, rows, note)

    def _rows(self) -> list[dict[str, Level]]:
        return [
            {"mismatch": mismatch, "agent": agent}
            for mismatch in self.levels["mismatch"]
            for agent in self.levels["agent"]
        ]


def success_share(figures: Mapping[str, Any]) -> float:
    """Returns the share of a seed's episodes that succeed."""
    return float(figures["successes"] / figures["episodes"])


def performance(figures: Mapping[str, Any]) -> float:
    """Returns a seed's mean episodic reward."""
    return float(figures["performance"])


def success_cell(seeds: Sequence[Mapping[str, Any]]) -> str:
    """Returns the episodes of all seeds that succeed, with Wilson's interval."""
    successes, episodes = (
        sum(each[key] for each in seeds) for key in ("successes", "episodes")
    )
    return rate(int(successes), int(episodes))


def performance_cell(seeds: Sequence[Mapping[str, Any]]) -> str:
    """Returns mean and spread of the seeds' mean episodic rewards."""
    return mean_of([performance(each) for each in seeds])


def first_success_cell(seeds: Sequence[Mapping[str, Any]]) -> str:
    """Returns the number of each seed's first episode that succeeded."""
    return ", ".join(str(each["first_success"] or "-") for each in seeds) or "-"

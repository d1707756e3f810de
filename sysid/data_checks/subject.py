"""What the checks look at: the episodes of logs, and the model that predicts them."""

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.logs import Episode, Log
from drake_disasm.logs.schema import WRENCH
from sysid.data_checks.finding import DataFinding
from sysid.data_checks.settings import DataSettings
from sysid.models.base import Array, LogModel
from sysid.models.measurements import episode_names, rows_of_logs

#: The quantity that the channels of an arm's model are measured by, by kind of log.
_BY_JOINT = {"joint_motion": "tau", "joint_torque_static": "tau", "joint_response": "q"}


@dataclass(frozen=True)
class Subject:
    """Logs of one kind, and their model.

    Attributes:
        logs: of the rows that the model uses.
        model: of these logs, all rows.
        settings: thresholds.
    """

    logs: Sequence[Log]
    model: LogModel
    settings: DataSettings

    @classmethod
    def of(cls, logs: Sequence[Log], model: LogModel, settings: DataSettings) -> Self:
        """Returns logs, as they were read, with their model."""
        return cls(rows_of_logs(logs, model.rows_in_use), model, settings)

    def as_read(self, finding: DataFinding) -> DataFinding:
        """Returns a finding with the numbers that its rows have in the logs as read."""
        in_use = self.model.rows_in_use
        rows = {
            name: tuple(in_use[name][list(own)].tolist()) if name in in_use else own
            for name, own in finding.rows.items()
        }
        return dataclasses.replace(finding, rows=rows)

    @property
    def kind(self) -> str:
        """The kind of the logs."""
        return self.logs[0].header.kind

    @property
    def is_of_joints(self) -> bool:
        """Whether each channel is a joint's."""
        return self.kind in _BY_JOINT

    @property
    def episodes(self) -> list[Episode]:
        """All episodes, in the order of the model's."""
        return [episode for log in self.logs for episode in log.episodes]

    @property
    def log_of(self) -> list[Log]:
        """The log of each episode."""
        return [log for log in self.logs for _ in log.episodes]

    def named(self) -> Iterator[tuple[str, Episode]]:
        """Yields each episode with its name in findings."""
        yield from zip(episode_names(self.logs), self.episodes, strict=True)

    def where(
        self, flagged: Callable[[Episode], NDArray[np.bool_]]
    ) -> dict[str, NDArray[np.bool_]]:
        """Returns a mask (rows,) of each episode, by the episode's name."""
        return {name: flagged(episode) for name, episode in self.named()}

    def column(self, name: str) -> Array:
        """Returns a column over all episodes (rows,)."""
        return np.concatenate([e.columns[name] for e in self.episodes])

    @property
    def column_names(self) -> list[str]:
        """The column of the table that each channel of the model is measured by."""
        names = [channel.name for channel in self.model.measurements.channels]
        if self.is_of_joints:
            return [f"{_BY_JOINT[self.kind]}.{i}" for i in range(len(names))]
        return [f"wrench.{n}" if n in WRENCH else f"X_GB_measured.{n}" for n in names]

    @property
    def declared_quantum(self) -> dict[str, float]:
        """The sensor's quantum that the scenario declares, by the channel's name."""
        scenario = getattr(self.model, "scenario", None)
        quantum = scenario.ft_sensor.quantum if scenario else [0.0] * len(WRENCH)
        return dict(zip(WRENCH, quantum, strict=True))

    def model_rows(self, number: int) -> tuple[NDArray[np.int64], int]:
        """Returns the model's rows of an episode, and the first one's row in its table.

        A transition is compared with the row at its end, so its rows begin at 1.
        """
        rows = np.flatnonzero(self.model.measurements.episode == number)
        return rows, self.episodes[number].rows - len(rows)


def kept_rows(
    subject: Subject, flagged: dict[str, set[int]], whole_episodes: bool = False
) -> NDArray[np.bool_]:
    """Returns which of a model's rows do not rest on rows that are flagged.

    A transition rests on the row that it begins with and on the one that it ends with.

    Args:
        subject: logs and model.
        flagged: rows of the logs' tables, by the episode's name.
        whole_episodes: whether an episode with such a row goes as a whole.
    """
    kept = np.ones(subject.model.measurements.rows, dtype=bool)
    for number, (name, _) in enumerate(subject.named()):
        bad = np.array(sorted(flagged.get(name, ())), dtype=np.int64)
        if name in subject.model.rows_in_use:
            bad = np.flatnonzero(np.isin(subject.model.rows_in_use[name], bad))
        rows, first = subject.model_rows(number)
        if whole_episodes and len(bad):
            kept[rows] = False
        ends = np.arange(first, first + len(rows))
        rests = np.isin(ends, bad) | np.isin(ends - first, bad)
        kept[rows[rests]] = False
    return kept

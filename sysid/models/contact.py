"""Wrench of a sensor during a task with contact: what it reads in free space."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs import Log, rotation_matrices, sensor_wrench
from drake_disasm.scenario import Scenario
from sysid.models.base import Array
from sysid.models.bookkeeping import Assumption
from sysid.models.free_space import FreeSpace, free_space
from sysid.models.measurements import episode_names, rows_of_logs
from sysid.models.static_wrench import StaticWrenchModel
from sysid.models.wrench_bookkeeping import Readings
from sysid.parameters import Parameter

_SUMMED = 1000  # rows in contact, and in free space, by which the contact is described
_TURNED = 1e-4  # mean square of gravity's direction, along the axis of its second most
_RECORD = (
    "record some seconds in free space, at rest in three or more orientations, before "
    "and after the task, and name these rows by 1 in a column `free`"
)


@dataclass(frozen=True)
class _Rows:
    """All rows of some logs.

    Attributes:
        time: (n,) since each episode began [s].
        lasts: (n,) until the next row [s].
        episode: (n,) number of each row's.
        R_WS: (n, 3, 3).
        wrench: (n, 6) at So in S [N, N m].
    """

    time: Array
    lasts: Array
    episode: NDArray[np.int64]
    R_WS: Array
    wrench: Array

    @classmethod
    def of(cls, logs: Sequence[Log]) -> Self:
        """Reads them."""
        pairs = [(log, episode) for log in logs for episode in log.episodes]
        times = [e["time"] - e["time"][0] for _, e in pairs]
        steps = [np.gradient(t) if len(t) > 1 else np.zeros(1) for t in times]
        return cls(
            np.concatenate(times),
            np.concatenate(steps),
            np.repeat(np.arange(len(pairs)), [len(t) for t in times]),
            np.concatenate([rotation_matrices(e["R_WS"]) for _, e in pairs]),
            np.concatenate([sensor_wrench(log.header, e) for log, e in pairs]),
        )

    def spread(self, mask: NDArray[np.bool_]) -> Self:
        """Returns some of the rows (n,) where the mask is true, evenly spread."""
        rows = np.flatnonzero(mask)
        rows = rows[:: max(1, -(-len(rows) // _SUMMED))]
        return dataclasses.replace(
            self, **{name: part[rows] for name, part in vars(self).items()}
        )

    def without_load_of(self, free: Self, g_W: Array) -> Array:
        """Returns the wrench (n, 6) without weight and zero, as others show them.

        Args:
            free: rows in free space.
            g_W: (3,) gravity [m/s^2].
        """
        own, known = (
            Readings(rows.R_WS, rows.wrench, g_W, in_W=False).columns()
            for rows in (self, free)
        )
        flat = known.reshape(-1, known.shape[2])
        fit = np.linalg.lstsq(flat, free.wrench.reshape(-1), rcond=None)[0]
        return np.asarray(self.wrench - own @ fit)


class ContactModel(StaticWrenchModel):
    """The reading in free space, of a task that makes contact, too.

    Rows in free space are those that the column `free` says, or else those that agree
    with one load and a slow zero (`free_space`). No model of the task predicts the
    others: they are set aside, and what the weight and the sensor's effects leave of
    them is the wrench of the contact.
    """

    kind = "contact"
    at_rest = False

    def __init__(
        self,
        logs: Sequence[Log],
        scenario: Scenario,
        parameters: Sequence[Parameter],
        known_payload: bool = False,
    ) -> None:
        """Reads the logs, and finds the rows in free space.

        Args:
            logs: of kind contact.
            scenario, parameters, known_payload: as of StaticWrenchModel.

        Raises:
            DisasmError: as StaticWrenchModel; or it is not known which rows are in
                free space.
        """
        self.refuse_other_kinds(logs)
        rows = _Rows.of(logs)
        free, found = _free_rows(logs, rows)
        self.rows_in_use = {
            name: np.flatnonzero(free[rows.episode == number])
            for number, name in enumerate(episode_names(logs))
        }
        used = rows_of_logs(logs, self.rows_in_use)
        super().__init__(used, scenario, parameters, known_payload)
        self._time = rows.time[free]
        self._contact = rows.spread(~free)
        left = self._contact.without_load_of(rows.spread(free), self._g_W)
        self.assumptions = (
            _of_rows(rows, free, found, left),
            *_of_steady_rows(rows, found),
            *_of_orientations(self.orientations),
        )

    def describe(self, theta: Array) -> dict[str, tuple[float, str]]:
        """Returns weight and centre of mass, and the wrench of the contact (rms)."""
        rows, described = self._contact, super().describe(theta)
        if len(rows.time):
            read = self.reading(theta, rows.time, rows.R_WS)
            force, torque = _rms(rows.wrench - read)
            described["contact force (rms)"] = (force, "N")
            described["contact torque (rms)"] = (torque, "N m")
        return described

    def _read(self, readings: Readings) -> Self:
        """See StaticWrenchModel; of the contact only what was written is at hand."""
        none = self._contact.spread(np.zeros(len(self._contact.time), dtype=bool))
        return super()._read(readings).replace(_contact=none)


def _free_rows(
    logs: Sequence[Log], rows: _Rows
) -> tuple[NDArray[np.bool_], FreeSpace | None]:
    """Returns which rows (n,) are in free space, and how they were found, if so.

    Raises:
        DisasmError: the column says nothing useful, or it is not told.
    """
    where = ", ".join(log.folder.name for log in logs)
    episodes = [episode for log in logs for episode in log.episodes]
    if all("free" in episode for episode in episodes):
        stated = np.concatenate([episode["free"] for episode in episodes])
        if not np.isin(stated, (0.0, 1.0)).all():
            raise DisasmError(
                f"{where}: column 'free' is neither 0 nor 1 in some row; write 1 for "
                "rows in free space, else 0"
            )
        if not stated.any():
            raise DisasmError(f"{where}: no row is in free space; {_RECORD}")
        return stated == 1.0, None
    found = free_space(rows.time, rows.episode, rows.R_WS, rows.wrench)
    if not found.is_told:
        raise DisasmError(
            f"{where}: it is not told which rows are in free space: "
            f"{100 * found.share:.0f} % of the log agree with one load and a slow zero "
            f"within the noise ({_within(found.noise)}), and {100 * found.rival:.0f} % "
            f"with others; {_RECORD}"
        )
    return found.rows, found


def _of_rows(
    rows: _Rows, free: NDArray[np.bool_], found: FreeSpace | None, left: Array
) -> Assumption:
    """Returns what is taken for free space, and what is known of the contact."""
    of_time = f"{rows.lasts[free].sum():.3g} of {rows.lasts.sum():.3g} s"
    what = f"{free.sum()} of {len(free)} rows ({of_time}) are "
    remedy = "no model predicts the contact itself: it is not judged"
    if found is None:
        what += "in free space, as `free` says"
    else:
        what += (
            "taken for free space: they agree with one load and a slow zero within "
            f"{_within(found.noise)}"
        )
        remedy = "if you know which rows are, say so by 1 in a column `free`"
    if len(left):
        force, torque = _rms(left)
        what += (
            f"; the others are in contact and set aside: {force:.3g} N and "
            f"{torque:.3g} N m (rms) without weight and zero"
        )
    return Assumption(what, remedy)


def _of_steady_rows(rows: _Rows, found: FreeSpace | None) -> list[Assumption]:
    """Returns what can't be told apart of the rows that are set aside."""
    if found is None or not found.steady.any():
        return []
    what = (
        f"in {rows.lasts[found.steady].sum():.3g} s of the rows set aside the wrench "
        "is held within the noise: a contact that is held, or a zero that has moved, "
        "which this log can't tell apart"
    )
    return [Assumption(what, _RECORD)]


def _of_orientations(R_WS: Array) -> list[Assumption]:
    """Returns that orientations (n, 3, 3) don't tell a weight from a zero, if so.

    The lever of a weight is known along two axes at least once gravity's direction in S
    varies about two.
    """
    down_S = -R_WS[:, 2]
    off = down_S - down_S.mean(axis=0)
    if float(np.linalg.eigvalsh(off.T @ off)[1]) > _TURNED * len(off):
        return []
    what = (
        "the rows in free space hardly vary in orientation: the weight, its lever and "
        "the zero are not told apart"
    )
    return [Assumption(what, _RECORD)]


def _within(noise: Array) -> str:
    """Returns the largest noise (6,) of forces and of torques in words."""
    return f"{noise[:3].max():.2g} N and {noise[3:].max():.2g} N m"


def _rms(wrench: Array) -> tuple[float, float]:
    """Returns the root mean square of forces and of torques (n, 6) as vectors."""
    force, torque = (
        float(np.sqrt(np.mean(np.sum(part**2, axis=1))))
        for part in np.hsplit(wrench, 2)
    )
    return force, torque

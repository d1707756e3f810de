"""A log of an arm's motions that grows by an episode for each experiment."""

import contextlib
import dataclasses
import shutil
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Protocol

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import write_text
from drake_disasm.common.progress import Progress, ignore_progress
from drake_disasm.experiments import JointPlan
from drake_disasm.free_motion.arm_limits import CollisionFreeSpace, JointLimits
from drake_disasm.free_motion.arm_space import ArmSpace
from drake_disasm.free_motion.cell_urdf import cell_urdf
from drake_disasm.free_motion.playing import MotionPlayer
from drake_disasm.free_motion.recording import URDF, response_header
from drake_disasm.free_motion.table import MotionTable
from drake_disasm.free_motion.way import way_out
from drake_disasm.logs import Log, LogHeader, flat_columns, read_log
from drake_disasm.logs.importing import (
    ImportProcessing,
    Known,
    guessed_map,
    import_recordings,
    read_source,
    write_log,
)
from drake_disasm.scenario import Scenario
from drake_disasm.stations import Station
from drake_disasm.stations.hardware import HardwareStation, HoldError
from sysid.diagnosis.experiment_log import ExperimentLog
from sysid.diagnosis.in_contact import is_within
from sysid.models.base import Array, LogModel
from sysid.models.from_logs import ModelChoice, model_of

#: Kinds of logs that an arm in free space gives.
KINDS = ("joint_motion", "joint_response")

_ACCELERATION = 5.0  # rad/s^2, of joints whose URDF states none
_MARGIN = 0.1  # of each limit
_CLEARANCE = 0.02  # m, of links from each other
_FLOOR = 0.05  # m over the base's frame, of link's origins


class Arm(Protocol):
    """What plays motions, one after the other, each from home and back."""

    def play(
        self, motion: MotionTable, progress: Progress
    ) -> tuple[Mapping[str, Array], float]:
        """Plays a motion.

        Returns:
            Columns of a log of kind `joint_response`, with torques, and robot time [s]
            with the way to where it begins.
        """

    def check(self) -> None:
        """Raises HoldError while the arm is held."""


class StationArm:
    """The arm of a cell's station, simulated or real.

    Args:
        station: its arm at the start of the task.
    """

    def __init__(self, station: Station) -> None:
        self._station = station
        self._player: MotionPlayer | None = None
        self._ended = 0.0

    def play(
        self, motion: MotionTable, progress: Progress
    ) -> tuple[Mapping[str, Array], float]:
        """See Arm; what was played before a hold is kept."""
        if self._player is None:
            self._player = MotionPlayer(self._station, motion)
        else:
            self._player.follow_with(motion)
        player, begun = self._player, self._ended
        with contextlib.suppress(HoldError):
            player.play(progress=progress)
        self._ended = player.simulator.get_context().get_time()
        return player.columns(), self._ended - begun

    def check(self) -> None:
        """See Arm."""
        self._station.check()


def arm_of_station(
    station: Station, scenario: Scenario, folder: Path
) -> tuple[StationArm, ArmSpace, LogHeader]:
    """Returns the arm of a cell, the space beside its bench, and its logs' header.

    Args:
        station: "cell" or "hardware", its arm at the start of the task.
        scenario: that logs state.
        folder: of the log; gets the URDF of arm and tool.

    Raises:
        DisasmError: the arm has no free space.
    """
    if not station.joints:
        raise DisasmError("the twin has no arm to move; use `station` cell")
    urdf = str(folder / URDF)
    write_text(Path(urdf), cell_urdf(scenario))
    limits = JointLimits.of_urdf(urdf, station.joints, _ACCELERATION, _MARGIN)
    collisions = CollisionFreeSpace(urdf, station.joints, limits, _CLEARANCE)
    start, is_allowed = way_out(station)[-1], None
    if isinstance(station, HardwareStation):
        share = (1.0 - _MARGIN) * station.config.safety.velocity_share
        limits = dataclasses.replace(limits, velocity=share * limits.velocity)
        is_allowed = partial(_is_in_workspace, station)
    space = ArmSpace.of(limits, collisions, _CLEARANCE, _FLOOR, start, is_allowed)
    provenance = {"program": "diagnose"}
    header = response_header(scenario, folder, station.kind, provenance)
    return StationArm(station), space, header


def _is_in_workspace(station: HardwareStation, q: Array) -> bool:
    """Returns whether hardware's workspace has the bolt in postures (n, joints)."""
    p = np.array([station.coordinates.pose(one).translation() for one in q])
    return is_within(station.config.safety, p)


@dataclasses.dataclass(frozen=True)
class ArmPerformance:
    """What was measured during a motion.

    Attributes:
        measured: (n,) of each joint, by its name: its torque, or its position.
        torque: greatest of any joint [N m].
        duration: robot time [s].
        ended: why it was cut short; empty if it was performed whole.
        period: of rows [s].
    """

    measured: Mapping[str, Array]
    torque: float
    duration: float
    ended: str
    period: float

    @property
    def greatest(self) -> tuple[float, float]:
        """See Performed: nothing is touched."""
        return 0.0, self.torque

    def channel(self, name: str) -> Array:
        """See Performed."""
        return self.measured[name]


class GrowingArmLog(ExperimentLog):
    """An arm, and the log of what it played.

    Recordings are in the folder `motions`; of kind `joint_motion` they are imported
    anew into the folder `log` whenever there is another.

    Args:
        arm: that plays.
        space: in which.
        header: of recordings, of kind `joint_response`.
        folder: of both; recordings that are there already are kept.
        kind: of KINDS.
        progress: gets each step.

    Attributes:
        space, header, kind: as given.
    """

    def __init__(
        self,
        arm: Arm,
        space: ArmSpace,
        header: LogHeader,
        folder: Path,
        kind: str = KINDS[0],
        progress: Progress = ignore_progress,
    ) -> None:
        self._arm, self.space, self.kind, self.header = arm, space, kind, header
        self._folder = folder
        super().__init__(folder / "motions", header, progress)

    def refuse_hold(self) -> None:
        """Raises HoldError while the arm is held."""
        self._arm.check()

    def perform(self, plan: JointPlan) -> ArmPerformance:
        """Plays an experiment's motion; what was recorded is kept if the arm holds."""
        columns, duration = self._arm.play(plan.motion, self._progress)
        ended = ""
        try:
            self._arm.check()
        except HoldError as error:
            ended = str(error)
        if len(columns["time"]) >= 2:
            self._writer.write_episode(flat_columns("joint_response", columns))
        values = columns["tau" if self.kind == "joint_motion" else "q"]
        measured = dict(zip(self.header.joints, values.T, strict=True))
        torque = float(np.abs(columns["tau"]).max(initial=0.0))
        period = float(self.header.period or 0.0)
        return ArmPerformance(measured, torque, duration, ended, period)

    def model(self) -> LogModel:
        """Returns the model of the log so far."""
        return model_of([self.log()], ModelChoice())

    def log(self) -> Log:
        """Returns the log so far; that of torques is imported if need be."""
        motions, folder = self._writer.folder, self._folder / "log"
        if self.kind != "joint_motion":
            return read_log(motions)
        if folder.exists():
            found = read_log(folder)
            if len(found.episodes) == self.episodes:
                return found
            shutil.rmtree(folder)
        sources = [read_source(path) for path in sorted(motions.glob("*.parquet"))]
        known = Known(self.header.joints, in_order=True, urdf=str(self.header.urdf))
        fields = guessed_map(sources[0], self.kind, known)
        imported = import_recordings(sources, fields, ImportProcessing())
        write_log(imported, sources, fields, folder, {"program": "diagnose"})
        return read_log(folder)

"""Whether a robot's corrected twin accepts a policy, as a job of a study."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drake_disasm.common.files import make_folder, read_json, write_json
from drake_disasm.common.progress import Progress
from drake_disasm.scenario import TaskConfig
from sysid.acceptance import CorrectedTwin, accept

_RESULT: dict[str, Any] = {"accepted": False, "nominal": {"outcome": ""}}


@dataclass(frozen=True)
class PolicyAcceptance:
    """Tries a policy on a corrected twin.

    Attributes:
        path: of the JSON file with what it says (`Acceptance.to_mapping`).
        policy: its file.
        closed: folder of the corrected twin and its verdict.
        task: of the policies: the robot's log may have been for another reward.
        draws: over the verdict's intervals.
    """

    path: Path
    policy: Path
    closed: Path
    task: TaskConfig
    draws: int

    @property
    def is_finished(self) -> bool:
        """Whether the twin has been asked."""
        return self.path.exists()

    def __call__(self, progress: Progress) -> None:
        """Asks the twin."""
        twin = CorrectedTwin.read(self.closed)
        scenario = dataclasses.replace(twin.scenario, task=self.task)
        twin = dataclasses.replace(twin, scenario=scenario)
        [judged] = accept([str(self.policy)], twin, self.draws, progress=progress)
        make_folder(self.path.parent)
        write_json(self.path, judged.to_mapping())


def read_acceptance(path: Path) -> dict[str, Any] | None:
    """Returns what a corrected twin says of a policy, if it has been asked."""
    if not path.exists():
        return None
    return read_json(path, "delete it, and resume the study", _RESULT)

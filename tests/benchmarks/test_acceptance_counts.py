"""How policies are counted by what twins say of them and do on the robot."""

import dataclasses
import json
from pathlib import Path

from acceptance import rows

from drake_disasm.learning.evaluation import Evaluation
from sysid.studies.study import StudyOptions
from sysid.studies.twin_transfer import TwinTransferStudy, file_of
from tests.refusals import refused

_LEVELS = {"mismatch": ["rolled"], "agent": ["ddpg"], "branch": ["nominal", "closed"]}
#: Trained on, accepted by the corrected and the nominal twin, successes of two.
_MET = (
    ("nominal", False, True, 0),
    ("nominal", True, True, 2),
    ("closed", True, True, 2),
    ("closed", True, False, 1),
)


def test_a_policy_succeeds_if_all_its_episodes_do(tmp_path: Path) -> None:
    study = TwinTransferStudy(StudyOptions(seeds=(0, 1), levels=_LEVELS))
    with refused("no policy", "--count"):
        rows(study, tmp_path)
    zeros = {field.name: 0.0 for field in dataclasses.fields(Evaluation)}
    for number, (branch, corrected, nominal, successes) in enumerate(_MET):
        levels = {"mismatch": "rolled", "agent": "ddpg", "branch": branch}
        outcome = "SUCCESS" if nominal else "FORCE_LIMIT"
        said = {"accepted": corrected, "nominal": {"outcome": outcome}}
        test = zeros | {"successes": successes, "episodes": 2}
        for path, content in (
            (file_of("accepted", tmp_path, levels, number % 2), said),
            (file_of("tests", tmp_path, levels, number % 2), test),
        ):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(content))
    found = {tuple(row[:4]): row[4:6] + row[7:] for row in rows(study, tmp_path)}
    assert found["all", "either", "corrected", "accepted"] == [3, 2, "5 of 6"]
    assert found["all", "either", "corrected", "refused"] == [1, 0, "0 of 2"]
    assert found["all", "either", "nominal", "accepted"] == [3, 2, "4 of 6"]
    assert found["all", "either", "nominal", "refused"] == [1, 0, "1 of 2"]
    assert found["rolled", "closed", "corrected", "accepted"] == [2, 1, "3 of 4"]
    assert ("rolled", "closed", "corrected", "refused") not in found

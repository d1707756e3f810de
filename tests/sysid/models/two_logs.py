"""Two logs of a small arm, with effects of their own."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from drake_disasm.effects import Effect
from drake_disasm.logs import Log
from drake_disasm.scenario import Scenario
from sysid.models.joint_motion import JointMotionModel
from tests.sysid.models.arm import smooth_motion, write_motion_log, write_two_link_arm

NOISE = 0.02  # N m


def two_logs(
    folder: Path,
    effects: Sequence[Effect] = (),
    changes: Sequence[Effect] = (),
    since: int = 0,
    rows: int = 600,
) -> list[Log]:
    """Returns a reference with effects, and a log in which others act since a row."""
    folder.mkdir(parents=True, exist_ok=True)
    urdf = write_two_link_arm(folder / "arm.urdf")
    logs = []
    for number, own in enumerate((list(effects), [*effects, *changes])):
        time = np.arange(rows) * 0.01 + 10.0 * number
        q, v, vd = smooth_motion(time)
        columns = {"time": time - time[0], "q": q, "v": v, "vd": vd, "tau": 0.0 * q}
        log = write_motion_log(folder / f"still_{number}", urdf, columns)
        before, after = (_torques(log, each) for each in (list(effects), own))
        random = np.random.default_rng(number)
        begun = np.arange(rows)[:, None] >= since
        columns["tau"] = np.where(begun, after, before)
        columns["tau"] += NOISE * random.normal(size=q.shape)
        logs.append(write_motion_log(folder / f"log_{number}", urdf, columns))
    return logs


def _torques(log: Log, effects: list[Effect]) -> np.ndarray:
    model = JointMotionModel([log], scenario=Scenario(effects=effects))
    return model.predictions(np.array([p.nominal for p in model.parameters]))

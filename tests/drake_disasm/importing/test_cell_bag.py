"""A bag of our own cell: the shift in it, and the verdict that the log itself has."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.cell.parsing import movable_joints
from drake_disasm.effects import JointCoulombFriction
from drake_disasm.free_motion.table import MotionTable
from drake_disasm.importing import (
    Processing,
    guessed_map,
    import_recordings,
    read_source,
    write_log,
)
from drake_disasm.importing.shift import Shift
from drake_disasm.logs import read_log
from drake_disasm.scenario import load_scenario
from sysid.effect_selection import close_loop
from sysid.effect_selection.verdict import Verdict
from sysid.models.from_logs import ModelChoice, model_of
from tests.drake_disasm.importing.cell_bag import record_cell

_LATE = 0.012  # s
#: What the arm has, and its URDF doesn't say. Beside that either verdict may name what
#: a filter leaves of friction's edges where there is no noise: delays below 3 ms.
_OF_THE_ARM = ("RotorInertia", "JointViscousFriction", "JointCoulombFriction")
_FRICTION = {"iiwa_joint_2": 4.0, "iiwa_joint_4": 2.5}  # N m


def _motion() -> MotionTable:
    """Returns 12 s of all joints, each at a rate of its own, from rest to rest."""
    time = np.arange(0.0, 12.0, 0.005)
    phase = 2.0 * np.pi * np.outer(time / 12.0, np.arange(3, 10))
    middle = np.array([0.0, 0.2, 0.0, -1.4, 0.0, 1.2, 0.0])
    return MotionTable(time, middle - 0.1 * (1.0 - np.cos(phase)))


def _imported(
    source: Path, urdf: Path, folder: Path
) -> tuple[Verdict, dict[str, Shift]]:
    """Returns the verdict on a recording, and its shifts."""
    read = read_source(source)
    fields = guessed_map(read, "joint_motion", movable_joints(str(urdf)), str(urdf))
    imported = import_recordings([read], fields, Processing())
    write_log(imported, [read], fields, folder, {"program": "test"})
    closed = close_loop(model_of([read_log(folder)], ModelChoice()))
    return closed.verdict, imported.recordings[0].shifts


@pytest.mark.slow
def test_a_bag_of_the_cell_has_the_verdict_of_its_log(tmp_path: Path) -> None:
    stated = load_scenario("removal")
    effects = [JointCoulombFriction(joint=j, size=s) for j, s in _FRICTION.items()]
    hidden = dataclasses.replace(stated, effects=tuple(effects))
    record_cell(tmp_path, stated, hidden, _motion(), _LATE)
    urdf = tmp_path / "arm.urdf"
    bag, shifts = _imported(tmp_path / "bag", urdf, tmp_path / "a")
    table = tmp_path / "log/episode_0000.parquet"
    own, _ = _imported(table, urdf, tmp_path / "b")
    # A discrete plant's forces are those of the step before: the cell's own delay.
    expected = -(_LATE + stated.simulation.cell_time_step)
    assert shifts["/ft"].seconds == pytest.approx(expected, abs=1e-3)
    assert bag.ending == own.ending
    for kind in _OF_THE_ARM:
        named = [{n for n in v.names if n.startswith(kind)} for v in (bag, own)]
        assert named[0] == named[1] and named[0]
    found, values = ({v.name: v.value for v in each.values} for each in (bag, own))
    for joint, size in _FRICTION.items():
        name = f"JointCoulombFriction.{joint}.size"
        assert found[name] == pytest.approx(size, rel=0.02)
        assert values[name] == pytest.approx(size, rel=0.02)

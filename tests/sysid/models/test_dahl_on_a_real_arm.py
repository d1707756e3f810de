"""Pre-sliding friction against shifts in time, on a recording of a real arm."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.effects import (
    JointCoulombFriction,
    JointDahlFriction,
    JointDelay,
    JointViscousFriction,
    TorqueOffset,
)
from drake_disasm.logs import Log, read_log
from drake_disasm.logs.importing import (
    ImportProcessing,
    import_recordings,
    read_map,
    read_source,
    write_log,
)
from sysid.models.joint_motion import JointMotionModel
from tests.sysid.real_data import real_folder

_JOINT, _PARTS = "j7", 10


def _rokae(folder) -> Log:
    source = real_folder("cases") / "delay_or_presliding"
    fields = read_map(source / "map.yaml")
    fields = dataclasses.replace(fields, urdf=str(source / "rokae7.urdf"))
    sources = [read_source(source / "run.csv")]
    imported = import_recordings(sources, fields, ImportProcessing(6.0))
    write_log(imported, sources, fields, folder / "log", {})
    return read_log(folder / "log")


def _held_out(model: JointMotionModel, effects, delay: float = 0.0) -> float:
    """Returns the rms of a joint's torque, each tenth predicted by the others."""
    motion, i = model._motion, model.joints.index(_JOINT)
    bare, columns = motion.torques(motion.nominal, []), [*motion.Y.T[:, i]]
    for effect in effects:
        columns.append((motion.torques(motion.nominal, [effect]) - bare)[:, i])
    A = np.stack(columns, axis=1)
    shift = [JointDelay(_JOINT, delay)]
    as_read = [motion.shifted(np.tile(c[:, None], 7), shift)[:, i] for c in A.T]
    A, tau = np.stack(as_read, axis=1), model.measurements.values[:, i]
    missed = []
    for part in np.array_split(np.arange(len(tau)), _PARTS):
        kept = np.delete(np.arange(len(tau)), part)
        x = np.linalg.lstsq(A[kept], tau[kept], rcond=1e-3)[0]
        missed.append(tau[part] - A[part] @ x)
    return float(np.sqrt(np.mean(np.concatenate(missed) ** 2)))


@pytest.mark.slow
def test_it_explains_a_joint_better_than_any_shift_in_time(tmp_path):
    """A Rokae xMate3 Pro: 0.117 N m, with a delay 0.138, with dry friction 0.177."""
    model = JointMotionModel([_rokae(tmp_path)])
    others = [JointViscousFriction(_JOINT, 1.0), TorqueOffset(_JOINT, 1.0)]
    dry = [*others, JointCoulombFriction(_JOINT, 1.0)]
    delayed = min(_held_out(model, dry, T) for T in np.arange(0.0, 0.1, 0.01))
    built_up = min(
        _held_out(model, [*others, JointDahlFriction(_JOINT, 1.0, slip)])
        for slip in (5e-4, 1e-3, 2e-3)
    )
    assert built_up < 0.95 * delayed < 0.9 * _held_out(model, dry)

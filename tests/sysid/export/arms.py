"""Simulated arms whose bodies, friction and payload are known, and their fits."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drake_disasm.common.resources import model_path
from drake_disasm.effects import Effect
from drake_disasm.logs import LogHeader, LogWriter, flat_columns, read_log
from drake_disasm.scenario import Scenario
from sysid.export.consistent_inertia import inertial_of, pseudo_inertia
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import DEFAULT_SETTINGS
from sysid.models.joint_motion import JointMotionModel
from sysid.models.regressor import ArmRegressor
from sysid.workers import Workers
from tests.sysid.models.arm import write_two_link_arm

IIWA = "package://disasm_models/iiwa14/iiwa14.urdf"
IIWA_JOINTS = tuple(f"iiwa_joint_{i}" for i in range(1, 8))
_NOISE = 1e-6  # N m


@dataclass(frozen=True)
class Closed:
    """What of a closed loop an export looks at."""

    last: Fit


def two_links(path: Path) -> str:
    """Writes the URDF of an arm with two joints, and physical links."""
    text = write_two_link_arm(path, "<!-- mine -->").read_text()
    path.write_text(text.replace('izz="0.01"', 'izz="0.025"'))
    return str(path)


def changed(pi: np.ndarray, size: float, seed: int = 0) -> np.ndarray:
    """Returns physical bodies that differ from those of pi by a share."""
    generator, parts = np.random.default_rng(seed), pi.reshape(-1, 10).copy()
    for part in (each for each in parts if each[0] > 0.0):
        turn = np.eye(4) + size * generator.normal(size=(4, 4))
        root = np.linalg.cholesky(pseudo_inertia(part)) @ turn
        part[:] = inertial_of(root @ root.T)
    return parts.reshape(-1)


def smooth(joints: int, rows: int = 250) -> tuple[np.ndarray, ...]:
    """Returns time (n,) and q, v, vd (n, joints) of a motion that excites an arm."""
    generator, time = np.random.default_rng(3), 0.01 * np.arange(rows)
    w = generator.uniform(2.0, 9.0, (3, joints))
    phase = time[:, None, None] * w + generator.uniform(0.0, 6.0, (3, joints))
    motion = np.sin(phase), w * np.cos(phase), -(w**2) * np.sin(phase)
    return (time, *(each.sum(axis=1) for each in motion))


def fitted(
    folder: Path,
    urdf: str,
    joints: Sequence[str],
    effects: Sequence[Effect] = (),
    size: float = 0.2,
) -> Closed:
    """Returns the fit to a simulated arm whose bodies differ from the URDF's.

    Args:
        folder: of the log.
        urdf: of the nominal arm.
        joints: of the arm.
        effects: that act, and that the model has.
        size: of the difference.
    """
    time, q, v, vd = smooth(len(joints))
    arm = ArmRegressor(urdf, joints)
    pi = changed(arm.inertia, size)
    columns = {"time": time, "q": q, "v": v, "vd": vd, "tau": 0.0 * q}
    header = LogHeader("joint_motion", "excite", {}, joints=tuple(joints), urdf=urdf)
    with LogWriter(folder, header) as writer:
        writer.write_episode(flat_columns("joint_motion", columns))
    model = JointMotionModel([read_log(folder)], scenario=Scenario(effects=[*effects]))
    _, base = model.rigid_bodies()
    noise = _NOISE * np.random.default_rng(1).normal(size=q.shape)
    beta = base.beta(pi)
    tau = model.predict(beta, slice(0, len(q))) + noise
    model = model.with_measurements(model.measurements.with_values(tau))
    wide = [
        dataclasses.replace(p, low=p.nominal - 1e3, high=p.nominal + 1e3)
        for p in model.parameters
    ]
    model = model.replace(parameters=tuple(wide))
    fitter = Fitter.of(model, Workers(1), np.inf, DEFAULT_SETTINGS)
    values = dict(zip((p.name for p in wide), beta.tolist(), strict=True))
    return Closed(fitter.fit((), values=values))


def text_of(urdf: str) -> bytes:
    """Returns a URDF as it is on disk."""
    return model_path(urdf).read_bytes()

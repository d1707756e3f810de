"""Logs that are what they say, made once."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drake_disasm.logs import Log, read_log, write_static_wrench
from sysid.models.regressor import ArmRegressor
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log
from tests.sysid.models.arm import JOINTS, write_motion_log, write_two_link_arm

_G, _MASS, _CENTRE = 9.81, 1.2, (0.01, -0.02, 0.06)


@pytest.fixture(scope="session")
def twin_log(tmp_path_factory) -> Log:
    """Strokes of the twin: 12 episodes of 25 steps, nothing hidden."""
    folder = tmp_path_factory.mktemp("twin") / "log"
    transitions_log(folder, nominal(), [], seed=0)
    return read_log(folder)


def readings(folder: Path, frame: str = "S", rows: int = 100) -> Log:
    """Writes readings at rest, a second apart, of a payload on a sensor with a bias."""
    random = np.random.default_rng(0)
    turn = Rotation.random(rows, random_state=0)
    g_S = turn.inv().apply([0.0, 0.0, -_G])
    wrench = _MASS * np.hstack([g_S, np.cross(_CENTRE, g_S)])
    wrench += [1.0, -2.0, 3.0, 0.1, -0.2, 0.05]
    wrench += random.standard_normal(wrench.shape) * ([0.05] * 3 + [0.002] * 3)
    if frame == "W":
        wrench = np.hstack([turn.apply(part) for part in np.hsplit(wrench, 2)])
    quaternions = turn.as_quat()[:, [3, 0, 1, 2]]
    time = np.arange(rows, dtype=float)
    write_static_wrench(folder, quaternions, wrench, frame, "weigh", {}, time)
    return read_log(folder)


@pytest.fixture(scope="session")
def static_log(tmp_path_factory) -> Log:
    """Readings at rest in the frame of the sensor."""
    return readings(tmp_path_factory.mktemp("static") / "log")


@pytest.fixture(scope="session")
def world_log(tmp_path_factory) -> Log:
    """The same in the world's frame."""
    return readings(tmp_path_factory.mktemp("world") / "log", "W")


@pytest.fixture(scope="session")
def arm_log(tmp_path_factory) -> Log:
    """Two joints that swing for 8 s, with noise and friction that nobody declared."""
    folder = tmp_path_factory.mktemp("arm")
    urdf = write_two_link_arm(folder / "two.urdf")
    time = 0.01 * np.arange(800)
    q, v, vd = np.zeros((3, len(time), 2))
    for joint, pairs in enumerate([[(0.8, 3.0), (0.3, 7.1)], [(0.9, 4.3), (0.2, 9.7)]]):
        for size, omega in pairs:
            phase = omega * time
            q[:, joint] += size * np.sin(phase)
            v[:, joint] += size * omega * np.cos(phase)
            vd[:, joint] -= size * omega**2 * np.sin(phase)
    arm = ArmRegressor(str(urdf), JOINTS)
    tau = arm.regressor(q, v, vd) @ arm.inertia + 0.3 * np.sign(v) + 0.1 * v
    tau += 0.02 * np.random.default_rng(0).standard_normal(tau.shape)
    columns = {"time": time, "q": q, "v": v, "vd": vd, "tau": tau}
    return write_motion_log(folder / "log", urdf, columns)

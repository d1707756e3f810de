"""A bag of two joints and a wrench, whose motion and forces are closed forms."""

from pathlib import Path

import numpy as np

from drake_disasm.stations.fake_cell.bag import FakeBag, bag_times


def record_arm(path: Path, shift: float, seed: int = 1) -> None:
    """Writes 20 s of two joints at 200 Hz and a wrench at 500 Hz.

    The sensor's clock is late by `shift`: its stamps say t + shift of what was at t.

    Args:
        path: of the bag.
        shift: [s].
        seed: of jitter, losses and noise.
    """
    random, bag = np.random.default_rng(seed), FakeBag()
    names = ["shoulder", "elbow"]
    for time in bag_times(random, 20.0, 200.0):
        q, v, vd = motion(time)
        tau = 3.0 * vd + np.sin(q) + 0.4 * np.sign(v) + 0.05 * random.standard_normal(2)
        order = slice(None, None, -1) if random.random() < 0.5 else slice(None)
        bag.add_joint_state(time, names[order], q[order], tau[order])
    for time in bag_times(random, 20.0, 500.0):
        q, _, vd = motion(time)
        load = np.array([*(2.0 * vd), *np.sin(q), *np.cos(q)])
        bag.add_wrench(time + shift, load + 0.02 * random.standard_normal(6))
    bag.write(path, True)


def motion(time: np.ndarray | float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns positions, velocities and accelerations (2,) of the joints."""
    w, a = 2.0 * np.pi * np.array([0.4, 0.9]), np.array([0.8, 0.5])
    phase = w * np.asarray(time)
    return a * np.sin(phase), a * w * np.cos(phase), -a * w**2 * np.sin(phase)

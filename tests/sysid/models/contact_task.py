"""A simulated sensor in a task with contact: it presses, slides and turns by turns."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation, Slerp

from drake_disasm.logs import Log, LogHeader, LogWriter, flat_columns, read_log

CYCLE = 12.0  # s
MASS, CENTRE = 1.2, np.array([0.01, -0.02, 0.06])
NOISE = np.array([0.05] * 3 + [0.002] * 3)
_G_W = [0.0, 0.0, -9.81]


@dataclass(frozen=True)
class Task:
    """What a sensor went through.

    Attributes:
        time: (n,) [s].
        R_WS: (n,) orientations.
        load: (n, 6) wrench of the load and the zero [N, N m].
        contact: (n, 6) wrench of the contact.
        noise: (n, 6).
        free: (n,) whether each row is in free space.
    """

    time: np.ndarray
    R_WS: Rotation
    load: np.ndarray
    contact: np.ndarray
    noise: np.ndarray
    free: np.ndarray

    @property
    def wrench(self) -> np.ndarray:
        """What is read (n, 6)."""
        return self.load + self.contact + self.noise

    def plus(self, more: np.ndarray) -> Self:
        """The same task with something more (n, 6) in the reading."""
        return replace(self, load=self.load + more)


def task(seed: int = 0, share: float = 0.3, cycles: int = 10, rate: float = 10.0):
    """Returns a task of some cycles, a share of each in free space, where it turns.

    Forces of contact are held within the noise while it presses, and change within a
    second or so while it slides; while it turns about z, the torque grows.
    """
    random = np.random.default_rng(seed)
    time = np.arange(int(cycles * CYCLE * rate)) / rate
    cycle, phase = (time // CYCLE).astype(int), time % CYCLE / CYCLE
    free = phase < share
    R_WS = _orientations(random, time, share, cycles)
    done = np.clip((phase - share) / (1.0 - share), 0.0, 1.0)  # of the contact
    ramp = np.clip(np.minimum(done, 1 - done) * (1 - share) * CYCLE / 0.3, 0, 1) * ~free
    slides, turns = cycle % 3 == 1, cycle % 3 == 2
    slow = lfilter([1.0], [1.0, -0.9], random.standard_normal((len(time), 2)), axis=0)
    contact = np.zeros((len(time), 6))
    contact[:, 2] = random.uniform(3.0, 12.0, cycles)[cycle] + 0.3 * slides * slow[:, 0]
    contact[:, 0] = slides * (np.sign(np.sin(2.0 * time)) + 0.3 * slow[:, 1])
    contact[:, 5] = turns * (0.5 + 0.4 * done)
    contact *= ramp[:, None]
    R_WS = R_WS * Rotation.from_rotvec(np.outer(1.2 * turns * ~free * done, [0, 0, 1]))
    g_S = R_WS.inv().apply(_G_W)
    load = MASS * np.hstack([g_S, np.cross(CENTRE, g_S)])
    load += [1.0, -2.0, 3.0, 0.1, -0.2, 0.05]
    noise = NOISE * random.standard_normal((len(time), 6))
    return Task(time, R_WS, load, contact, noise, free)


def _orientations(random, time, share, cycles) -> Rotation:
    vectors = random.uniform(-1.0, 1.0, (cycles + 1, 3)) * [1.0, 1.0, 1.5]
    begin = CYCLE * np.arange(cycles)
    moves = begin[:, None] + share * CYCLE * np.array([0.25, 0.75])
    key = np.concatenate([[-1.0], moves.reshape(-1), [np.inf]])
    key[-1] = time[-1] + 1.0
    number = np.concatenate([[0], np.repeat(np.arange(cycles + 1), 2)[1:-1], [cycles]])
    return Slerp(key, Rotation.from_rotvec(vectors[number]))(time)


def write_task(folder: Path, of: Task, states_free: bool = False) -> Log:
    """Writes a contact log of a task; returns it."""
    columns = {
        "time": of.time,
        "R_WS": of.R_WS.as_quat(scalar_first=True),
        "wrench": of.wrench,
    }
    if states_free:
        columns["free"] = of.free.astype(float)
    header = LogHeader("contact", "press", {}, frames={"wrench": "S"})
    with LogWriter(folder, header) as writer:
        writer.write_episode(flat_columns("contact", columns))
    return read_log(folder)

"""A simulated servo that swings a pendulum, for tests."""

from pathlib import Path

import numpy as np

from drake_disasm.logs import Log, LogHeader, LogWriter, flat_columns, read_log
from sysid.models.response.drive import Drive, Inputs
from sysid.models.response.near_motion import Bodies
from sysid.models.response.rigid_bodies import RigidBodies
from sysid.models.response.segments import Segment
from sysid.models.response.simulation import Arm, ParameterSet, simulate

STIFFNESS, DAMPING, DELAY = 1.5, 0.08, 0.012
QUANTUM = 2.0 * np.pi / 4096
PENDULUM = """<robot name="pendulum"><link name="base"/><link name="arm"><inertial>
<origin xyz="0 0 -0.1"/><mass value="0.5"/>
<inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial></link>
<joint name="servo" type="revolute"><parent link="base"/><child link="arm"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="20" effort="5"/></joint>
</robot>"""


def write_pendulum(path: Path) -> Path:
    """Writes the URDF of the pendulum."""
    path.write_text(PENDULUM)
    return path


def goals(time: np.ndarray, number: int) -> np.ndarray:
    """Returns commanded positions (n, 1): two swings, the second ever faster."""
    if number % 2:
        return np.sin(0.7 * time**2)[:, None]
    return (0.7 * np.sin(2.0 * time) + 0.4 * np.sin(5.3 * time))[:, None]


def write_response(
    folder: Path,
    *effects,
    episodes=2,
    duration=6.0,
    compensates=False,
    quantum=QUANTUM,
    **columns,
) -> Log:
    """Writes what a servo with effects does, simulated in fine steps.

    Args:
        folder: of the log.
        effects: at the joint.
        episodes: how many.
        duration: of each [s].
        compensates: whether the controller adds what gravity takes.
        quantum: of the encoder [rad].
        columns: beside those of the positions, (n, 1) each.
    """
    folder.parent.mkdir(exist_ok=True)
    urdf = write_pendulum(folder.parent / "pendulum.urdf")
    arm = Arm(("servo",), Bodies(RigidBodies(str(urdf), ("servo",)), compensates))
    drive = Drive(np.array([STIFFNESS]), np.array([DAMPING]), np.inf)
    parameters = ParameterSet(drive, DELAY, effects)
    header = LogHeader("joint_response", "swing", {}, joints=("servo",), urdf=str(urdf))
    time = 0.005 * np.arange(round(duration / 0.005) + 1)
    one = np.ones((len(time), 1))
    gain, on = columns.get("gain", one), columns.get("enabled", one)
    commanded = [goals(time, number) for number in range(episodes)]
    segments = [
        Segment(0.0, *np.zeros((2, 1)), time, inputs, np.zeros(1))
        for inputs in (Inputs(goal, 0.0 * goal, gain, one, on) for goal in commanded)
    ]
    motion = simulate(arm, [parameters], segments, 5 * (len(time) - 1), 0.001)
    positions = np.round(motion.q[::5, 0] / quantum).swapaxes(0, 1) * quantum
    with LogWriter(folder, header) as writer:
        for goal, q in zip(commanded, positions, strict=True):
            table = {"time": time, "q_commanded": goal, "q": q, **columns}
            writer.write_episode(flat_columns("joint_response", table))
    return read_log(folder)

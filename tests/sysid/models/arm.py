"""A small arm for tests."""

from pathlib import Path

import numpy as np

from drake_disasm.logs import Log, LogHeader, LogWriter, flat_columns, read_log

JOINTS = ("shoulder", "elbow")

LINK = """<link name="{0}"><inertial><origin xyz="{1}"/><mass value="{2}"/>
<inertia ixx="0.02" ixy="0.001" ixz="0" iyy="0.03" iyz="0" izz="0.01"/>
</inertial></link>"""
JOINT = """<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/>
<origin xyz="{3}" rpy="{4}"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" velocity="20" effort="99"/></joint>"""


def write_two_link_arm(path: Path, more: str = "") -> Path:
    """Writes the URDF of an arm with two joints, and more elements."""
    text = f'<robot name="two"><link name="base"/>{more}'
    text += LINK.format("upper", "0.1 0.02 0.1", 2.0)
    text += LINK.format("lower", "0.05 0 0.1", 1.0)
    text += JOINT.format("shoulder", "base", "upper", "0 0 0.3", "1.2 0 0")
    text += JOINT.format("elbow", "upper", "lower", "0 0.4 0", "0 1.3 0.2")
    path.write_text(text + "</robot>")
    return path


def smooth_motion(time: np.ndarray) -> tuple[np.ndarray, ...]:
    """Returns q, v, vd (n, 2) of two joints at times (n,)."""
    w = np.array([[2.0, 3.1], [5.3, 7.7]])
    phase = time[:, None, None] * w
    q, v = np.sin(phase), w * np.cos(phase)
    return tuple(a.sum(axis=1) for a in (q, v, -(w**2) * q))


def write_motion_log(
    folder: Path, urdf: Path, columns: dict[str, np.ndarray], joints=JOINTS
) -> Log:
    """Writes a log of one episode of an arm's motion, and reads it."""
    header = LogHeader("joint_motion", "excite", {}, joints=joints, urdf=str(urdf))
    with LogWriter(folder, header) as writer:
        writer.write_episode(flat_columns("joint_motion", columns))
    return read_log(folder)

"""Turns the real measurements of ../shared/data into logs of our format.

    python -m tests.sysid.real_data out/real

writes `static_7`, `static_100`, `lwr4_1`, `lwr4_2` and `lwr4.urdf` there.
"""

import csv
import sys
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.logs import LogHeader, LogWriter, flat_columns, write_static_wrench

DATA = Path(__file__).parents[2].parent / "shared" / "data"

_LINK = """  <link name="{child}"><inertial>
    <origin xyz="{com_x} {com_y} {com_z}"/><mass value="{mass}"/>
    <inertia ixx="{ixx}" ixy="{ixy}" ixz="{ixz}" iyy="{iyy}" iyz="{iyz}" izz="{izz}"/>
  </inertial></link>
"""
_JOINT = """  <joint name="{joint}" type="{type}">
    <parent link="{parent}"/><child link="{child}"/>
    <origin xyz="{x} {y} {z}" rpy="{roll} {pitch} {yaw}"/>
    <axis xyz="{axis_x} {axis_y} {axis_z}"/>
    <limit lower="{lower}" upper="{upper}" velocity="{velocity}" effort="{effort}"/>
  </joint>
"""


def real_folder(name: str) -> Path:
    """Returns a folder of real measurements; skips the test if it is not there."""
    if not (DATA / name).is_dir():
        pytest.skip(f"no real data in {DATA / name}")
    return DATA / name


def write_static(rows: int, folder: Path) -> Path:
    """Writes the 7 or 100 readings of a real sensor as a log."""
    source = real_folder("ft_static")
    pose = np.loadtxt(source / f"pose_{rows}.txt", delimiter=",")
    wrench = np.loadtxt(source / f"wrench_{rows}.txt", delimiter=",")
    provenance = {"source": "leledeyuan00/Gravity-Compensation-F-T-sensor"}
    quaternions = pose[:, [6, 3, 4, 5]]
    return write_static_wrench(folder, quaternions, wrench, "W", "weigh", provenance)


def write_arm(path: Path) -> Path:
    """Writes the URDF of the real arm from its table."""
    with (real_folder("kuka_lwr4") / "arm.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    text = '<robot name="lwr4">\n  <link name="box"/>\n'
    for row in rows:
        values = {key: value or "0" for key, value in row.items()}
        if row["type"] == "fixed":
            values["axis_x"] = "1"
        text += _LINK.format(**values) + _JOINT.format(**values)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text + "</robot>\n")
    return path


def write_motion(number: int, folder: Path, urdf: Path) -> Path:
    """Writes a recording of the real arm as a log of joint motion."""
    data = np.load(real_folder("kuka_lwr4") / f"recording_{number}.npz")
    header = LogHeader(
        kind="joint_motion",
        task="excite",
        provenance={"source": "kjyv/FloBaRoID, data/KUKA/HW"},
        joints=tuple(f"lwr_{i}_joint" for i in range(7)),
        urdf=str(urdf),
    )
    columns = {
        "time": data["times"] - data["times"][0],
        "q": data["positions"],
        "v": data["velocities"],
        "vd": data["accelerations"],
        "tau": data["torques"],
    }
    with LogWriter(folder, header) as writer:
        writer.write_episode(flat_columns("joint_motion", columns))
    return folder


if __name__ == "__main__":
    out = Path(sys.argv[1]).resolve()
    for poses in (7, 100):
        write_static(poses, out / f"static_{poses}")
    arm = write_arm(out / "lwr4.urdf")
    for recording in (1, 2):
        write_motion(recording, out / f"lwr4_{recording}", arm)

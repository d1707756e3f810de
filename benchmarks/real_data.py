"""Writes the real measurements of ../shared/data as logs of our format.

In the folder it writes, for `drake-disasm check-log`, `identify` and `close-loop`:
`static_7` and `static_100` (a force/torque sensor at rest), `lwr4_1` and `lwr4_2` with
`lwr4.urdf` (a KUKA LWR 4+ arm), `emps_1` and `emps_2` with `emps.urdf` (a linear
drive).
"""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.signal import butter, filtfilt

from drake_disasm.common import program
from drake_disasm.common.errors import DisasmError
from drake_disasm.logs import LogHeader, LogWriter, flat_columns, write_static_wrench

DATA = Path(__file__).parents[2] / "shared" / "data"
_EXAMPLES = """examples:
  python benchmarks/real_data.py real
  drake-disasm close-loop --log real/static_100 --out out/static
  drake-disasm close-loop --log real/lwr4_1 real/lwr4_2 --held-out lwr4_2 --out out/arm
"""

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

_SLIDE = """<robot name="emps"><link name="bed"/>
  <link name="carriage"><inertial><mass value="95"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="slide" type="prismatic"><parent link="bed"/><child link="carriage"/>
    <axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="400"/></joint>
</robot>
"""
_EMPS_ENDS = 50  # rows where the filter has no neighbours


class MissingDataError(DisasmError):
    """A folder of real measurements is not there."""


def data_folder(name: str) -> Path:
    """Returns a folder of real measurements.

    Raises:
        MissingDataError: it is not there.
    """
    if not (DATA / name).is_dir():
        raise MissingDataError(
            f"{DATA / name}: no such folder of real measurements; they are not part of "
            "the repository"
        )
    return DATA / name


def write_static(rows: int, folder: Path) -> Path:
    """Writes the 7 or 100 readings of a real sensor as a log."""
    source = data_folder("ft_static")
    pose = np.loadtxt(source / f"pose_{rows}.txt", delimiter=",")
    wrench = np.loadtxt(source / f"wrench_{rows}.txt", delimiter=",")
    provenance = {"source": "leledeyuan00/Gravity-Compensation-F-T-sensor"}
    quaternions = pose[:, [6, 3, 4, 5]]
    return write_static_wrench(folder, quaternions, wrench, "W", "weigh", provenance)


def write_arm(path: Path) -> Path:
    """Writes the URDF of the real arm from its table."""
    with (data_folder("kuka_lwr4") / "arm.csv").open() as stream:
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
    data = np.load(data_folder("kuka_lwr4") / f"recording_{number}.npz")
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


def write_slide(path: Path) -> Path:
    """Writes the URDF of EMPS: a carriage on a ball screw."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(_SLIDE)
    return path


def write_emps(number: int, folder: Path, urdf: Path, cutoff: float = 60.0) -> Path:
    """Writes a record of EMPS as a log of joint motion.

    Position and force pass a Butterworth filter of fourth order, forth and back;
    velocity and acceleration are central differences.

    Args:
        number: 1 or 2, with pulses.
        folder: of the log.
        urdf: by `write_slide`.
        cutoff: of the filter [Hz].
    """
    source = data_folder("emps") / ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")[number - 1]
    data = {key: value[:, 0] for key, value in loadmat(source).items() if key[0] != "_"}
    time = data["t"]
    low = butter(4, 2.0 * cutoff * np.median(np.diff(time)))
    q = filtfilt(*low, data["qm"])
    v = np.gradient(q, time)
    columns = {
        "time": time - time[_EMPS_ENDS],
        "q": q,
        "v": v,
        "vd": np.gradient(v, time),
        "tau": filtfilt(*low, data["gtau"] * data["vir"]),
    }
    inner = slice(_EMPS_ENDS, -_EMPS_ENDS)
    parts = {k: c[inner] if k == "time" else c[inner, None] for k, c in columns.items()}
    header = LogHeader(
        kind="joint_motion",
        task="track",
        provenance={"source": "EMPS, by forgi86/sysid-neural-continuous"},
        joints=("slide",),
        urdf=str(urdf),
    )
    with LogWriter(folder, header) as writer:
        writer.write_episode(flat_columns("joint_motion", parts))
    return folder


def main(arguments: Sequence[str]) -> int:
    """Writes the logs; returns the exit status."""
    parser = program.argument_parser(
        "python benchmarks/real_data.py", __doc__, _EXAMPLES
    )
    parser.add_argument("out", type=Path, help="folder of the logs")
    out = parser.parse_args(arguments).out.resolve()
    for poses in (7, 100):
        print(write_static(poses, out / f"static_{poses}"))
    arm, slide = write_arm(out / "lwr4.urdf"), write_slide(out / "emps.urdf")
    for recording in (1, 2):
        print(write_motion(recording, out / f"lwr4_{recording}", arm))
        print(write_emps(recording, out / f"emps_{recording}", slide))
    return 0


if __name__ == "__main__":
    program.run(main)
